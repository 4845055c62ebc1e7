"""Photographs of a still scene, one per light: what ``psvideo stills`` and the calibrations need of them.

``light_sets`` reads one picture per light from files, plates or a clip, ``still_rig`` says where the lights are,
``still_clip`` makes a clip of them, ``still_doubts`` compares what was assumed with what they show at a ``glance``, and
``rti`` writes a relightable picture.
"""
