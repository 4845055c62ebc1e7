"""Outlines of what near lights show at several distances: every pixel stands on the nearer or on the farther side.

Distances are found for neighbourhoods, so that an edge is as coarse as these. What lies beside it is known from both
sides, and the light of a single pixel mostly says to which of the two it belongs.
"""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Floats, Mask
from psvideo.model.irradiance.ground import Ground
from psvideo.model.rig import Light
from psvideo.solve.falloff_costs import falloff_costs
from psvideo.solve.nearest_surfaces import FAR, nearest_surfaces

FINE_POINTS = 960
"""Points along the picture's longer side."""
REACH = 5
"""Distances are averages over squares of this many coarse points: on both sides of these they are another's."""
APART = 1.04
"""Sides that differ by less are one."""
AROUND = 5
"""What single pixels say is averaged over a disc of this many, less at its rim."""
SURELY = 4.0
"""A point is surely on one side where the logarithm of the odds is beyond this."""
EVEN = 3
"""Edges are looked for in light that is averaged over so many points: noise is none."""
EDGE_ODDS, MOST_ODDS = 4.0, np.float32(4)
"""What edges say of the odds: so much for light that changes wholly between a point and the other surface, and never
more than the second."""


def sides_of(deep: Floats) -> tuple[Floats, Floats]:
    """Return the least and the greatest distance around every coarse point."""
    square = np.ones((REACH, REACH), np.uint8)
    return np.asarray(cv2.erode(deep, square), np.float32), np.asarray(cv2.dilate(deep, square), np.float32)


def outlined(
    ground: Ground, lights: Sequence[Light], light: NDArray[np.float64], sides: tuple[Floats, Floats], *, step: int,
    noise: float, known: Mask, unsure: Floats,
) -> tuple[Floats, Floats]:  # fmt: skip
    """Return the depth (row, col) of every ``step``-th row and column, and how unsure its logarithm is.

    Of the two ``sides`` that is taken which explains the ``light`` (row, col, light) of the point and its neighbours
    better; their mean where they are one. Where that tells nothing, or distances are not ``known``, a point stands on
    the surface that is reached across the least edges. ``unsure``: of the distances.
    """
    near_m, far_m = sides
    beside = far_m > APART * near_m
    between, nearer = np.sqrt(near_m * far_m), _nearer(ground, lights, light, sides, beside, step=step, noise=noise)
    depth_m = np.where(beside, np.where(nearer > 0, near_m, far_m), between).astype(np.float32)
    seeds = known & (~beside | (np.abs(nearer) > SURELY))
    if seeds.all() or not seeds.any():
        return depth_m, unsure
    return _across_least_edges(light, depth_m, seeds, nearer, unsure, least=noise)


def _nearer(
    ground: Ground, lights: Sequence[Light], light: NDArray[np.float64], sides: tuple[Floats, Floats], beside: Mask, *,
    step: int, noise: float,
) -> Floats:  # fmt: skip
    """Return the logarithm of the odds that a point is on the nearer side, were a disc of pixels one measurement per
    light and pixel of its width; 0 where sides are one, or too few lights reach a point."""
    nearer = np.zeros(beside.shape, np.float32)
    if not beside.any():
        return nearer
    near, far = (
        falloff_costs(ground, lights, light, side.astype(np.float64), np.ones(1), at=beside, step=step, noise=noise)[0]
        for side in sides
    )
    nearer[beside] = far - near
    nearer = np.asarray(cv2.GaussianBlur(nearer, (AROUND, AROUND), 0), np.float32)
    return np.where(beside, np.float32(0.5 * len(lights) * AROUND) * nearer, np.float32(0))


def _across_least_edges(
    light: NDArray[np.float64], depth_m: Floats, known: Mask, nearer: Floats, unsure: Floats, *, least: float
) -> tuple[Floats, Floats]:
    """Return depth and how unsure it is where points that are not ``known`` stand on one of the two surfaces that are
    reached from them across the least edges: on the nearest, unless what they show themselves is against it."""
    shape = known.shape
    places = np.arange(known.size, dtype=np.int32).reshape(shape)
    seeds = np.stack([np.where(known, places, -1), np.full(shape, -1)]).astype(np.int32)
    ways = np.where(seeds >= 0, np.float32(0), FAR)
    even = np.stack(
        [cv2.GaussianBlur(plane, (EVEN, EVEN), 0) for plane in np.moveaxis(light.astype(np.float32), -1, 0)], axis=-1
    )
    nearest_surfaces(even, depth_m, least, float(np.log(APART)), seeds, ways)
    first, second = (np.where(one >= 0, one, places) for one in seeds)
    second = np.where(seeds[1] >= 0, second, first)
    logs = np.log(depth_m).ravel()
    gap = logs[second] - logs[first]
    odds = np.minimum(np.float32(EDGE_ODDS) * (ways[1] - ways[0]), MOST_ODDS) + np.sign(gap) * nearer
    taken = np.where(odds >= 0, first, second)
    torn = np.abs(gap) / (2 * np.cosh(np.clip(odds / 2, -40, 40)))
    found = np.where(known, depth_m, depth_m.ravel()[taken]).astype(np.float32)
    return found, np.where(known, unsure, np.maximum(unsure.ravel()[taken], torn)).astype(np.float32)
