"""Whether a fit can be believed, and what to say about it.

``believed`` decides, with ``rivals`` (other plans that may have been meant) and ``elsewhere`` (other times of the same
plan); ``refusal`` says why nothing was found (``overexposed``: too much clips), ``remarks`` and ``frame_remarks`` what
to distrust in what was, and ``swinging`` whose doing it is that light grows and shrinks, ``split_flashes`` whether it
was read by another curve.
"""
