"""Outlines of what near lights show at several distances: every pixel stands on the nearer or on the farther side.

Distances are found for neighbourhoods, so that an edge is as coarse as these. What lies beside it is known from both
sides, and the light of a single pixel mostly says to which of the two it belongs.
"""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Floats
from psvideo.model.irradiance.ground import Ground
from psvideo.model.rig import Light
from psvideo.solve.falloff_costs import falloff_costs

FINE_POINTS = 960
"""Points along the picture's longer side."""
REACH = 5
"""Distances are averages over squares of this many coarse points: on both sides of these they are another's."""
APART = 1.04
"""Sides that differ by less are one."""
AROUND = 5
"""What single pixels say is averaged over a disc of this many, less at its rim."""


def sides_of(deep: Floats) -> tuple[Floats, Floats]:
    """Return the least and the greatest distance around every coarse point."""
    square = np.ones((REACH, REACH), np.uint8)
    return np.asarray(cv2.erode(deep, square), np.float32), np.asarray(cv2.dilate(deep, square), np.float32)


def outlined(
    ground: Ground, lights: Sequence[Light], light: NDArray[np.float64], sides: tuple[Floats, Floats], *, step: int,
    noise: float,
) -> tuple[Floats, Floats]:  # fmt: skip
    """Return the depth (row, col) of every ``step``-th row and column, and how unsure its logarithm is.

    Of the two ``sides`` that is taken which explains the ``light`` (row, col, light) of the point and its neighbours
    better; their mean where they are one.
    """
    near_m, far_m = sides
    beside = far_m > APART * near_m
    between, gap = np.sqrt(near_m * far_m), np.log(far_m / near_m)
    if not beside.any():
        return np.asarray(between, np.float32), np.zeros_like(near_m)
    one = np.ones(1)
    near, far = (
        falloff_costs(ground, lights, light, side.astype(np.float64), one, at=beside, step=step, noise=noise)[0]
        for side in sides
    )
    nearer = np.zeros(beside.shape, np.float32)
    nearer[beside] = far - near
    nearer = np.asarray(cv2.GaussianBlur(nearer, (AROUND, AROUND), 0), np.float32)
    depth_m = np.where(beside, np.where(nearer > 0, near_m, far_m), between)
    # half the logarithm of the odds, were a disc of pixels one measurement per light and pixel of its width
    tilt = np.float32(0.25 * len(lights) * AROUND) * nearer
    unsure = np.where(beside, gap / (2 * np.cosh(np.clip(tilt, -40, 40))), 0)
    return depth_m.astype(np.float32), unsure.astype(np.float32)
