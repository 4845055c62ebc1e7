"""Frames and their timing in, one clean picture per light and round out.

``gather`` is the whole: ``timed`` and ``naming`` give times and names of lights, ``split`` makes the plates of
flashes, ``ambient`` takes the room's light off, ``demultiplexed`` and ``unmixed`` (with ``surface_colour``) give
single lights where several flash together, ``light_plate`` and ``sequence`` collect rounds, ``nearest_rows`` lends
rows that a flash missed, ``upright`` turns, ``align`` brings a round to one instant. A plate is a ``mixture`` of
frames, made by ``ready_mixture``, ``mixing_kernel`` and ``thinning_kernel`` where somebody looks at it. ``part``: a
range of frames by itself. ``beauty``: all lights at once. ``hudon2015``: the published method, to compare with.
"""
