"""Solving the weighted Laplacian of a masked grid: conjugate gradients, preconditioned by one multigrid cycle.

Blocks of 2 x 2 pixels become the pixels of the next coarser grid (aggregation: the tie between blocks is made of the
ties between their pixels, so cuts and masks of any shape stay cut on every level), and pieces that a jump cuts off a
block go with the block beside it. Smoothing is red-black Gauss-Seidel, mirrored on the way up, which keeps the
preconditioner symmetric as conjugate gradients need it. All of it is done in 32 bits for a correction to a height that
is kept in 64 bits.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.compiled import REORDERED
from psvideo.compute.spilled import room_apart
from psvideo.model.arrays import Floats
from psvideo.solve.depth.between_blocks import coarsen, coarsen_pins, mend, prolong_moved, restrict_moved
from psvideo.solve.depth.checkerboard import ascend, descend, empty_board, invert, pull, settle
from psvideo.solve.depth.torn_blocks import OWN, part

COARSEST_PIXELS = 64
COARSEST_SWEEPS = 12
CARRIED = 1e-4
"""A correction in 32 bits is surely exact to this share of itself."""
MOST_MOVED = 0.25
"""Room for moved pixels, as a share of all: what a mask of dust would need more is left where it is."""


@dataclass(kw_only=True)
class Level:
    """One grid: its ties, what is wanted of it, and the memory for its part of a cycle; see ``checkerboard.py``."""

    ties: NDArray[np.float32]
    inverse: Floats
    right: Floats
    height: Floats
    belongs: NDArray[np.int8]
    room: NDArray[np.int32]
    pins: Floats
    moved: NDArray[np.int32]


@dataclass(frozen=True, kw_only=True)
class Grids:
    """A hierarchy, the finest first, with what conjugate gradients remember and two lines for the sweeps.

    ``spread`` lies where the finest grid's height does: of every row the step has taken that when it is spread.
    """

    levels: list[Level]
    step: Floats
    spread: Floats
    sum: Floats
    line: NDArray[np.float32]
    sums: NDArray[np.float32]


def empty_grids(shape: tuple[int, int]) -> Grids:
    """Return memory for a grid of (row, col) and all coarser ones."""
    finest = shape
    levels = []
    while True:
        board = empty_board(*shape)
        levels.append(
            Level(
                ties=room_apart((2, *board.shape), np.float32),
                inverse=board,
                right=empty_board(*shape),
                height=empty_board(*shape),
                belongs=room_apart(board.shape, np.int8),
                room=room_apart((int(MOST_MOVED * board.size) + 4, 3), np.int32),
                pins=np.zeros((2, 1, 1), np.float32),
                moved=np.zeros((0, 3), np.int32),
            )
        )
        if shape[0] * shape[1] <= COARSEST_PIXELS:
            break
        shape = ((shape[0] + 1) // 2, (shape[1] + 1) // 2)
    line, sums = (np.zeros(levels[0].right.shape[2] + 2, np.float32) for _ in range(2))
    step, total = (empty_board(*finest) for _ in range(2))
    return Grids(levels=levels, step=step, spread=levels[0].height, sum=total, line=line, sums=sums)


def set_up_levels(grids: Grids, pins: Floats | None = None) -> bool:
    """Give the hierarchy the ties of its finest grid, and pins if there are any; return whether there are."""
    pinned = pins is not None
    grids.levels[0].pins = grids.levels[0].pins if pins is None else pins
    for finer, coarser in pairwise(grids.levels):
        if pinned:
            coarser.pins = room_apart(coarser.right.shape, np.float32)
            coarsen_pins(finer.pins, coarser.pins)
        invert(finer.ties, finer.pins, pinned, finer.inverse)
        finer.belongs[:] = OWN
        finer.moved = finer.room[: part(finer.ties, finer.inverse, finer.belongs, finer.room)]
        coarsen(finer.ties, finer.inverse, finer.belongs, coarser.ties)
        if len(finer.moved):
            mend(finer.ties, finer.inverse, finer.belongs, finer.moved, coarser.ties)
    last = grids.levels[-1]
    invert(last.ties, last.pins, pinned, last.inverse)
    return pinned


def cycle(grids: Grids, *, pinned: bool = False, depth: int = 0) -> None:
    """Find a height near the solution for ``right`` on one grid and all coarser ones, from 0 (a V-cycle)."""
    here = grids.levels[depth]
    ties, right, height = here.ties, here.right, here.height
    if depth + 1 == len(grids.levels):
        height[:] = 0
        settle(ties, here.inverse, right, height, grids.line, COARSEST_SWEEPS)
        return
    coarse = grids.levels[depth + 1]
    descend(ties, here.inverse, here.pins, pinned, right, height, coarse.right, grids.line, grids.sums)
    if len(here.moved):
        restrict_moved(ties, here.pins, pinned, right, height, here.belongs, here.moved, coarse.right)
    cycle(grids, pinned=pinned, depth=depth + 1)
    if len(here.moved):
        prolong_moved(height, here.belongs, here.moved, coarse.height)
    ascend(ties, here.inverse, right, height, coarse.height, grids.line)


def weighed(grids: Grids, *, pinned: bool = False) -> float:
    """Return the inner product of the finest right side and the preconditioner's answer: its energy, about."""
    cycle(grids, pinned=pinned)
    return float(_product(grids.levels[0].right, grids.levels[0].height))


