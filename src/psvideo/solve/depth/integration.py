"""Reweighting, round by round: solve for the height, compute new weights from it, until the energy settles."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import inf
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.heap import give_back
from psvideo.compute.spilled import bands, kept_in, let_go, lie_in_files, room_for
from psvideo.model.arrays import Doubles, Floats
from psvideo.solve.depth.checkerboard import empty_board
from psvideo.solve.depth.multigrid import CARRIED, Grids, empty_grids, set_up_levels, solve, weighed
from psvideo.solve.depth.reweighting import (
    Shares,
    add_board,
    fill_equations,
    pull_to_pins,
    weigh_sides,
    write_board,
)
from psvideo.solve.depth.simchony1990 import poisson_height
from psvideo.solve.depth.view import Slopes


@dataclass(frozen=True, kw_only=True)
class Integration:
    """How normals are integrated.

    sharpness: the paper's k: the larger, the more easily a jump is kept; 0 takes the whole surface for smooth.
    rounds: most rounds of reweighting.
    settled: relative change of the energy below which the rounds end.
    tolerance: how exactly each round is solved, relative to its right side.
    """

    sharpness: float = 2.0
    rounds: int = 60
    settled: float = 1e-3
    tolerance: float = 1e-3


BILATERAL = Integration()
SMOOTH = Integration(sharpness=0.0, tolerance=1e-7)
MOST_CYCLES = 100
LAST_TOLERANCE = 0.05
"""How much more exactly the last round's equations are solved than those on the way."""
FINEST = 1e-6
"""The finest tolerance: what equations lack is held in 32 bits."""
MOST_REFINEMENTS = 6
HOLD = 3e-4
"""What holds a pixel that looks the same to its height before, in ties between neighbours of a surface that faces the
camera: 3000 such pixels weigh as much as one tie, and the shape within some 40 pixels is hardly touched."""


@dataclass(frozen=True, kw_only=True)
class TakenOver:
    """What an instant takes over from another: where it looks the same, and shares and height there."""

    same: NDArray[np.bool_]
    rightward: Floats
    downward: Floats
    height: Doubles


@dataclass(frozen=True, kw_only=True)
class _Work:
    """One integration: the slopes in 32 bits, the height so far and the shares, changed in place, and memory."""

    slopes: Slopes
    height: Doubles
    shares: Shares
    lines: Floats
    grids: Grids

    def in_bands(self, run: Callable[[int, int], None], *more: NDArray[np.floating]) -> None:
        """Call ``run(first, last)`` for bands of rows, after each of which what lies in files is let go, ``more``
        planes too: the equations are solved on the grids alone."""
        own: list[NDArray[np.floating]] = [*self.slopes[:3], self.height, *self.shares]
        planes = [plane for plane in (*own, *more) if plane.flags.c_contiguous]
        for first, last in bands(len(self.height)):
            run(first, last)
            let_go(*(plane[first:last] for plane in planes))


def find_height(
    slopes: Slopes, how: Integration, *, held: TakenOver | None = None, spare: Path | None = None
) -> tuple[Doubles, Floats, Floats]:
    """Return the height, and the shares of the steps to the right and down, all (row, col).

    spare: a folder in whose files these and the ``slopes`` may lie, where they are large."""
    whole = bool((slopes.facing > 0).all())
    let_go(slopes.facing)
    height, rightward, downward = _room_at_first(slopes, poisson_height(slopes) if whole else None, spare)
    if lie_in_files(height):
        give_back()  # what the solver of normals left free lies beside the grids, and may be as large
    work = _begun(slopes, height, Shares(rightward, downward))
    if not (whole and how.sharpness == 0.0):
        _find(work, how, held)
    return work.height, *work.shares


def _find(work: _Work, how: Integration, held: TakenOver | None) -> None:
    """Change a height and shares until they settle."""
    before = _weigh(work, 0.0)
    if held is not None and how.sharpness > 0.0:
        _take_over(work, held)
        before = inf
    wanted = _wanted(work)
    stop, last = (max(share * how.tolerance, FINEST) ** 2 * wanted for share in (1.0, LAST_TOLERANCE))
    most = 1 if how.tolerance >= CARRIED else MOST_REFINEMENTS
    for _ in range(1 if how.sharpness == 0.0 else how.rounds):
        _settle(work, stop, most=most)
        energy = _weigh(work, how.sharpness)
        if abs(energy - before) <= how.settled * before < inf:
            break
        before = energy
    _settle(work, last, most=MOST_REFINEMENTS, held=None if how.sharpness == 0.0 else held)
    facing = work.slopes.facing

    def empty(first: int, last: int) -> None:
        work.height[first:last][facing[first:last] == 0.0] = 0.0

    work.in_bands(empty)


