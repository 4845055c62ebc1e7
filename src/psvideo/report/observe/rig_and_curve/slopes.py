"""Whether normals can be those of one surface: its slopes must not turn in circles.

For heights z(x, y) with slopes p and q, dp/dy = dq/dx. Normals found with mirrored, turned or exchanged lights break
this, even with three lights, which explain any brightness. Both sides are held against each other by correlation.
Where faces are flat, slopes change on their edges alone, and only the edges inside one body are bound to this.
"""

from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.compute.ranks import median
from psvideo.compute.spilled import let_go
from psvideo.model.surface import Surface
from psvideo.report.observe.rig_and_curve.edges_of_slopes import on_edges, smooth_slopes
from psvideo.report.observe.thinned import thin_surface
from psvideo.solve.normals.trust.unchecked import ALL_EXPLAINED

WIDTH_PX = 320
LEAST_PIXELS, LEAST_AWAY = 400, 50
STEEPEST = 4.0
"""Slopes beyond this lie on outlines, where neighbouring pixels show different things."""
BLUR_PX = 1.5
BY_CHANCE = 3.0
"""Standard errors by which noise may disagree."""
WIDER, CLEAR = (2, 4, 8), 0.3
"""Slopes that agree less than the second are smoothed this much wider as long as noise explains it."""
NOISE_LEFT, MORE = 1 / 16, 1.5
"""Noise keeps this much of its square each time. Where a surface's own slopes agree (or, under mirrored lights,
disagree) and noise hides it, that is the surface's share, and what is left is at most that and this much of the rest:
what leaves 1.5 times more is a shape that wrong lights made. What is noise to the end (a wall, a box's faces) says
nothing."""
CROSSWISE = 0.01
"""Of the square by which slopes change along themselves, what they must change crosswise, for a disagreement to count:
a pipe or a bottle that stands upright changes in one direction only, and what is left across are the errors of its rim,
which are none of white noise's. (Upright pipes, 3 to 12 lights: 0.002 at most; one that leans by 4 degrees: 0.01; balls
and bumps, under any lights: 0.3 and more.)"""
FINEST = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], np.float32)
"""What is left of a picture beyond its slopes and bends: noise, of six times the standard error (Immerkaer 1996)."""
TOO_MUCH = 30.0
"""Where slopes turn by more than this many times the square that this noise makes of them, something
else does: 430 times where paint shows through coloured lamps that are taken for white, 1 to 10 times on noisy walls, of
mosaics too."""
NORMAL_MEDIAN = 0.6745
"""The median distance from the mean of what is distributed normally, in standard deviations."""
AWAY = -0.1
"""Normals whose z is below this face away from the camera: noise at an outline does less."""
LEAST_TRUSTED, TRUSTED_AGREE = 0.3, 0.6
"""Slopes of trusted normals count for themselves where they are this share of what three lights gave, and agree so
well. (Under lights that are exchanged, mirrored, in another order or 15 degrees off: 0.32 at most; under right ones
0.77 and more.)"""
BESIDE_EDGES, BESIDE_NOISE = 0.02, 50.0
"""Slopes turn on edges alone where all other places hold less than this share of it, and less than the second times
what noise makes. (Boards, boxes and leaves under right rigs: 0.011 and 32 at most; bodies whose lights are exchanged:
from 0.014 and 112 on, but for a small ball between boards.)"""
EDGES_TELL = -0.3
"""Some of these edges are creases, which belong to one surface, and others end one thing before another, which binds
nothing: they agree by less than CLEAR under right rigs too (down to -0.13). Less than this is due to wrong lights."""
WHOLE = 0.999
LEAST_AVERAGED = 3
"""Of this many rows and columns, evenly, the mean of a larger square is taken."""


class Averaged(NamedTuple):
    """Normals averaged over squares, (row, col, 3) of them, and where all of a square is measured."""

    valid: NDArray[np.bool_]
    normals: NDArray[np.float32]


def slope_agreement(small: Averaged) -> float | None:
    """Return the correlation of dp/dy with dq/dx: near 1 for a surface, 0 for noise, below it for wrong lights.

    None where too few neighbouring normals are there, or where they show nothing but noise, or edges of flat faces.
    """
    valid, normals = small
    found = first = _turning(valid, normals, BLUR_PX)
    if found is None or first is None:
        return None
    noise = noise_of_slopes(valid, normals)
    if found.power <= TOO_MUCH * noise:
        found = _beyond_noise(valid, normals, found)
    if found is None or (found.crosswise < CROSSWISE and found.agreement < CLEAR):
        return None
    if EDGES_TELL < found.agreement < CLEAR and _on_edges_alone(small, first, noise):
        return None
    return found.agreement


def _on_edges_alone(small: Averaged, all_of_it: "_Turning", noise: float) -> bool:
    """Return whether slopes turn on edges, and hardly anywhere else; ``noise`` is the square that noise makes."""
    beside = _turning(*small, BLUR_PX, left_out=on_edges(*small, BLUR_PX))
    if beside is None:
        return True
    share = beside.power * beside.points / (all_of_it.power * all_of_it.points)
    return share < BESIDE_EDGES and beside.power < BESIDE_NOISE * noise


