"""Whether a picture shifts as a whole, by another amount under every light, and not as things move in it."""

from collections.abc import Sequence

import cv2
import numpy as np

from psvideo.compute.ranks import quantile
from psvideo.compute.threads import over_ranges
from psvideo.model.arrays import Doubles, Floats
from psvideo.plates.align.shake.registered import shifted
from psvideo.plates.align.velocity.flow import changed
from psvideo.plates.align.velocity.followed import Pair, mean_over

STIRS, MOST_STEP = 0.25, np.float32(40)
"""A picture shifts as a whole only if the first share of its detail changes, steps of more codes counted as the
second."""
WINDOW_PX, ODD = 9, np.float32(20.0)
"""Pictures are compared over the first; what differs by the second, in codes of detail, is half unlike."""
UNLIKE, EXPLAINED, FOLLOWS = 0.1, 0.65, 0.6
"""Of what is more unlike at rest than the first, per light, the shifts must leave less than the second in more than
this share; noise is taken off."""
QUIET = 0.25
"""Noise leaves as much as this share of the picture is unlike by, at most."""


def stirs(pairs: Sequence[Pair]) -> bool:
    """Return whether much of what has detail changes."""
    total = moved = 0.0
    for pair in pairs:
        across, down = (cv2.Sobel(pair.before.blocks, cv2.CV_32F, *way) for way in ((1, 0), (0, 1)))
        size = np.minimum(np.hypot(across, down), MOST_STEP)
        total += float(size.sum())
        moved += float(size[changed(pair.before, pair.after)].sum())
    return moved > STIRS * total


def explained_by(details: Sequence[tuple[Floats, ...]], shifts: Doubles) -> bool:
    """Return whether shifts (light, 2) explain most of what changes between two pictures of each light."""
    rest, own = (_unlike(details, way) for way in (np.zeros_like(shifts), shifts))
    noise = np.float32(quantile(own, QUIET))
    rest, own = rest - noise, own - noise
    puzzling = rest > np.float32(UNLIKE * len(details))
    if not puzzling.any():
        return False
    return float(np.mean(own[puzzling] < np.float32(EXPLAINED) * rest[puzzling])) > FOLLOWS


def _unlike(details: Sequence[tuple[Floats, ...]], shifts: Doubles) -> Floats:
    """Return how unlike the lights' plates are, each pair shifted by its own (light, 2): (row, col), 0 to as many as
    there are lights."""

    def run(light: int, _: int) -> Floats:
        before, after = details[light]
        square = np.square(before - shifted(after, -shifts[light]))
        return np.asarray(square / (square + ODD * ODD), np.float32)

    total = np.zeros_like(details[0][0])
    for one in over_ranges(run, len(details), each=1):
        total += one
    return mean_over(total, WINDOW_PX)
