"""Readout time from the stripes that a blinking LED leaves in a rolling-shutter picture.

``readout`` does it: ``led_pictures`` reads, ``spectrum`` and ``detection`` find stripes, ``waveform`` fits their
period by the ``stripe_model``, ``error`` says how certain it is, ``steps`` which way the camera reads; ``records``
writes the result for the table of cameras.
"""
