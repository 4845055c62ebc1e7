"""The compiled loops of integration: the weighted Laplacian of a masked grid, its smoother and its coarser twin.

A grid of heights is tied together by weights between neighbours: ``east[r, c]`` between (r, c) and (r, c + 1),
``south[r, c]`` between (r, c) and (r + 1, c); 0 cuts them apart. Pixels without any tie are not part of the problem.
All arrays are of shape (row, col); the last column of ``east`` and the last row of ``south`` are 0.
"""

import math

import numpy as np
from numpy.typing import NDArray

from psvideo.compiled import compiled

Grid = NDArray[np.floating]
MOST_EVIDENCE = 13.8


@compiled
def _share(evidence: float) -> float:
    """The logistic function, between 1e-6 and 1: a part held by less would float away on rounding errors."""
    return 1.0 / (1.0 + math.exp(-min(max(evidence, -MOST_EVIDENCE), MOST_EVIDENCE)))


@compiled
def tie(
    height: Grid,
    facing: Grid,
    across: Grid,
    down: Grid,
    aspect: float,
    sharpness: float,
    east: Grid,
    south: Grid,
    target: Grid,
) -> float:
    """Fill the weights and the right side of the normal equations for a height; return the energy at it.

    X. Cao et al. 2022, section 4: at each pixel p and in each direction the one-sided steps a d+ and a d-, with a the
    facing, are weighed against each other by w+ = 1 / (1 + exp(-k ((a d-)^2 - (a d+)^2))), w- = 1 - w+. The energy is
    the sum over p of w+ (a d+ - n)^2 + w- (a d- - n)^2. Where a neighbour is missing, the step that a smooth surface
    would make, a d = n, stands in for comparing (the paper leaves that open); ``sharpness`` is k, 0 for equal weights.
    """
    rows, cols = height.shape
    energy = 0.0
    target[:] = 0.0
    east[:] = 0.0
    south[:] = 0.0
    for r in range(rows):
        for c in range(cols):
            a = facing[r, c]
            if a == 0.0:
                continue
            n = across[r, c]
            plus = c + 1 < cols and facing[r, c + 1] > 0.0
            minus = c > 0 and facing[r, c - 1] > 0.0
            ahead = a * (height[r, c + 1] - height[r, c]) if plus else n
            behind = a * (height[r, c] - height[r, c - 1]) if minus else n
            w = _share(sharpness * (behind * behind - ahead * ahead))
            if plus:
                east[r, c] += w * a * a
                target[r, c] -= w * a * n
                target[r, c + 1] += w * a * n
                energy += w * (ahead - n) ** 2
            if minus:
                east[r, c - 1] += (1.0 - w) * a * a
                target[r, c - 1] -= (1.0 - w) * a * n
                target[r, c] += (1.0 - w) * a * n
                energy += (1.0 - w) * (behind - n) ** 2
            n = down[r, c]
            a *= aspect
            plus = r + 1 < rows and facing[r + 1, c] > 0.0
            minus = r > 0 and facing[r - 1, c] > 0.0
            ahead = a * (height[r + 1, c] - height[r, c]) if plus else n
            behind = a * (height[r, c] - height[r - 1, c]) if minus else n
            w = _share(sharpness * (behind * behind - ahead * ahead))
            if plus:
                south[r, c] += w * a * a
                target[r, c] -= w * a * n
                target[r + 1, c] += w * a * n
                energy += w * (ahead - n) ** 2
            if minus:
                south[r - 1, c] += (1.0 - w) * a * a
                target[r - 1, c] -= (1.0 - w) * a * n
                target[r, c] += (1.0 - w) * a * n
                energy += (1.0 - w) * (behind - n) ** 2
    return energy


@compiled
def ties_of(east: Grid, south: Grid, diagonal: Grid) -> None:
    """Fill the sum of every pixel's weights."""
    rows, cols = east.shape
    for r in range(rows):
        for c in range(cols):
            total = east[r, c] + south[r, c]
            if c > 0:
                total += east[r, c - 1]
            if r > 0:
                total += south[r - 1, c]
            diagonal[r, c] = total


@compiled
def spread(east: Grid, south: Grid, diagonal: Grid, height: Grid, out: Grid) -> float:
    """Fill ``out`` with the Laplacian of a height and return its inner product with the height."""
    rows, cols = height.shape
    product = 0.0
    for r in range(rows):
        for c in range(cols):
            value = diagonal[r, c] * height[r, c]
            if c + 1 < cols:
                value -= east[r, c] * height[r, c + 1]
            if c > 0:
                value -= east[r, c - 1] * height[r, c - 1]
            if r + 1 < rows:
                value -= south[r, c] * height[r + 1, c]
            if r > 0:
                value -= south[r - 1, c] * height[r - 1, c]
            out[r, c] = value
            product += value * height[r, c]
    return product


@compiled
def sweep(east: Grid, south: Grid, diagonal: Grid, right: Grid, height: Grid, colour: int) -> None:
    """Relax every second pixel (those with row + col = colour modulo 2) by Gauss and Seidel."""
    rows, cols = height.shape
    for r in range(rows):
        for c in range((r + colour) % 2, cols, 2):
            d = diagonal[r, c]
            if d <= 0.0:
                continue
            value = right[r, c]
            if c + 1 < cols:
                value += east[r, c] * height[r, c + 1]
            if c > 0:
                value += east[r, c - 1] * height[r, c - 1]
            if r + 1 < rows:
                value += south[r, c] * height[r + 1, c]
            if r > 0:
                value += south[r - 1, c] * height[r - 1, c]
            height[r, c] = value / d


@compiled
def coarsen(east: Grid, south: Grid, coarse_east: Grid, coarse_south: Grid) -> None:
    """Fill the weights between blocks of 2 x 2 pixels: half the sum of those that cross their border.

    The half makes up for blocks moving as steps and not as slopes do (D. Braess 1995): it is what the same equation
    sampled twice as coarsely would have.
    """
    rows, cols = east.shape
    coarse_east[:] = 0.0
    coarse_south[:] = 0.0
    for r in range(rows):
        for c in range(1, cols - 1, 2):
            coarse_east[r // 2, c // 2] += 0.5 * east[r, c]
    for r in range(1, rows - 1, 2):
        for c in range(cols):
            coarse_south[r // 2, c // 2] += 0.5 * south[r, c]


@compiled
def restrict(east: Grid, south: Grid, diagonal: Grid, right: Grid, height: Grid, coarse: Grid) -> None:
    """Fill every block with the sum of what its pixels' equations still lack."""
    rows, cols = height.shape
    coarse[:] = 0.0
    for r in range(rows):
        for c in range(cols):
            if diagonal[r, c] <= 0.0:
                continue
            value = right[r, c] - diagonal[r, c] * height[r, c]
            if c + 1 < cols:
                value += east[r, c] * height[r, c + 1]
            if c > 0:
                value += east[r, c - 1] * height[r, c - 1]
            if r + 1 < rows:
                value += south[r, c] * height[r + 1, c]
            if r > 0:
                value += south[r - 1, c] * height[r - 1, c]
            coarse[r // 2, c // 2] += value


@compiled
def prolong(diagonal: Grid, coarse: Grid, height: Grid) -> None:
    """Add to every pixel the correction of its block."""
    rows, cols = height.shape
    for r in range(rows):
        for c in range(cols):
            if diagonal[r, c] > 0.0:
                height[r, c] += coarse[r // 2, c // 2]
