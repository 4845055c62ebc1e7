"""Whole commands as functions: a clip in, a folder of files out, with the same checks as on the command line.

Commands are modules here with their own names: ``normals``, ``split``, ``sync`` and ``sync_cameras``, ``stills``,
``check``, ``view``, ``live``, ``demo``, ``doctor``, ``farm``, ``capture_plan``. Those that are several are rooms:
``calibrate``, ``strobe``.

Rooms that commands are made of, from the bottom up:

- ``steps``: who hears of a run, where it writes, what it solves with; and what single commands are made of
- ``delivery``: what a result needs besides normals, and what lies beside it: cameras, movies, timelines
- ``instants``: solves the instants of a clip one after the other and writes them; in one go or in pieces
- ``photographs``: lights and doubts of still pictures
- ``on_set``: what ``live`` does beside following and showing: sources, rehearsal, the strobe's board
- ``many_takes``: commands over several takes, in this process or on many machines
"""
