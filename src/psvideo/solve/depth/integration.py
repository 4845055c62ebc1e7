"""Reweighting, round by round: solve for the height, compute new weights from it, until the energy settles."""

from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import DTypeLike, NDArray

from psvideo.compute.spilled import in_file, let_go
from psvideo.model.camera import FloatArray
from psvideo.solve.depth.checkerboard import Board, empty_board
from psvideo.solve.depth.multigrid import CARRIED, Grids, empty_grids, prepare, solve, weighed
from psvideo.solve.depth.reweighting import add_board, equations, pull_to_pins, weigh_sides, write_board
from psvideo.solve.depth.simchony1990 import poisson_height
from psvideo.solve.depth.view import Slopes

Floats = NDArray[np.float32]
Kind = TypeVar("Kind", bound=np.generic)


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
IN_FILES_PIXELS = 1 << 20
"""From this many pixels on, what one step of a round needs and the next does not lies in files meanwhile."""
HOLD = 3e-4
"""What holds a pixel that looks the same to its height before, in ties between neighbours of a surface that faces the
camera: 3000 such pixels weigh as much as one tie, and the shape within some 40 pixels is hardly touched."""


@dataclass(frozen=True, kw_only=True)
class TakenOver:
    """What an instant takes over from another: where it looks the same, and shares and height there."""

    same: NDArray[np.bool_]
    rightward: Floats
    downward: Floats
    height: FloatArray


@dataclass(frozen=True, kw_only=True)
class _Work:
    """One integration: what is given of the surface, the height so far and the shares, changed in place, and memory."""

    given: tuple[Floats, Floats, Floats, np.float32]
    height: FloatArray
    rightward: Floats
    downward: Floats
    lines: Floats
    grids: Grids

    def put_aside(self) -> None:
        """Let go what lies in files while the equations are solved, which need the grids alone."""
        let_go(*self.given[:3], self.height, self.rightward, self.downward)


def find_height(
    slopes: Slopes, how: Integration, *, held: TakenOver | None = None, spare: Path | None = None
) -> tuple[FloatArray, Floats, Floats]:
    """Return the height, and the shares of the steps to the right and down, all (row, col).

    spare: a folder in whose files these and the ``slopes`` may lie, where they are large."""
    whole = bool((slopes.facing > 0).all())
    work = _begun(slopes, poisson_height(slopes) if whole else None, spare)
    if whole and how.sharpness == 0.0:
        return work.height, work.rightward, work.downward
    before = _weigh(work, 0.0)
    if held is not None and how.sharpness > 0.0:
        work.rightward[held.same], work.downward[held.same] = held.rightward[held.same], held.downward[held.same]
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
    work.height[slopes.facing == 0.0] = 0.0
    return work.height, work.rightward, work.downward


def _begun(slopes: Slopes, height: FloatArray | None, spare: Path | None) -> _Work:
    """Begin at a height, else at 0, with equal shares."""
    rows, cols = slopes.facing.shape
    facing, across, down = (
        plane.astype(np.float32, copy=False) for plane in (slopes.facing, slopes.across, slopes.down)
    )
    rightward, downward = (room_for((rows, cols), np.float32, spare) for _ in range(2))
    rightward[:] = downward[:] = 0.5
    return _Work(
        given=(facing, across, down, np.float32(slopes.aspect)),
        height=room_for((rows, cols), np.float64, spare) if height is None else kept_in(height, spare),
        rightward=rightward,
        downward=downward,
        lines=np.zeros((2, cols), np.float32),
        grids=empty_grids((rows, cols)),
    )


def room_for(shape: tuple[int, ...], kind: DTypeLike, spare: Path | None) -> NDArray[Any]:
    """Return a plane of 0: where it is large and there is a folder, in a file there (see ``let_go``)."""
    if spare is None or np.prod(shape[:2]) < IN_FILES_PIXELS:
        return np.zeros(shape, kind)
    return in_file(shape, kind, spare)


def kept_in(plane: NDArray[Kind], spare: Path | None) -> NDArray[Kind]:
    """Return a plane, or, where it is large and there is a folder, a copy that lies in a file there."""
    if spare is None or plane.shape[0] * plane.shape[1] < IN_FILES_PIXELS:
        return plane
    room: NDArray[Kind] = in_file(plane.shape, plane.dtype, spare)
    room[:] = plane
    let_go(room)
    return room


def _weigh(work: _Work, sharpness: float) -> float:
    """Make the shares those of the height; return the energy."""
    sides = (work.rightward, work.downward, work.lines)
    return float(weigh_sides(work.height, *work.given, np.float32(sharpness), *sides))


def _lacking(work: _Work, height: FloatArray) -> None:
    """Put the equations for the shares onto the finest grid, with what they lack at a height."""
    finest = work.grids.levels[0]
    finest.right[:] = 0
    equations(height, *work.given, work.rightward, work.downward, finest.ties, finest.right)


def _wanted(work: _Work) -> float:
    """Return the energy of what the equations want of a flat surface, which tolerances are relative to."""
    _lacking(work, np.zeros(work.height.shape))
    work.put_aside()
    prepare(work.grids)
    return weighed(work.grids)


def _settle(work: _Work, stop: float, *, most: int, held: TakenOver | None = None) -> None:
    """Solve the equations for the shares as far as 32 bits of a correction carry, up to ``most`` times over.

    What looks the same as in ``held`` is held to its height there.
    """
    pins = None if held is None else _pins(held, work)
    lacked = inf
    for _ in range(most):
        _lacking(work, work.height)
        if held is not None and pins is not None:
            pull_to_pins(pins, work.height, held.height, work.grids.levels[0].right)
        work.put_aside()
        pinned = prepare(work.grids, pins)
        first, _ = solve(work.grids, stop=stop, most=MOST_CYCLES, pinned=pinned)
        if first <= stop or first > 0.1 * lacked:
            return
        add_board(work.grids.sum, work.height)
        if CARRIED**2 * first <= stop:
            return
        lacked = first


def _pins(held: TakenOver, work: _Work) -> Board:
    pins = empty_board(*work.height.shape)
    write_board(np.where(held.same, np.float32(HOLD), np.float32(0)), pins)
    return pins
