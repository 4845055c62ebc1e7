"""Frames that look like those before them because others are missing: a cycle later lights fall nearly there again."""

from collections.abc import Callable

import numpy as np

from psvideo.model.arrays import Doubles, Integers
from psvideo.sync.rowfit.tracking.losses import SUSPICIOUS


def rather_missing(
    course: Integers, table: Doubles, least: int, left: Callable[[Integers], float], sign: int
) -> Integers:
    """Return a course (frame,) with every step back for which missing frames leave clearly less as such a step ahead.

    ``table`` (frame, extra) are the losses of frames that are ``least`` frames away and more, ``left`` gives what a
    course leaves once brightnesses are fitted again. Where a cycle is 2.01 frames and one is missing, the next shows
    the same lights as the one before it, half a flash later; that it was repeated predicts flashes twice as far off::

        numbered  24  25  26  27      course as repeated   0  -1  -1  -1
        true      24  26  27  28      course with a hole   0   1   1   1
    """
    onward, ahead = course[::sign], table[::sign]
    for place in np.flatnonzero(np.diff(onward, prepend=0) == -1).tolist():
        moves = np.arange(2, table.shape[1] + least - int(onward[place:].max()))
        at = np.arange(place, len(onward))
        losses = [float(ahead[at, onward[place:] + move - least].sum()) for move in moves]
        if not losses or min(losses) > float(ahead[at, onward[place:] - least].sum()):
            continue
        other = onward.copy()
        other[place:] += moves[int(np.argmin(losses))]
        if left(other[::sign]) < left(onward[::sign]) - SUSPICIOUS:
            onward = other
    return onward[::sign]
