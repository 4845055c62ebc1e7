"""Where things move between the flashes of a light.

``moving`` finds one velocity for every pixel, from the plates of all lights together (``followed`` has both records).
It chooses between what ``all_lights`` propose: ``flow`` (dense optical flow, on 8-bit sketches made by
``sketch_kernel`` and compared by their ``detail``, loops in ``detail_kernel``), ``correlation`` (how far the picture
shifted as a whole), and rest; ``between_lights`` leads from the edges that one light shows to those of the next, and
says whether neighbouring lights agree along a velocity; ``plane_fits`` evens out what was found and leads on beside it.
Its loops are in ``moving_kernel``. ``brightness`` removes changes of exposure first. ``vectors`` makes motion vectors
for compositing.

``own_flow`` is for eyes: how a light's own plates lead into each other where all lights have no motion in common.
"""
