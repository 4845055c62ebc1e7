"""Measurements in, judgements out: one line for each thing, with advice.

``every_line`` puts them together: ``time`` (strobe, order, frames, motion), ``of_exposure``, ``of_lamps``,
``of_ambient``, ``of_rig`` (by ``rig_by_plates`` and ``rig_by_normals``), ``result`` (accuracy, validity, focus,
steadiness). ``powers`` is for the live view alone, ``of_frames`` for ``psvideo check`` alone: frames before they are
plates.
"""
