"""Readout time from the stripes that a blinking LED leaves in a rolling-shutter picture."""
