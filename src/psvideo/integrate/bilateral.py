"""The height of a surface from its normals, with jumps where the surface jumps.

X. Cao, H. Santo, B. Shi, F. Okura and Y. Matsushita, Bilateral Normal Integration, ECCV 2022. The surface is taken to
be smooth on at least one side of every pixel in each direction, and the two one-sided differences are weighed against
each other by how far they step. The weights depend on the height, so weighted least squares are repeated with the
weights of the height before, beginning with equal ones. Each round is solved by multigrid, in two to ten cycles.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.camera import FloatArray
from psvideo.integrate.kernel import tie
from psvideo.integrate.multigrid import empty_levels, solve
from psvideo.integrate.poisson import poisson_height
from psvideo.integrate.view import Slopes, View, slopes_of

Mask = NDArray[np.bool_]

CUT_SHARE = 0.1
"""Neighbours count as cut apart when less than this share of the weight between them is left; half is left where a
surface is smooth, and with the paper's sharpness never less than 0.12 where steps are those of the normals."""


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
LAST_TOLERANCE = 0.01
"""How much more exactly the last round's equations are solved than those on the way."""


@dataclass(frozen=True, kw_only=True)
class Height:
    """A surface's height, determined up to a shift in every part that hangs together.

    height: (row, col), see ``psvideo.integrate.view``: pixels of depth, or focal length times its logarithm; 0 where
        not valid.
    valid: (row, col).
    cut_east, cut_south: (row, col), True where the surface jumps between a pixel and its right or lower neighbour.
    """

    height: FloatArray
    valid: Mask
    cut_east: Mask
    cut_south: Mask


def integrate(normals: NDArray[np.floating], valid: Mask, view: View, *, how: Integration = BILATERAL) -> Height:
    """Return the height of a surface from its normals (row, col, 3), camera frame, over a mask of any shape."""
    slopes = slopes_of(normals, valid, view)
    box = _box(valid)
    within = Slopes(
        facing=np.ascontiguousarray(slopes.facing[box]),
        across=np.ascontiguousarray(slopes.across[box]),
        down=np.ascontiguousarray(slopes.down[box]),
        aspect=slopes.aspect,
    )
    height, cut_east, cut_south = np.zeros(valid.shape), np.zeros_like(valid), np.zeros_like(valid)
    height[box], cut_east[box], cut_south[box] = _height(within, how)
    return Height(height=height, valid=valid, cut_east=cut_east, cut_south=cut_south)


def _box(valid: Mask) -> tuple[slice, slice]:
    """The smallest rectangle that holds all that is valid; the first pixel where nothing is."""
    rows, cols = np.flatnonzero(valid.any(axis=1)), np.flatnonzero(valid.any(axis=0))
    if not rows.size:
        return slice(0, 1), slice(0, 1)
    return slice(int(rows[0]), int(rows[-1]) + 1), slice(int(cols[0]), int(cols[-1]) + 1)


def _height(slopes: Slopes, how: Integration) -> tuple[FloatArray, Mask, Mask]:
    whole = bool((slopes.facing > 0).all())
    height = poisson_height(slopes) if whole else np.zeros(slopes.facing.shape)
    if whole and how.sharpness == 0.0:
        uncut = np.zeros(height.shape, np.bool_)
        return height, uncut, uncut
    shape = (height.shape[0], height.shape[1])
    east, south, target = (np.zeros(shape) for _ in range(3))
    levels = empty_levels(shape)
    given = (slopes.facing, slopes.across, slopes.down, slopes.aspect)
    before = tie(height, *given, 0.0, east, south, target)
    for _ in range(1 if how.sharpness == 0.0 else how.rounds):
        solve(levels, east, south, target, height, tolerance=how.tolerance, most=MOST_CYCLES)
        energy = tie(height, *given, how.sharpness, east, south, target)
        if abs(energy - before) <= how.settled * before:
            break
        before = energy
    solve(levels, east, south, target, height, tolerance=how.tolerance * LAST_TOLERANCE, most=MOST_CYCLES)
    height[slopes.facing == 0.0] = 0.0
    return height, *_cuts(slopes, east, south)


def _cuts(slopes: Slopes, east: FloatArray, south: FloatArray) -> tuple[Mask, Mask]:
    """Where hardly any weight is left between neighbours that are both valid."""
    squared = slopes.facing**2
    cut_east, cut_south = np.zeros(east.shape, np.bool_), np.zeros(east.shape, np.bool_)
    both = (squared[:, 1:] > 0) & (squared[:, :-1] > 0)
    cut_east[:, :-1] = both & (east[:, :-1] < CUT_SHARE * (squared[:, 1:] + squared[:, :-1]))
    both = (squared[1:] > 0) & (squared[:-1] > 0)
    scale = CUT_SHARE * slopes.aspect**2
    cut_south[:-1] = both & (south[:-1] < scale * (squared[1:] + squared[:-1]))
    return cut_east, cut_south
