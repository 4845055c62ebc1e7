"""Solving the weighted Laplacian of a masked grid: conjugate gradients, preconditioned by one multigrid cycle.

Blocks of 2 x 2 pixels become the pixels of the next coarser grid (aggregation: the tie between blocks is the sum of the
ties between their pixels, so cuts and masks of any shape stay cut on every level). Smoothing is red-black Gauss-Seidel,
mirrored on the way up, which keeps the preconditioner symmetric as conjugate gradients need it.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from psvideo.integrate.kernel import coarsen, prolong, restrict, spread, sweep, ties_of

Grid = NDArray[np.floating]
COARSEST_PIXELS = 64
COARSEST_SWEEPS = 12
SMOOTHING = 2
"""Red-black sweeps before and after the coarser correction."""


@dataclass(frozen=True, kw_only=True)
class Level:
    """One grid: its ties, and the memory for its part of a cycle."""

    east: Grid
    south: Grid
    diagonal: Grid
    right: Grid
    height: Grid


def empty_levels(shape: tuple[int, int]) -> list[Level]:
    """Return memory for the grids of a hierarchy, the finest first."""
    levels = []
    while True:
        levels.append(
            Level(
                east=np.zeros(shape, np.float32),
                south=np.zeros(shape, np.float32),
                diagonal=np.zeros(shape, np.float32),
                right=np.zeros(shape, np.float32),
                height=np.zeros(shape, np.float32),
            )
        )
        if shape[0] * shape[1] <= COARSEST_PIXELS:
            return levels
        shape = ((shape[0] + 1) // 2, (shape[1] + 1) // 2)


def fill_levels(levels: list[Level], east: Grid, south: Grid) -> None:
    """Give the hierarchy the weights of its finest grid."""
    levels[0].east[:], levels[0].south[:] = east, south
    for finer, coarser in pairwise(levels):
        coarsen(finer.east, finer.south, coarser.east, coarser.south)
    for level in levels:
        ties_of(level.east, level.south, level.diagonal)


def cycle(levels: list[Level], depth: int = 0) -> None:
    """Bring ``height`` nearer to the solution for ``right``, from 0, on one grid and all coarser ones (a V-cycle)."""
    here = levels[depth]
    here.height[:] = 0
    ties = (here.east, here.south, here.diagonal, here.right, here.height)
    last = depth + 1 == len(levels)
    sweeps = COARSEST_SWEEPS if last else SMOOTHING
    for _ in range(sweeps):
        sweep(*ties, 0)
        sweep(*ties, 1)
    if not last:
        coarse = levels[depth + 1]
        restrict(*ties, coarse.right)
        cycle(levels, depth + 1)
        prolong(here.diagonal, coarse.height, here.height)
    for _ in range(sweeps):
        sweep(*ties, 1)
        sweep(*ties, 0)


def solve(
    levels: list[Level], east: Grid, south: Grid, right: Grid, height: Grid, *, tolerance: float, most: int
) -> int:
    """Solve the grid's equations for the right side, starting from ``height``, in place; return the count of cycles.

    Stops when the residual's norm, as the preconditioner weighs it, is below ``tolerance`` times the right side's, or
    after ``most`` cycles. Heights are determined up to a shift in each part that is tied together.
    """
    fill_levels(levels, east, south)
    diagonal, spread_out = np.empty_like(height), np.empty_like(height)
    ties_of(east, south, diagonal)
    stop = tolerance**2 * _weighed(levels, right)
    spread(east, south, diagonal, height, spread_out)
    residual = right - spread_out
    direction = np.zeros_like(height)
    before = 0.0
    for count in range(most):
        now = _weighed(levels, residual)
        if now <= stop or now <= 0.0:
            return count
        direction *= now / before if before else 0.0
        direction += levels[0].height
        before = now
        curvature = spread(east, south, diagonal, direction, spread_out)
        if curvature <= 0.0:
            return count
        height += (now / curvature) * direction
        residual -= (now / curvature) * spread_out
    return most


def _weighed(levels: list[Level], residual: Grid) -> float:
    """Apply the preconditioner to a residual (the result is the finest height) and return their inner product."""
    levels[0].right[:] = residual
    cycle(levels)
    return float(np.vdot(residual, levels[0].height))
