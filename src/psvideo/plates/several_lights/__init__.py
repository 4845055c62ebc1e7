"""Flashes in which more than one light is on: ``demultiplexed`` solves patterns, ``unmixed`` LEDs of different colours.

``surface_colour`` finds for the latter what colour the surface itself has; ``clipped_flashes`` says where the former
say nothing.
"""
