"""Live on the set: frames as they come in, the strobe's clock followed, the newest picture out, for as long as it runs.

``chain`` is what happens to a frame, without threads or clocks: begin there. ``running`` runs it beside a camera.

- frames: ``sources``, ``source``, ``ring`` (the newest ones), ``recording``, ``behind`` (what comes too fast)
- the clock: ``lock`` finds the strobe from nothing, on a ``window`` of profiles; ``follow`` keeps it frame by frame,
  with ``phase_filter`` and ``trims``; ``history`` is its timing afterwards; ``genlock`` and ``holding`` trim the strobe
  to the camera
- the picture: ``newest_round`` makes plates of the latest frames, ``smaller`` (``smaller_kernel``) and ``quality``
  keep up with the camera, ``newest_pictures`` and ``page_server`` show it
- while there is nothing to show: ``preparing``, ``waiting``
- beside it: ``watching`` (verdicts), ``ball_lights`` (a chrome ball), ``status``
"""
