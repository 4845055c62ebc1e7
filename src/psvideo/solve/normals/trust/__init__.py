"""How far every normal may be off, and which normals are valid. ``judging`` does it, ``judging_kernel`` is its loop.

Noise is only one source of error, and spreads farther where fewer lights reach (``fewer_lights``). The others:
``doubting`` (surfaces that are not matte, wrong rigs; ``doubting_kernel`` has its loops), ``indirect`` (light from
other surfaces, looked for while the plates are being solved), ``near_spread`` (near lights, whose directions depend on
the distance), ``moving_doubt`` (plates that do not match after alignment), ``few_checked`` (by how much a model of the
subject would turn normals under four and five lights), and ``unchecked`` (what three lights leave of real surfaces, and
show nowhere).
"""
