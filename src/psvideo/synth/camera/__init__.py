"""The virtual camera: sensor, exposure, noise, transfer curve, files.

``sensor`` integrates light row by row; ``noise`` and ``curves`` are what ``encode`` makes codes with; ``frames``
writes files, ``dpx_writer`` one kind of them. ``exposure`` is the short way, from plates in memory to frames.
"""
