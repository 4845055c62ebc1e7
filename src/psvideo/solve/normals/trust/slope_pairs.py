"""Neighbours in the light of all lamps: how their albedo differs, and how it goes with anything else.

Edges of paint do not count: albedo jumps there, and what a surface sends back goes on as smoothly as its slope. (E.
Land and J. McCann, "Lightness and retinex theory", JOSA 1971.)
"""

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.compute.ranks import median
from psvideo.model.arrays import Doubles, Floats, Mask
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.trust.thin_surface import ThinSurface, blurred, line

AVERAGED = 5
"""Normals and albedo are means over squares of so many points, and neighbours are so far apart: what noise does to both
at once would pass for albedo that goes with the slope."""
MOST_PAIRS, LEAST_PAIRS = 2500, 300
"""So many pairs are fitted, evenly over the subject, and at least the second number."""
IN_LIGHT, LEAST_BRIGHT = 0.2, 0.05
"""A point speaks where every light shines on it by at least this share of the mean, and where it is not darker than the
second share of what is typical: in shadow there is no albedo."""
EVEN = 2.0
"""Squares in which albedo varies by more than so many times what is typical hold an edge of paint, and do not speak."""
AT_EDGE, BESIDE_EDGE, ACROSS_EDGE, JUMPS = 5, 11, 3, 6.0
"""Albedo jumps where it differs from one point to the next by more than so many times what it typically does beside:
beyond the first number of points and up to the second, over lines of the third. There paint ends, or begins: a sheen
changes as slowly beside. (With 4 times photographs showed a tenth less, with 8 a painted ball with noise more.)"""
CREASE = np.float32(0.45)
"""Neighbours whose normals differ by more lie on either side of a crease, and do not speak: faces of a box may be
painted otherwise, and few faces tell paint from anything."""
APART, JITTERS, JITTER_POINTS, LEAST_SLOPING = 2, np.float32(3.0), 41, 0.1
"""Neighbours speak where their normals differ by more than so many times what three in a row differ from an even turn,
in the mean over so many points: noise, and a codec's errors, turn a normal and make it longer at once, and say nothing
of the slope. The three lie so many points apart. Where fewer of all neighbours speak than the last share, none do."""
LEAST_ALBEDO = np.float32(1e-6)
TURNS, RIDGE = 5, 1e-4
"""Cauchy's weights are found in so many turns; numbers that hardly show stay near 0."""
TYPICAL_OF_MEDIAN = 1.48


class SlopePairs(NamedTuple):
    """Neighbours: how the logarithm of albedo differs (pair,), the normals of the first and of the other (pair, 3),
    where these are, in rows and columns over the subject's size (pair, 2), and how their colours differ as only paint
    does (pair,)."""

    differs: Doubles
    here: Doubles
    there: Doubles
    place: Doubles
    other: Doubles
    paint: Doubles


def averaged(points: ThinSurface, known: Mask) -> tuple[Floats, Floats, Mask]:
    """Return normals (3, row, col) and albedo (row, col) of means over squares, and which squares are known as a whole
    and hold no edge of paint."""
    from psvideo.solve.normals.trust.by_slope_kernel import SUMMED, fill_averaged, fill_summed

    given = np.ascontiguousarray(known).view(np.uint8).reshape(-1)
    summed = np.empty((SUMMED, *known.shape), np.float32)
    fill_summed(points.planes.reshape(3, -1), line(points.brightness), given, summed.reshape(SUMMED, -1))
    means = blurred(summed, AVERAGED)
    varies, whole = np.empty(known.shape, np.float32), np.empty(known.shape, np.bool_)
    fill_averaged(means.reshape(SUMMED, -1), given, line(varies), whole.view(np.uint8).reshape(-1))
    if whole.any():
        whole &= varies <= np.float32(EVEN) * median(varies[whole])
    return means[:3], means[3], whole


def pairs_of(normals: Floats, lengths: Floats, paint: Floats, bright: Mask) -> SlopePairs | None:
    """Return neighbours in the light of all lamps, None where there are too few. ``lengths`` (2, row, col): the
    logarithm of albedo down the columns and along the rows (``without_edges``); ``paint`` (row, col): how far colour is
    what only paint makes it (``by_colour.py``)."""
    cols = bright.shape[1]
    over, beside = (np.flatnonzero(both) for both in _both(bright))
    ways, jitter = normals.reshape(3, -1), line(_jitter(normals, bright))
    every = len(over) + len(beside)
    over, beside = (_sloping(ways, jitter, at, step) for at, step in ((over, AVERAGED * cols), (beside, AVERAGED)))
    first, second = np.concatenate([over, beside]), np.concatenate([over + AVERAGED * cols, beside + AVERAGED])
    if len(first) < max(LEAST_PAIRS, LEAST_SLOPING * every):
        return None
    chosen = np.linspace(0, len(first) - 1, min(MOST_PAIRS, len(first))).astype(np.intp)
    first, second, down = first[chosen], second[chosen], chosen < len(over)
    here, there = (ways[:, at].T.astype(np.float64) for at in (first, second))
    column, row = lengths.reshape(2, -1)[:, second].astype(np.float64) - lengths.reshape(2, -1)[:, first]
    size = np.sqrt(np.count_nonzero(bright))
    place, other = (np.stack(np.divmod(at, cols), axis=-1) / size for at in (first, second))
    painted = paint.reshape(-1).astype(np.float64)
    painted = painted[second] - painted[first]
    return SlopePairs(np.where(down, column, row), here=here, there=there, place=place, other=other, paint=painted)


