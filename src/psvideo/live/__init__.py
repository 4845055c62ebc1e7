"""Live on the set: frames as they come in, the strobe's clock followed, the newest picture out, for as long as it runs.

``running`` is the whole, with threads and a clock; ``chain`` the same without either. Frames: ``sources``, ``source``,
``ring``, ``recording``, ``behind``. The clock: ``lock`` finds the strobe from nothing, on a ``window`` of profiles;
``follow`` keeps it frame by frame, with ``phase_filter`` and ``trims``; ``history`` is its timing afterwards;
``genlock`` and ``holding`` trim the strobe to the camera. The picture: ``newest_round`` makes plates of the latest
frames, ``smaller`` (``smaller_kernel``) and ``quality`` keep up with the camera, ``newest_pictures`` and
``page_server`` show it. While there is nothing to show: ``preparing``, ``waiting``. Beside it: ``watching``
(verdicts) and ``ball_lights`` (a chrome ball), ``status``.
"""
