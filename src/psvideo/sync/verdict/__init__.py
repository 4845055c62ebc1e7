"""Whether a fit can be believed, and what to say about it.

``believed`` decides, with ``rivals`` (other plans that may have been meant) and ``elsewhere`` (other times of the same
plan, as ``few_kinds`` of frames leave them open); ``refusal`` says why nothing was found (``overexposed``: too much
clips; ``other_strobe``: another one shows), ``remarks`` what to distrust in what was, with ``camera_remarks``,
``light_remarks`` and ``frame_remarks``, and ``swinging`` whose doing it is that light grows and shrinks,
``split_flashes`` whether it was read by another curve.
"""
