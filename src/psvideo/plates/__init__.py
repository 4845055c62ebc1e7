"""Frames and their timing in, one clean picture per light and round (a plate) out.

``gather`` does it for a whole clip: begin there. On its way:

- times and names: ``timed`` (when flashes fired), ``naming`` (which light is which)
- plates of flashes: ``split``; ``nearest_rows`` fills rows that a flash missed from the nearest round that saw them
- ambient light: ``ambient`` takes it off
- several lights in one flash: ``demultiplexed``, ``unmixed`` (LEDs of different colours) with ``surface_colour``
- rounds: ``light_plate`` and ``sequence`` collect them, ``align`` brings a round to one instant, ``upright`` turns it

A plate is a ``mixture``: a weighted sum of rows of frames. Its pixels are computed only where they are read, by
``ready_mixture``, ``mixing_kernel`` and ``thinning_kernel``.

Besides: ``part`` (a range of frames alone), ``beauty`` (all lights at once), ``hudon2015`` (the published method, to
compare with).
"""
