"""Whole calibrations as functions: pictures in, a rig file, a flat field or a readout time out."""
