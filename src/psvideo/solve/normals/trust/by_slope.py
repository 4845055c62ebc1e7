"""Albedo that goes with the slope: paint does not, it differs from place to place.

Three lights leave nothing over, whatever the surface does. But what turns a normal makes it longer or shorter as well:
a sheen, clay, a highlight, light that every lamp adds, a lamp of another strength. So the albedo of a surface that is
not what the lights take it for differs with the slope. (G. Alldrin, S. Mallick and D. Kriegman, "Resolving the
generalized bas-relief ambiguity by entropy minimization", CVPR 2007: normals are right where albedo is most alike.)

How albedo differs between neighbours is fitted by how smooth functions of their normals do. Where it jumps from one
point to the next paint ends, and that does not count. Only what the white squares of a chess board over the subject
tell of the black ones counts: the rest goes with the slope by chance. Paint that fades as smoothly as a sheen does
changes colours as no sheen can: what goes with that is taken off. By how much albedo goes with the slope, and how
the lights spread what is off along the normal and across it, says by how much normals are turned.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.ranks import median
from psvideo.model.arrays import Doubles, Floats, Mask
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.trust.added_light import Added, turned_by_added_deg
from psvideo.solve.normals.trust.by_colour import painted, spread_across_and_along
from psvideo.solve.normals.trust.slope_pairs import (
    AVERAGED,
    TYPICAL_OF_MEDIAN,
    SlopePairs,
    averaged,
    in_light_of_all,
    of_place,
    pairs_of,
    robustly,
    solved,
    without_edges,
)
from psvideo.solve.normals.trust.thin_surface import ThinSurface

POWERS = (30.0, 120.0)
"""Highlights half way between a light and the camera are so narrow, as powers of the cosine."""
SQUARES = 0.15
"""The chess board's squares have this share of the subject's size."""
MOST_OUTLYING = 3.0
"""Where nothing was fitted, functions run away: beyond this many times their root mean square they count no more."""
OF_PLACE = 0.5
"""What goes with the slope as it goes with the place may be a lens that darkens its corners: it counts by so much."""
OF_NOISE = 0.15
"""By so much of what noise does to normals of a matte ball their albedo goes with the slope all the same."""
TURNS_MORE, LARGEST_DEG = 1.5, 30.0
"""Normals are turned by so many times what albedo shows of it, since a part of it shows in no length; what that says by
as many degrees as the second number counts half, and nothing counts more: such lengths are a highlight's."""


def by_slope_deg(
    points: ThinSurface,
    lit: Illumination,
    known: Mask,
    *,
    unseen: float = 1.0,
    added: Sequence[Added] = (),
    modelled_deg: float = 0.0,
) -> Floats | None:
    """Return by how many degrees normals are turned, as far as albedo that goes with the slope shows it, (row, col) of
    the points, of which these ``known`` speak for the subject; None where too few of them are in the light of all
    lamps. What turns normals counts as far as residuals leave it ``unseen`` (``unchecked.py``), or light that all lamps
    ``added`` alike (``added_light.py``), where that is more; a model of the subject turned normals by
    ``modelled_deg``."""
    normals, albedo, whole = averaged(points, known)
    bright = in_light_of_all(normals, albedo, lit, whole)
    if not bright.any():
        return None
    lengths, paint = without_edges(points.brightness, known), painted(points, known, AVERAGED)
    pairs = pairs_of(normals, lengths, paint, bright)
    if pairs is None:
        return None
    pairs = _without_paint(pairs, lit)
    shown = np.zeros(known.shape, np.float32)
    if unseen:
        typical_deg = np.float32(unseen * TURNS_MORE * np.degrees(_goes_with_slope(pairs, lit)))
        shown = typical_deg * _turned_beside_stretched(points, lit, known, bright)
    if added:
        shown = np.maximum(shown, turned_by_added_deg(points, pairs, added, modelled_deg=modelled_deg))
    shown = np.sqrt(np.maximum(shown**2 - (np.float32(OF_NOISE) * points.noise_deg) ** 2, 0))
    return np.asarray(shown / (1 + shown / np.float32(LARGEST_DEG)), np.float32)