def _take_over(work: _Work, held: TakenOver) -> None:
    """Begin with the shares of another instant where it looks the same."""

    def take(first: int, last: int) -> None:
        same = held.same[first:last]
        for own, other in ((work.shares.rightward, held.rightward), (work.shares.downward, held.downward)):
            own[first:last][same] = other[first:last][same]

    work.in_bands(take, held.rightward, held.downward)


def _room_at_first(slopes: Slopes, height: Doubles | None, spare: Path | None) -> tuple[Doubles, Floats, Floats]:
    """Return the height to begin with, else 0, and equal shares."""
    shape = slopes.facing.shape
    rightward, downward = (room_for(shape, np.float32, spare) for _ in range(2))
    for first, last in bands(shape[0]):
        for share in (rightward, downward):
            share[first:last] = 0.5
            let_go(share[first:last])
    return room_for(shape, np.float64, spare) if height is None else kept_in(height, spare), rightward, downward


def _begun(slopes: Slopes, height: Doubles, shares: Shares) -> _Work:
    rows, cols = slopes.facing.shape
    facing, across, down = (
        plane.astype(np.float32, copy=False) for plane in (slopes.facing, slopes.across, slopes.down)
    )
    return _Work(
        slopes=Slopes(facing, across, down, np.float32(slopes.aspect)),
        height=height,
        shares=shares,
        lines=np.zeros((2, cols), np.float32),
        grids=empty_grids((rows, cols)),
    )


def _weigh(work: _Work, sharpness: float) -> float:
    """Make the shares those of the height; return the energy."""
    energy, sides = 0.0, (work.shares, work.lines)

    def weigh(first: int, last: int) -> None:
        nonlocal energy
        energy = float(weigh_sides(work.height, work.slopes, np.float32(sharpness), *sides, first, last, energy))

    work.in_bands(weigh)
    return energy


def _lacking(work: _Work, *, share: float = 1.0) -> None:
    """Put the equations for the shares onto the finest grid, with what they lack at a share of the height."""
    finest = work.grids.levels[0]
    finest.right[:] = 0

    def put(first: int, last: int) -> None:
        fill_equations(work.height, work.slopes, work.shares, finest.ties, finest.right, share, first, last)

    work.in_bands(put)


def _wanted(work: _Work) -> float:
    """Return the energy of what the equations want of a flat surface, which tolerances are relative to."""
    _lacking(work, share=0.0)
    set_up_levels(work.grids)
    return weighed(work.grids)


def _settle(work: _Work, stop: float, *, most: int, held: TakenOver | None = None) -> None:
    """Solve the equations for the shares as far as 32 bits of a correction carry, up to ``most`` times over.

    What looks the same as in ``held`` is held to its height there.
    """
    pins = None if held is None else _pins(held, work)
    lacked = inf
    for _ in range(most):
        _lacking(work)
        if held is not None and pins is not None:
            _pull(work, pins, held.height)
        pinned = set_up_levels(work.grids, pins)
        first, _ = solve(work.grids, stop=stop, most=MOST_CYCLES, pinned=pinned)
        if first <= stop or first > 0.1 * lacked:
            return
        work.in_bands(partial(add_board, work.grids.sum, work.height))
        if CARRIED**2 * first <= stop:
            return
        lacked = first


def _pull(work: _Work, pins: Floats, wanted: Doubles) -> None:
    lacking = work.grids.levels[0].right
    work.in_bands(partial(pull_to_pins, pins, work.height, wanted, lacking), wanted)


def _pins(held: TakenOver, work: _Work) -> Floats:
    pins = empty_board(*work.height.shape)
    for first, last in bands(len(held.same)):
        write_board(np.where(held.same[first:last], np.float32(HOLD), np.float32(0)), pins, first)
    return pins
