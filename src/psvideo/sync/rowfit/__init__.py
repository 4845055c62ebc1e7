"""The strobe's times from row profiles: one model of what rows see, searched coarsely, tracked, and sharpened.

``fit`` does it: begin there. ``beat`` holds the times that are looked for, ``profiles`` the data, ``row_model`` and
``kernel`` the compiled model and its fit.

- left out beforehand: ``unlit`` (frames in the dark)
- searched: ``seed``, ``search``, ``rounds_first`` (coded dark slots), ``retime`` (frames left out or repeated)
- tracked: ``course``, ``track``, ``ends``
- sharpened: ``refine``, by steps of ``normal_equations``, with ``standard_error`` for how certain times are
- what else may be free: ``freed`` (times that the plan has wrong), ``bend`` (clocks that drift), ``mains_swing`` (room
  light on the mains), ``jitter``, ``softness``, ``restless`` with ``whitening`` (subjects that move), ``plateau``
  (times that no row shows)
- ``long_takes``: what holds throughout is fitted to some stretches of a long take, the clock to all of it
"""
