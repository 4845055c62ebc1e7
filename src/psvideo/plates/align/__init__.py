"""Plates of one round show different instants; here they are brought to one.

``rounds`` does it, plate by plate while a clip is read: begin there. ``comb`` lists the instants that are wanted.
``light_history`` keeps sketches and plates (``packed`` into 16 bits, by ``pack_kernel``) for as long as an instant may
need them. ``between`` makes a light's plate at an instant from the two plates around it (its loop: ``blend_kernel``,
and of one of the two ``side_kernel``); ``pixel_sources`` decides which of the two each pixel comes from, and
``as_they_are`` (loop in ``as_they_are_kernel``) where nothing is to be moved, since only plates as they are show one
surface. ``by_surface`` chooses velocities by what the lights' directions tell. ``left_out`` says where a normal is
better without the lights of which nothing is sure. ``plate_lamps`` are the lights as these three need them: near ones
are evened out as if they were distant.

Rooms, from the bottom up:

- ``velocity``: where things move, found from all lights together
- ``doubt``: by how much a plate may be off because the two that it comes from do not match
- ``lent``: rows of other flashes brought to the instant of the plate that lacks them, below 360 degrees
- ``rigid``: how bodies move that turn, along ways that are curved
- ``shake``: where the picture is as a whole at every flash, where the camera shakes

``own_ways`` makes, for eyes, what no common motion explains between two plates.

What aligned plates are used for: ``open_shutter`` (motion blur), ``denoise`` (means over time).
"""
