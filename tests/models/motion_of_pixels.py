"""Velocities as a picture shows them, for tests that look at single pixels."""

import numpy as np

from psvideo.model.arrays import Floats
from psvideo.plates.align.velocity.followed import Followed
from psvideo.plates.align.velocity.vectors import fill_per_s


def pixels_per_s(motion: Followed | None, shape: tuple[int, ...]) -> Floats:
    """Return the velocity of every pixel of a picture (row, col[, channel]), x right and y down, (row, col, 2)."""
    planes = np.empty((2, *shape[:2]), np.float32)
    fill_per_s(motion, planes)
    return np.moveaxis(planes, 0, -1)
