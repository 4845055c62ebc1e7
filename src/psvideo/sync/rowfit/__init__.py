"""The strobe's times from row profiles: one model of what rows see, searched coarsely, tracked, and sharpened.

Every step of the fit solves ``normal_equations``; ``standard_error`` says how certain its times are.

``fit`` is the whole. ``beat`` holds the times that are looked for, ``profiles`` the data, ``row_model`` and ``kernel``
the compiled model and its fit. Left out: ``unlit`` (frames in the dark). Searched: ``seed``, ``search``,
``rounds_first`` (coded dark slots), ``retime`` (frames left out or repeated). Tracked: ``course``, ``track``, ``ends``.
Sharpened: ``refine``, ``freed`` (times that the plan has wrong), ``bend`` (clocks that drift), ``mains_swing`` (room
light on the mains), ``jitter``, ``softness``, ``restless`` with ``whitening`` (subjects that move), ``plateau`` (times
that no row shows). ``long_takes`` fits what holds throughout to some stretches of a long take, and the clock to all of
it.
"""