def _functions(normals: Doubles, directions: NDArray[np.floating]) -> Doubles:
    """Return smooth functions of normals (point, 3): spherical harmonics up to the third order, and highlights of all
    lights (light, 3), (point, function)."""
    x, y, z = normals.T
    smooth = [x, y, z, x * y, y * z, x * z, x * x - y * y, 3 * z * z - 1, x * y * z, z * (x * x - y * y)]
    smooth += [x * (x * x - 3 * y * y), y * (3 * x * x - y * y), x * (5 * z * z - 1), y * (5 * z * z - 1)]
    smooth += [z * (5 * z * z - 3)]
    half = directions + np.array([0, 0, 1])
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    shine = np.maximum(normals @ half.T, 0)
    return np.concatenate([np.stack(smooth, axis=-1), *(shine**power for power in POWERS)], axis=1)


def _changes(pairs: SlopePairs, lit: Illumination) -> tuple[Doubles, Doubles]:
    """Return by what functions of normals differ (pair, function), 1 in the mean, and what they are at the first of
    each pair."""
    here, there = (_functions(normals, lit.directions) for normals in (pairs.here, pairs.there))
    changes = there - here
    scale = np.sqrt((changes**2).mean(axis=0)) + 1e-9
    return changes / scale, here / scale


def _without_paint(pairs: SlopePairs, lit: Illumination) -> SlopePairs:
    """Return the pairs without what of their albedo goes with colours as only paint does, beside functions of normals:
    fitted by itself, it would take what goes with the slope as well."""
    if not pairs.paint.any():
        return pairs
    paint = pairs.paint / np.sqrt((pairs.paint**2).mean())
    numbers, _ = robustly(np.concatenate([_changes(pairs, lit)[0], paint[:, None]], axis=1), pairs.differs)
    return pairs._replace(differs=pairs.differs - numbers[-1] * paint)


def _goes_with_slope(pairs: SlopePairs, lit: Illumination) -> float:
    """Return by which share of itself albedo typically differs with the slope, as far as one half of the subject tells
    it of the other."""
    changes, here = _changes(pairs, lit)
    numbers, told = _fitted(pairs, changes)
    whole = _about_median(here @ numbers)
    most = MOST_OUTLYING * float(np.sqrt((whole**2).mean()))
    rest, of_place = _without_place(np.clip(whole, -most, most), pairs.place)
    typical, typical_of_place = (TYPICAL_OF_MEDIAN * median(np.abs(each)) for each in (rest, OF_PLACE * of_place))
    return float(np.hypot(typical, typical_of_place) * np.sqrt(told))


def _fitted(pairs: SlopePairs, changes: Doubles) -> tuple[Doubles, float]:
    """Return by how much each function counts in how albedo differs, and which share of what they explain functions
    of one half of the subject explain of the other."""
    numbers, weights = robustly(changes, pairs.differs)
    black = (pairs.place / SQUARES).astype(np.intp).sum(axis=1) % 2 == 0
    by_other = np.empty_like(weights)
    for one in (black, ~black):
        by_other[~one] = changes[~one] @ solved(changes[one], pairs.differs[one], weights[one])
    whole = changes @ numbers
    most = MOST_OUTLYING * float(np.sqrt((whole**2).mean()))
    explained = _explained(pairs.differs, whole, weights)
    told = _explained(pairs.differs, np.clip(by_other, -most, most), weights)
    return numbers, min(told / explained, 1.0) if explained > 0 else 0.0


def _explained(differs: Doubles, by_slope: Doubles, weights: Doubles) -> float:
    """Return how much of squares is explained by as many times ``by_slope`` as explain most, 0 where less than none."""
    along = max(float((weights * differs * by_slope).sum()), 0.0)
    return along**2 / max(float((weights * by_slope**2).sum()), 1e-30)


def _about_median(values: Doubles) -> Doubles:
    return np.asarray(values - median(values))


def _without_place(values: Doubles, place: Doubles) -> tuple[Doubles, Doubles]:
    """Return what is left without what goes with the place (point, 2), a polynomial of second order, and that."""
    place = place - place.mean(axis=0)
    terms = np.concatenate([np.ones((len(place), 1)), of_place(place)], axis=1)
    matrix = terms.T @ terms
    matrix[np.diag_indices(6)] += 1e-9 * len(place)
    smooth = terms @ np.linalg.solve(matrix, terms.T @ values)
    return np.asarray(values - smooth), _about_median(smooth)


def _turned_beside_stretched(points: ThinSurface, lit: Illumination, known: Mask, bright: Mask) -> Floats:
    """Return how many times more than along a normal, typically where all lamps shine, lights spread across every
    normal what each is off by, (row, col), where all are off by the same share of their strengths."""
    across, along = spread_across_and_along(points, lit, known)
    return np.asarray(np.sqrt(across / median(along[bright])), np.float32)