def _sloping(ways: Floats, jitter: Floats, first: NDArray[np.intp], step: int) -> NDArray[np.intp]:
    """Return those of the places ``first`` from which to others, a ``step`` on, normals turn more than they jitter
    there, and no crease lies between."""
    turned = np.sqrt(((ways[:, first + step] - ways[:, first]) ** 2).sum(axis=0))
    return np.asarray(first[(turned < CREASE) & (turned > JITTERS * jitter[first])])


def _jitter(normals: Floats, bright: Mask) -> Floats:
    """Return by how much normals of three squares in a row differ from an even turn, (row, col), a mean around."""
    second, counts = np.zeros(bright.shape, np.float32), np.zeros(bright.shape, np.float32)
    for axis in (0, 1):
        lines, three = np.moveaxis(normals, axis + 1, 1), np.moveaxis(bright, axis, 0)
        ends = lines[:, : -2 * APART] + lines[:, 2 * APART :] - 2 * lines[:, APART:-APART]
        there = three[: -2 * APART] & three[APART:-APART] & three[2 * APART :]
        into = (np.moveaxis(plane, axis, 0)[APART:-APART] for plane in (second, counts))
        for plane, values in zip(into, (np.sqrt((ends**2).sum(axis=0)), np.float32(1)), strict=True):
            plane += there * values
    around = (JITTER_POINTS,) * 2
    return np.asarray(cv2.blur(second, around) / np.maximum(cv2.blur(counts, around), np.float32(1e-6)), np.float32)


def without_edges(albedo: Floats, known: Mask) -> Floats:
    """Return the logarithm of albedo down the columns and along the rows, (2, row, col), means over squares, without
    the steps at which it jumps. Both begin anew in every line: only differences within one say anything."""
    whole = np.log(np.maximum(albedo, LEAST_ALBEDO))
    return np.stack([_down_columns(whole, known), _down_columns(whole.T, known.T).T])


def _down_columns(whole: Floats, known: Mask) -> Floats:
    steps = np.diff(whole, axis=0) * (known[1:] & known[:-1])
    sizes = np.abs(steps)

    def total(points: int) -> Floats:
        size = (ACROSS_EDGE, points)
        return np.asarray(cv2.boxFilter(sizes, -1, size, normalize=False, borderType=cv2.BORDER_REFLECT), np.float32)

    beside = (total(BESIDE_EDGE) - total(AT_EDGE)) / np.float32(ACROSS_EDGE * (BESIDE_EDGE - AT_EDGE))
    lengths = np.zeros(whole.shape, np.float32)
    np.cumsum(steps * (sizes <= np.float32(JUMPS) * beside), axis=0, out=lengths[1:])
    return blurred(lengths, AVERAGED)


def in_light_of_all(normals: Floats, albedo: Floats, lit: Illumination, known: Mask) -> Mask:
    """Return where of what is ``known`` all lights shine on a surface that is not black, (row, col)."""
    from psvideo.solve.normals.trust.by_slope_kernel import fill_in_light

    in_light = np.empty(known.shape, np.bool_)
    flags = (each.view(np.uint8).reshape(-1) for each in (known, in_light))
    fill_in_light(normals.reshape(3, -1), lit.directions.astype(np.float32), IN_LIGHT, *flags)
    if not in_light.any():
        return in_light
    return np.asarray(in_light & (albedo > LEAST_BRIGHT * median(albedo[in_light])))


def _both(bright: Mask) -> tuple[Mask, Mask]:
    """Return where a point and its neighbour below, and that to the right, are bright."""
    below, beside = np.zeros_like(bright), np.zeros_like(bright)
    below[:-AVERAGED] = bright[:-AVERAGED] & bright[AVERAGED:]
    beside[:, :-AVERAGED] = bright[:, :-AVERAGED] & bright[:, AVERAGED:]
    return below, beside


def robustly(changes: Doubles, differs: Doubles) -> tuple[Doubles, Doubles]:
    """Return by how much each function (pair, function) counts in how albedo differs, and every pair's weight."""
    weights = np.ones(len(changes))
    for _ in range(TURNS):
        numbers = solved(changes, differs, weights)
        left = np.abs(differs - changes @ numbers)
        weights = 1 / (1 + (left / (TYPICAL_OF_MEDIAN * median(left) + 1e-6)) ** 2)
    return numbers, weights


def solved(changes: Doubles, differs: Doubles, weights: Doubles) -> Doubles:
    """Return by how much each function (pair, function) counts in least squares of so many ``weights`` (pair,)."""
    weighed = changes * weights[:, None]
    matrix = weighed.T @ changes
    matrix.reshape(-1)[:: len(matrix) + 1] += RIDGE * max(float(matrix.trace()) / len(matrix), 1e-9)
    return np.asarray(np.linalg.solve(matrix, weighed.T @ differs))


def of_place(place: Doubles) -> Doubles:
    """Return what a polynomial of second order of the place (point, 2) consists of beside what is everywhere alike."""
    row, col = place.T
    return np.stack([row, col, row * row, row * col, col * col], axis=-1)
