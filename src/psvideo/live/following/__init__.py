"""The strobe's clock while the camera runs. A frame has a number, by the source's count, and a place in time, by what
the strobe says: ``frame_places``.

``seeking`` says when the strobe is looked for, and in which frames; ``lock`` finds it there from nothing, and
``catching_up`` follows it up to the newest frame, from the one on in which it is seen (``first_shown``). ``follow``
keeps it frame by frame, on a ``window`` of profiles: ``foretold`` holds what came against what was to come,
``seen_share`` judges whether it is the strobe, ``lateness`` measures by how much it is late, ``phase_filter`` makes a
clock of that, and ``trims`` are what it was told to do; ``between_frames`` says where no row shows it. ``history`` is
its timing afterwards, and ``light_names`` says how the lights' names are known. ``genlock`` and ``holding`` go the
other way: they trim the strobe to the camera.
"""
