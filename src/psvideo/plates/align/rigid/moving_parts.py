"""What belongs together of what was found to move: a body each, as far as one may guess, with what is around it."""

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from psvideo.model.arrays import Flags
from psvideo.plates.align.velocity.followed import Followed, odd_width

CLOSED_PX = 9
"""What lies so near to each other, in pixels of the sketches, belongs together."""
AROUND_PX = 30
"""So far around what was found a body may reach."""
MOST, FEWEST_PX = 3, 400
"""So many bodies are looked for, the largest ones; smaller ones do not tell how they turn."""


@dataclass(frozen=True, kw_only=True)
class MovingPart:
    """What was ``found`` to move, what lies ``within`` its outline, and ``about`` it what may be of the same body; all
    (row, col)."""

    found: Flags
    within: Flags
    about: Flags


def parts_of(motion: Followed) -> Iterator[MovingPart]:
    """Yield the largest parts of what moves; what clearly rests is of none."""
    size = odd_width(CLOSED_PX, motion.step)
    closed = cv2.morphologyEx(motion.moves.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((size, size), np.uint8))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(closed)
    largest = sorted(range(1, count), key=lambda label: (-stats[label, cv2.CC_STAT_AREA], label))[:MOST]
    for label in largest:
        found = motion.moves & (labels == label)
        if np.count_nonzero(found) * motion.step**2 >= FEWEST_PX:
            within = _within(labels == label)
            about = cv2.distanceTransform((~within).astype(np.uint8), cv2.DIST_L2, 5) <= AROUND_PX / motion.step
            yield MovingPart(found=found, within=within & ~motion.rests, about=about & ~motion.rests)


def _within(there: Flags) -> Flags:
    """Return what lies within the outline of what is ``there``."""
    outline, _ = cv2.findContours(there.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    return np.asarray(cv2.drawContours(np.zeros(there.shape, np.uint8), outline, -1, 1, cv2.FILLED) > 0)