def surface_agreement(surface: Surface, small: Averaged, *, lights: int) -> float | None:
    """Return the agreement of slopes over all that three lights gave (``small``, as ``coarse_normals`` gives it), or
    over what is trusted where that speaks clearly for the lights: shadows and light by way of other surfaces make
    normals of no surface too, and what they make is not trusted. Of just three (``lights`` is their number) only what
    is one surface is trusted, and says nothing."""
    agreement = slope_agreement(small)
    if agreement is None or agreement >= TRUSTED_AGREE or lights <= ALL_EXPLAINED:
        return agreement
    own = _mean_of_squares(surface.valid) > WHOLE
    if own.sum() < LEAST_TRUSTED * small.valid.sum():
        return agreement
    trusted = slope_agreement(Averaged(own, small.normals))
    return trusted if trusted is not None and trusted >= TRUSTED_AGREE else agreement


class _Turning(NamedTuple):
    """The correlation of dp/dy with dq/dx, their mean square (``power``) over so many ``points``, that as a share of
    the mean square of dp/dx and dq/dy (``crosswise``), and how far noise alone may bring the correlation
    (``chance``)."""

    agreement: float
    power: float
    points: int
    crosswise: float
    chance: float


def _beyond_noise(valid: NDArray[np.bool_], normals: NDArray[np.float32], found: _Turning) -> _Turning | None:
    """Return how slopes turn where noise hides it no more: as ``found``, or smoothed further as long as what turns
    falls as noise does. None where it does so to the end."""
    for times in WIDER:
        clear = not -found.chance < found.agreement < CLEAR
        wider = None if clear else _turning(valid, normals, times * BLUR_PX)
        share = abs(found.agreement)
        if wider is None or wider.power > MORE * (share + (1 - share) * NOISE_LEFT) * found.power:
            return found
        found = wider
    return None


def noise_of_slopes(valid: NDArray[np.bool_], normals: NDArray[np.float32]) -> float:
    """Return the mean square by which slopes turn for noise alone, as far as the finest detail shows it.

    White noise of a standard error s, smoothed by a Gaussian of width b, has derivatives of the mean square
    s^2 / (8 pi b^4).
    """
    inside = cv2.erode(valid.astype(np.uint8), np.ones((7, 7), np.uint8), borderValue=0) > 0
    if not inside.any():
        return 0.0
    left = [median(np.abs(cv2.filter2D(normals[..., axis], -1, FINEST)[inside])) for axis in (0, 1)]
    errors = np.array(left) / (6 * NORMAL_MEDIAN)
    return float((errors**2).sum() / (8 * np.pi * BLUR_PX**4))


def _turning(
    valid: NDArray[np.bool_],
    normals: NDArray[np.float32],
    blur_px: float,
    *,
    left_out: NDArray[np.bool_] | None = None,
) -> _Turning | None:
    """Return how slopes turn where normals are smoothed so far, but where they are left out; None where too few are
    there."""
    slope_x, slope_y, towards = smooth_slopes(valid, normals, blur_px)
    gentle = valid & (slope_x * slope_x + slope_y * slope_y < np.float32(STEEPEST**2)) & (towards > 0)
    inside = cv2.erode(gentle.astype(np.uint8), np.ones((7, 7), np.uint8), borderValue=0) > 0
    if left_out is not None:
        inside &= ~left_out
    if inside.sum() < LEAST_PIXELS:
        return None
    inner = inside[1:-1], inside[:, 1:-1]  # nothing at the rim is inside
    p_up, q_up = (((slope[:-2] - slope[2:]) / 2)[inner[0]] for slope in (slope_x, slope_y))  # rows go down
    p_right, q_right = (((slope[:, 2:] - slope[:, :-2]) / 2)[inner[1]] for slope in (slope_x, slope_y))
    total = float((p_up**2).sum() + (q_right**2).sum())
    if total <= 1e-12:
        return None
    own = float((p_right**2).sum() + (q_up**2).sum())
    apart = len(p_up) / (4 * np.pi * blur_px**2)  # so many of them know nothing of each other
    agreement = float(2 * (p_up * q_right).sum() / total)
    chance = BY_CHANCE / float(np.sqrt(max(apart, 1.0)))
    return _Turning(agreement, total / len(p_up), len(p_up), total / max(own, 1e-12), chance)


def share_away(surface: Surface, some: Surface | None = None) -> float:
    """Return which share of the normals that three lights gave faces away from the camera; ``some`` is the surface,
    thinned."""
    some = some or thin_surface(surface)
    count = int(some.measured.sum())
    return float((some.normals[..., 2] < AWAY)[some.measured].sum() / count) if count >= LEAST_AWAY else 0.0


def coarse_normals(surface: Surface) -> Averaged:
    """Return a surface's normals averaged over squares, about WIDTH_PX of them in a row: what slopes are taken of."""
    measured = _mean_of_squares(surface.measured) > WHOLE
    small = np.empty((*measured.shape, 3), np.float32)
    for axis in range(3):  # as they lie in memory
        small[..., axis] = _mean_of_squares(surface.normals[..., axis])
        let_go(surface.normals)
    return Averaged(measured, small)


def _mean_of_squares(plane: NDArray[Any]) -> NDArray[np.float32]:
    """Return the means of a picture (row, col) over squares, about WIDTH_PX of them in a row."""
    step = max(min(plane.shape[1] // WIDTH_PX, plane.shape[0]), 1)
    rows, cols = (size // step for size in plane.shape)
    fine = max(step // LEAST_AVERAGED, 1)
    some = plane[: rows * step : fine, : cols * step : fine]
    return np.asarray(cv2.resize(some.astype(np.float32), (cols, rows), interpolation=cv2.INTER_AREA), np.float32)
