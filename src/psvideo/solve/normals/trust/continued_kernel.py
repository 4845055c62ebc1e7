"""The compiled loop that continues normals across narrow doubt: a plane is fitted to those around a pixel."""

from typing import NamedTuple

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.model.arrays import Bytes, Doubles, Floats, Indices

PASSES = 3
"""Normals around count by how near they are to the mean of the last pass; first to the pixel's own."""
LEAST_DEG, NEAR_DEG = 0.5, 3.0
"""Errors count for no less than the first, and what lies within the second belongs to a surface anyway."""
TWICE = 2.0
"""Normals farther off than so many times what is likely hardly count."""
DEGREES, SINGULAR = 180 / np.pi, 1e-9


class AroundPoint(NamedTuple):
    """Normals (3, row, col), ``level`` of albedo and ``error`` in degrees (row, col), and which are ``sure``. ``near``
    (2 r + 1, 2 r + 1) are weights by distance, 0 in the middle, of every ``stride``-th pixel around one. A point whose
    level lies outside those around by more than the share ``margin`` is of another surface; and where no more than the
    share ``fewest`` of the window is sure nothing goes on."""

    normals: Floats
    level: Floats
    error: Floats
    sure: Bytes
    near: Doubles
    stride: int
    margin: float
    fewest: float


@FUSED.kept
def continue_points(places: Indices, around: AroundPoint, found: Doubles, first: int, last: int) -> None:
    """Fill ``found`` (point, 6) for points ``first`` to ``last`` of ``places`` (point, 2): the normal that goes on
    from what is sure around; its predicted error in degrees; how much more uncertain it is than a mean, for lying
    beside what is known; and the share of the window that tells, 0 where nothing goes on."""
    sums, right, fit, facts = np.empty(6), np.empty((3, 3)), np.empty((3, 3)), np.empty(5)
    for at in range(first, last):
        row, col = places[at, 0], places[at, 1]
        if _sure_share(row, col, around) <= around.fewest:
            found[at] = 0.0
            continue
        normal = around.normals[:, row, col].astype(np.float64)
        found[at], facts[3], facts[4] = 0.0, np.inf, -np.inf
        wide, error_deg, uncertain = TWICE * max(float(around.error[row, col]), NEAR_DEG), 0.0, 0.0
        margin, level, told = around.margin, around.level[row, col], 0.0
        for _ in range(PASSES):
            _gather(row, col, around, normal, wide, sums, right, facts)
            spread, told = _fit_plane(sums, right, fit), facts[0]
            if not facts[3] * (1 - margin) <= level <= facts[4] * (1 + margin):
                told = 0.0
                break
            length = np.sqrt(np.square(fit[0]).sum())
            if spread < 0.0 or length < SINGULAR:
                told = 0.0
                break
            normal[:] = fit[0] / length
            uncertain, claimed = spread * sums[0], facts[1] / told
            left = max(facts[2] - (fit * right).sum(), 0.0) / sums[0] * DEGREES * DEGREES
            error_deg = np.sqrt(claimed + left * uncertain)
            wide = max(TWICE * np.sqrt(left + claimed), NEAR_DEG)
        if told > 0.0:
            found[at, :3] = normal
            found[at, 3], found[at, 4], found[at, 5] = error_deg, uncertain, told / around.near.sum()


@FUSED.inlined
def _sure_share(row: int, col: int, around: AroundPoint) -> float:
    """Return which share of the window around a pixel is sure."""
    rows, cols = around.sure.shape
    near, stride = around.near, around.stride
    reach = near.shape[0] // 2
    share, whole = 0.0, 0.0
    for below in range(-reach, reach + 1):
        for beside in range(-reach, reach + 1):
            r, c = row + below * stride, col + beside * stride
            whole += near[reach + below, reach + beside]
            if r >= 0 and c >= 0 and r < rows and c < cols and around.sure[r, c]:
                share += near[reach + below, reach + beside]
    return share / whole


@FUSED.inlined
def _gather(
    row: int, col: int, around: AroundPoint, normal: Doubles, wide: float, sums: Doubles, right: Doubles, facts: Doubles
) -> None:
    """Fill the weighted ``sums`` of places around a pixel and ``right`` (3, 3), those times normals, by how near these
    are to a ``normal``; and ``facts``: the weight that tells, that times squares of errors, squares of normals, and
    (they stay, if they are farther) the lowest and highest level."""
    rows, cols = around.sure.shape
    near, stride = around.near, around.stride
    reach = near.shape[0] // 2
    sums[:], right[:], facts[:3] = 0.0, 0.0, 0.0
    for below in range(-reach, reach + 1):
        for beside in range(-reach, reach + 1):
            r, c = row + below * stride, col + beside * stride
            weight = near[reach + below, reach + beside]
            if r < 0 or c < 0 or r >= rows or c >= cols or weight == 0.0 or not around.sure[r, c]:
                continue
            level, own_deg = around.level[r, c], max(float(around.error[r, c]), LEAST_DEG)
            facts[3], facts[4] = min(facts[3], level), max(facts[4], level)
            apart = 0.0
            for part in range(3):
                apart += (around.normals[part, r, c] - normal[part]) ** 2
            weight *= np.exp(-apart * DEGREES * DEGREES / (2 * wide * wide))
            facts[0] += weight
            facts[1] += weight * own_deg * own_deg
            _add(weight / (own_deg * own_deg), beside, below, around.normals[:, r, c], sums, right, facts)


@FUSED.inlined
def _add(weight: float, beside: int, below: int, normal: Floats, sums: Doubles, right: Doubles, facts: Doubles) -> None:
    """Add a normal at a place to what ``_gather`` fills."""
    sums[0] += weight
    sums[1] += weight * beside
    sums[2] += weight * below
    sums[3] += weight * beside * beside
    sums[4] += weight * beside * below
    sums[5] += weight * below * below
    for part in range(3):
        value = float(normal[part])
        facts[2] += weight * value * value
        right[0, part] += weight * value
        right[1, part] += weight * beside * value
        right[2, part] += weight * below * value


@FUSED.inlined
def _fit_plane(sums: Doubles, right: Doubles, fit: Doubles) -> float:
    """Fill ``fit`` (3, 3) with value and slopes of the plane of least squares through each of three parts of normals,
    from weighted ``sums`` and ``right`` (3, 3); return the variance of its value, below 0 where there is no plane."""
    one = sums[3] * sums[5] - sums[4] * sums[4]
    two = sums[2] * sums[4] - sums[1] * sums[5]
    three = sums[1] * sums[4] - sums[2] * sums[3]
    four, five = sums[0] * sums[5] - sums[2] * sums[2], sums[1] * sums[2] - sums[0] * sums[4]
    six = sums[0] * sums[3] - sums[1] * sums[1]
    whole = sums[0] * one + sums[1] * two + sums[2] * three
    if whole <= SINGULAR * sums[0] * sums[3] * sums[5]:
        return -1.0
    for part in range(3):
        a, b, c = right[0, part], right[1, part], right[2, part]
        fit[0, part] = (one * a + two * b + three * c) / whole
        fit[1, part] = (two * a + four * b + five * c) / whole
        fit[2, part] = (three * a + five * b + six * c) / whole
    return float(one / whole)
