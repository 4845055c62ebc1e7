"""Whole commands as functions: a clip in, a folder of files out, with the same checks as on the command line.

Commands are modules here with their own names: ``normals``, ``split``, ``sync``, ``stills``, ``check``, ``view``,
``live``, ``demo``, ``doctor``, ``farm``, ``capture_plan``. Those that are several are rooms: ``calibrate``, ``strobe``.

What all of them use: ``caller`` (who hears of a run), ``output`` (where it writes), ``lighting`` (what it solves with).
What single ones use: ``sync_cameras`` (sync of several cameras), ``checked`` (what a check found), ``live_sources``,
``live_strobe``, ``live_rehearsal``, and ``compiling`` with its ``small_pictures`` (loops compiled ahead of first use).

Rooms, from the bottom up:

- ``delivery``: what a result needs besides normals, and what lies beside it: cameras, movies, timelines
- ``instants``: solves the instants of a clip one after the other and writes them; in one go or in pieces
- ``photographs``: lights and doubts of still pictures
- ``many_takes``: commands over several takes, in this process or on many machines
"""
