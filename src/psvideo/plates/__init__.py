"""Frames and their timing in, one clean picture per light and round (a plate) out.

``gather`` does it for a whole clip: begin there. On its way:

- times and names: ``named_timing`` (when flashes fired), ``timing_misfit`` (whether a file can say so of this take),
  ``naming`` (which light is which), ``used_flashes`` (which ones the frames that are used hold whole)
- plates of flashes: ``flash_plates``, by ``split``; ``nearest_rows`` fills rows that a flash missed from the nearest
  round that saw them, for which each is a ``waiting_plate``
- rounds: ``light_plate`` and ``sequence`` collect them, ``upright`` turns them

Besides: ``part`` (a range of frames alone), ``spread`` (a few rounds of a take, for what all share), ``beauty`` (all
lights at once), ``hudon2015`` (the published method, to compare with).

Rooms:

- ``mixing``: a plate as a weighted sum of rows of frames, whose pixels are computed where they are read
- ``ambient`` takes ambient light off
- ``several_lights``: flashes in which more than one light is on
- ``align`` brings a round to one instant
"""
