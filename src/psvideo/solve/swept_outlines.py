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
from psvideo.solve.falloff_costs import OWN_SHARE, falloff_costs
from psvideo.solve.nearest_surfaces import FAR, Places, nearest_surfaces

FINE_POINTS = 960
"""Points along the picture's longer side."""
REACH = 5
"""Distances are averages over squares of this many coarse points: on both sides of these they are another's."""
APART = 1.04
"""Sides that differ by less are one."""
AROUND = 5
"""What single pixels say is averaged over a disc of this many, less at its rim."""
LEAST_LIT = 5
"""What single pixels show counts where so many lights reach them, or all: by four a rim is taken for what it is not."""
SURELY = 4.0
"""A point is surely on one side where the logarithm of the odds is beyond this."""
EVEN = 3
"""Edges are looked for in light that is averaged over so many points: noise is none."""
EDGE_ODDS, MOST_ODDS = 4.0, np.float32(4)
"""What it says of the odds that one way is longer than the other: so much of their logarithm for light that changes
wholly, and at most the second."""
ON_PLANE = 0.1
"""And so much that a point stands on the side that is nearer to the rig's plane: there the subject is. It decides where
light tells nothing, and makes nothing surer."""
CLOSE, STRANGE = np.float32(0.4), np.float32(0.8)
"""A way that is shorter than the first crosses no strong edge. A point all of whose ways are longer than the second
more likely belongs to a surface of which nothing is known."""


def sides_of(deep: Floats) -> tuple[Floats, Floats]:
    """Return the least and the greatest distance around every coarse point."""
    square = np.ones((REACH, REACH), np.uint8)
    return np.asarray(cv2.erode(deep, square), np.float32), np.asarray(cv2.dilate(deep, square), np.float32)


def outlined(
    ground: Ground, lights: Sequence[Light], light: NDArray[np.float64], sides: tuple[Floats, Floats], *, step: int,
    noise: float, known: Mask, unsure: Floats, own: float = OWN_SHARE,
) -> tuple[Floats, Floats, Floats]:  # fmt: skip
    """Return the depth (row, col) of every ``step``-th row and column, how unsure its logarithm is, and how far off it
    may be because points may belong to the other surface.

    Of the two ``sides`` that is taken which explains the ``light`` (row, col, light) of the point and its neighbours
    better; their mean where they are one. Where that tells little, or distances are not ``known``, it stands on the
    surface that is reached across the least edges, if no strong one lies between or both ``sides`` are reached.
    ``unsure``: of the distances.
    """
    near_m, far_m = sides
    beside, between = far_m > APART * near_m, np.sqrt(near_m * far_m)
    nearer = _nearer(ground, lights, light, sides, beside, step=step, noise=noise, own=own)
    plane = np.log(ground.depth_m[::step, ::step])
    held = _held_by_plane(np.log(near_m) - plane, np.log(far_m) - plane)
    depth_m = np.where(beside, np.where(nearer + held > 0, near_m, far_m), between).astype(np.float32)
    torn = np.where(beside, _torn(np.log(far_m / near_m), nearer), np.float32(0)).astype(np.float32)
    seeds = known & (~beside | (np.abs(nearer) > SURELY))
    if seeds.all() or not seeds.any():
        return depth_m, unsure, torn
    firsts, ways = _across_least_edges(light, depth_m, seeds, least=noise)
    logs, places = np.log(depth_m).ravel(), np.arange(seeds.size).reshape(seeds.shape)
    first, second = (np.where(one >= 0, one, places) for one in firsts)
    second = np.where(firsts[1] >= 0, second, first)
    these = ~beside | (ways[0] < CLOSE)  # or both sides are reached
    these |= (logs[first] - np.log(between)) * (logs[second] - np.log(between)) < 0
    gap = logs[second] - logs[first]
    odds = np.minimum(np.float32(EDGE_ODDS) * (ways[1] - ways[0]), MOST_ODDS) + np.sign(gap) * nearer
    held = _held_by_plane(logs[first] - plane, logs[second] - plane)
    taken = np.where(seeds | ~these, places, np.where(odds + held >= 0, first, second))
    neither = unsure / (1 + np.exp(np.clip(np.float32(EDGE_ODDS) * (STRANGE - ways[0]), -40, 40)))
    across = np.where(these, np.maximum(_torn(gap, odds), neither), torn)
    torn = np.where(seeds, torn, across).astype(np.float32)
    return depth_m.ravel()[taken], unsure.ravel()[taken], torn


def _held_by_plane(one: Floats, other: Floats) -> Floats:
    """Return what the plane says of the odds that a point stands on ``one`` side and not on the ``other``, logarithms
    of how far these are from it."""
    return np.asarray(ON_PLANE * np.sign(np.abs(other) - np.abs(one)), np.float32)


def _torn(gap: Floats, odds: Floats) -> Floats:
    """Return the standard deviation of what is one or, beyond a ``gap``, the other, by the logarithm of the odds."""
    return np.asarray(np.abs(gap) / (2 * np.cosh(np.clip(odds / 2, -40, 40))), np.float32)


def _nearer(
    ground: Ground, lights: Sequence[Light], light: NDArray[np.float64], sides: tuple[Floats, Floats], beside: Mask, *,
    step: int, noise: float, own: float,
) -> Floats:  # fmt: skip
    """Return the logarithm of the odds that a point is on the nearer side, were a disc of pixels one measurement per
    light and pixel of its width; 0 where sides are one, or too few lights reach a point."""
    nearer = np.zeros(beside.shape, np.float32)
    if not beside.any():
        return nearer
    one = np.ones(1)
    near, far = (
        falloff_costs(
            ground,
            lights,
            light,
            side.astype(np.float64),
            one,
            at=beside,
            step=step,
            noise=noise,
            least_lit=LEAST_LIT,
            own=own,
        )[0]
        for side in sides
    )
    nearer[beside] = far - near
    nearer = np.asarray(cv2.GaussianBlur(nearer, (AROUND, AROUND), 0), np.float32)
    return np.where(beside, np.float32(0.5 * len(lights) * AROUND) * nearer, np.float32(0))


def _across_least_edges(
    light: NDArray[np.float64], depth_m: Floats, known: Mask, *, least: float
) -> tuple[Places, Floats]:
    """Return for every point the places of the two surfaces that are reached across the least edges, (2, row, col), -1
    where there is none, and the ways to them."""
    places = np.arange(known.size, dtype=np.int32).reshape(known.shape)
    seeds = np.stack([np.where(known, places, -1), np.full(known.shape, -1)]).astype(np.int32)
    ways = np.where(seeds >= 0, np.float32(0), FAR)
    planes = np.moveaxis(light.astype(np.float32), -1, 0)
    even = np.stack([cv2.GaussianBlur(plane, (EVEN, EVEN), 0) for plane in planes], axis=-1)
    nearest_surfaces(even, depth_m, least, float(np.log(APART)), seeds, ways)
    return seeds, ways
