"""Photographs of a still scene, one per light: what ``psvideo stills`` and the calibrations need of them.

``light_sets`` reads one picture per light, as ``sets_of_files`` and ``sets_of_clip`` have them (``opened_sets``), and
``same_scene`` doubts those that differ. ``still_rig`` says where the lights are, ``still_clip`` makes a clip of them,
``still_doubts`` compares what was assumed with what they show at a ``glance``, and ``rti`` writes a relightable
picture.
"""