def solve(grids: Grids, *, stop: float, most: int, pinned: bool = False) -> tuple[float, int]:
    """Fill ``grids.sum`` with what the finest right side asks for; return what was lacking at first, and the cycles.

    The right side becomes what is still lacking. Ends when its energy, as ``weighed`` gives it, is at most ``stop``,
    after ``most`` cycles, or where 32 bits carry no further. Heights are determined up to a shift in each part that is
    tied together and not pinned.
    """
    finest = grids.levels[0]
    grids.sum[:] = 0
    before = first = 0.0
    for count in range(most):
        now = weighed(grids, pinned=pinned)
        if count == 0:
            first, stop = now, max(stop, CARRIED**2 * now)
        if now <= stop or now <= 0.0:
            return first, count
        share = np.float32(now / before if before else 0.0)
        curvature = _step(finest.ties, finest.pins, pinned, finest.height, share, grids.step, grids.spread, grids.line)
        before = now
        if curvature <= 0.0:
            return first, count
        _move(np.float32(now / curvature), grids.step, grids.spread, grids.sum, finest.right)
    return first, most


@REORDERED.called
def _line_product(one: Any, other: Any) -> Any:
    total = np.float32(0)
    for k in range(1, len(one) - 1):
        total += one[k] * other[k]
    return total


@REORDERED.kept
def _product(one: Any, other: Any) -> float:
    """The inner product of two boards: rows in 32 bits, their sum in 64."""
    total = 0.0
    for colour in range(2):
        for row in range(1, one.shape[1] - 1):
            total += _line_product(one[colour, row], other[colour, row])
    return total


@REORDERED.kept
def _step(ties: Any, pins: Any, pinned: bool, towards: Any, share: Any, step: Any, spread: Any, line: Any) -> float:
    """Make the next step of ``towards`` and a share of the last, spread it, and return the two's inner product."""
    rows, last = step.shape[1] - 2, step.shape[2] - 1
    total = 0.0
    for below in range(1, rows + 2):
        if below <= rows:
            for colour in range(2):
                new, old = towards[colour, below], step[colour, below]
                for k in range(1, last):
                    old[k] = new[k] + share * old[k]
        row = below - 1
        if row >= 1:
            for colour in range(2):
                pull(ties, step, line, colour, row)
                own, out = step[colour, row], spread[colour, row]
                for k in range(1, last):
                    out[k] = -line[k]
                if pinned:
                    pin = pins[colour, row]
                    for k in range(1, last):
                        out[k] += pin[k] * own[k]
                total += _line_product(own, out)
    return total


@REORDERED.kept
def _move(length: Any, step: Any, spread: Any, place: Any, lacking: Any) -> None:
    """Go a length along a step, and take what it brought off what is lacking."""
    for colour in range(2):
        for row in range(1, step.shape[1] - 1):
            along, brought = step[colour, row], spread[colour, row]
            here, rest = place[colour, row], lacking[colour, row]
            for k in range(1, len(along) - 1):
                here[k] += length * along[k]
            for k in range(1, len(along) - 1):
                rest[k] -= length * brought[k]
