"""The compiled loop of outlines: the two surfaces from which a point can be reached across the least edges.

Geodesic distances by raster scans (P. Toivanen, "New geodesic distance transforms for gray-scale images", Pattern
Recognition Letters 17, 1996), of the nearest surface and of the nearest other one.
"""

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.compiled import FUSED
from psvideo.model.arrays import Floats

Places = NDArray[np.int32]
SCANS = 3
"""Down and up, so many times: what lies around more corners is reached too late, or not at all."""
STEP, SLANT = 0.01, 1.4142135
"""What one point to the next costs where nothing changes: as much as light that changes by this share."""
FAR = np.float32(1e9)


@FUSED.kept
def nearest_surfaces(light: Floats, depth_m: Floats, least: float, apart: float, seeds: Places, ways: Floats) -> None:
    """Fill ``seeds`` (2, row, col), the points whose surface is nearest, and ``ways`` (2, row, col), how far it is.

    light: (row, col, light), below 0 where unknown. depth_m: of the points, (row, col). least: light that counts as
    nothing. apart: how much the logarithm of depth differs between surfaces. Seeds hold their own place, row times
    columns and column, and a way of 0, where a surface is known, else -1 and FAR.
    """
    rows, cols = depth_m.shape
    logs, steps = np.log(depth_m.ravel()), _steps(light, least)
    unknown = np.flatnonzero(ways[0].ravel() > 0)
    for scan in range(2 * SCANS):
        onward = 1 if scan % 2 == 0 else -1
        for place in unknown[::onward]:
            row, col = place // cols, place % cols
            for n in range(4):
                r = row - onward * (n > 0)
                c = col - onward * (1 if n == 0 else n - 2)
                if r < 0 or r >= rows or c < 0 or c >= cols or seeds[0, r, c] < 0:
                    continue
                step = steps[n, row, col] if onward > 0 else steps[n, r, c]
                for k in range(2):  # not a function of its own: handing arrays on costs four times the rest
                    seed, way = seeds[k, r, c], ways[k, r, c] + step
                    if seed < 0 or way >= ways[1, row, col]:
                        continue
                    first, second = seeds[0, row, col], seeds[1, row, col]
                    same = first >= 0 and abs(logs[first] - logs[seed]) < apart
                    if way >= ways[0, row, col]:
                        if not same:
                            seeds[1, row, col], ways[1, row, col] = seed, way
                        continue
                    if first >= 0 and not same:
                        seeds[1, row, col], ways[1, row, col] = first, ways[0, row, col]
                    elif second >= 0 and abs(logs[second] - logs[seed]) < apart:
                        seeds[1, row, col], ways[1, row, col] = -1, FAR
                    seeds[0, row, col], ways[0, row, col] = seed, way


@FUSED.inlined
def _steps(light: Floats, least: float) -> Floats:
    """Return what the steps cost that lead to every point from its left, and from above, (4, row, col)."""
    rows, cols, _ = light.shape
    steps = np.empty((4, rows, cols), np.float32)
    for row in range(rows):
        for col in range(cols):
            for n in range(4):
                r, c = row - (n > 0), col - (1 if n == 0 else n - 2)
                if r >= 0 and c >= 0 and c < cols:
                    away = STEP if n == 0 or n == 2 else STEP * SLANT
                    steps[n, row, col] = away + _edge(light, row, col, r, c, least)
    return steps


@FUSED.inlined
def _edge(light: Floats, row: int, col: int, r: int, c: int, least: float) -> float:
    """Return by what share light differs between two points, over all lamps; a share of what both send."""
    change, total = 0.0, least * least
    for k in range(light.shape[2]):
        here, there = light[row, col, k], light[r, c, k]
        if here >= 0 and there >= 0:
            change += (here - there) ** 2
            total += max(here, there) ** 2
    return float(np.sqrt(change / total))
