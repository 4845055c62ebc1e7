"""What two plates of one light both show: below 360 degrees every flash is seen by a part of the rows only.

Rows that saw but a part of a flash are brought to a full one, with their noise: they would seem to change.
"""

import cv2
import numpy as np

from psvideo.model.arrays import Bytes, Flags, Floats

LEAST_SHARE, LEAST_LINES = 0.1, 24
"""Fewer rows in one piece say nothing of motion, as a share of the picture's, and as a number of a small picture's."""
NOISIER, HARDLY = 1.5, 0.5
"""Rows are left out whose noise is so many times the usual, and by more than the second, in codes."""
Place = tuple[slice, slice]


def shown_alike(one: Bytes, other: Bytes, shown: Flags) -> Place | None:
    """Return the largest piece, as rows and columns, that two pictures (row, col) both show with about as much noise
    everywhere; None where it is small. ``shown``: which rows both show, (row, 1), or (1, col) of a picture that was
    turned."""
    if shown.all():
        return slice(0, one.shape[0]), slice(0, one.shape[1])
    axis = int(np.argmax(shown.shape))
    noise = _noise(one, other, across=1 - axis)
    known = shown.ravel()
    usual = float(np.median(noise[known])) if known.any() else 0.0
    first, end = _longest(known & (noise <= max(NOISIER * usual, usual + HARDLY)))
    if end - first < max(LEAST_LINES, LEAST_SHARE * len(known)):
        return None
    piece = slice(first, end)
    return (piece, slice(0, one.shape[1])) if axis == 0 else (slice(0, one.shape[0]), piece)


def _noise(one: Bytes, other: Bytes, *, across: int) -> Floats:
    """Return by how much fine detail differs in every row (``across`` 1) or column (0), in the median."""
    change = other.astype(np.float32) - one
    size = (3, 1) if across else (1, 3)  # along the line: others may not be shown
    return np.asarray(np.median(np.abs(change - cv2.blur(change, size)), axis=across))


def _longest(flags: Flags) -> tuple[int, int]:
    """Return where the longest run of flags begins and ends."""
    steps = np.flatnonzero(np.diff(np.r_[0, flags.astype(np.int8), 0]))
    runs = steps.reshape(-1, 2)
    if not len(runs):
        return 0, 0
    first, end = runs[np.argmax(runs[:, 1] - runs[:, 0])]
    return int(first), int(end)


def thinner(lines: Flags, chosen: range, step: int) -> Flags:
    """Return which lines are shown, (row, 1) or (1, col), of a picture's ``chosen`` rows and every ``step`` columns
    together."""
    if lines.shape[1] == 1:
        return lines[chosen] if len(lines) > 1 else lines
    return np.asarray(lines[:, : lines.shape[1] // step * step].reshape(1, -1, step).all(axis=2))
