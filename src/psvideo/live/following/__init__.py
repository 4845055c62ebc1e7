"""The strobe's clock while the camera runs. ``lock`` finds it from nothing, on a ``window`` of profiles.

``first_shown`` says from which frame on it is seen. ``follow`` keeps it frame by frame, with ``phase_filter`` and
``trims``; ``history`` is its timing afterwards, and ``light_names`` says how the lights' names are known. ``foretold``
holds what came against what was to come. ``genlock`` and ``holding`` go the other way: they trim the strobe to the
camera.
"""
