"""Measurements in, judgements out: one line for each thing, with advice.

``every_line`` puts them together: ``of_timing`` (the strobe's times and the lights' order), ``of_rows`` (rows that
nobody saw, frames that are missing), ``of_motion`` (below 360 degrees with ``of_part_of_rows``), ``of_exposure``,
``of_saturation`` (clipping that the plan does not know of), ``of_steps`` (files that hold few levels), ``of_lamps``
(with ``weak_lamps`` and ``unsteady_lamps``),
``of_ambient``, ``of_rig`` (by ``rig_by_plates``, ``of_strengths``, ``rig_of_three``, and by normals: ``rig_by_slopes``,
``rig_by_facing``, ``rig_by_lean``),
``of_accuracy`` and ``of_validity`` (by ``typical_error``), ``of_steadiness`` (with focus), ``of_what_moves`` (validity
there).
``powers`` is for the live view alone, ``of_frames`` for ``psvideo check`` alone: frames before they are plates.
"""
