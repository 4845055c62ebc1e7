"""Flashes in which more than one light is on: ``demultiplexed`` solves patterns, ``unmixed`` LEDs of different colours.

For the latter, ``surface_colour`` finds what colour the surface itself has; for the former, ``clipped_flashes`` is where those that clip
say nothing.
"""
