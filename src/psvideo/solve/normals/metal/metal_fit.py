"""Whether a subject is metal, and what it then shows: lobes that explain its points far better than any matte surface.

A point's normal under given lobes is looked for everywhere, not only around the one that a matte surface would have;
lobes are fitted to the points' normals, and both in turn. Lobes h^2 to h^256 in sums follow microfacets of any
roughness (B. Walter et al., "Microfacet models for refraction through rough surfaces", EGSR 2007) closely enough.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls  # type: ignore[attr-defined]  # its stubs leave it out

from psvideo.compute.ranks import median
from psvideo.model.arrays import Doubles
from psvideo.model.surface import Metal
from psvideo.solve.normals.robust.reflectance_fit import (
    LEAST_POINTS,
    ON_A_RING,
    Kind,
    Sought,
    SubjectPoints,
    alternated,
    joined,
    off_a_ring,
    parts_of,
    sizes_of,
)

LIGHTS_FOR_METAL = 8
"""Fewer explain every surface too well: photographs of pottery under six lights as well as metal's."""
LEAST_UNLIKE = 1e-4
"""What a matte surface with highlights leaves, as a share of the light's square roots, below which nobody asks."""
MOST_LEFT = 0.4
"""Of what that leaves, metal leaves at most this: of bronze, brushed and rough metal 0.02 to 0.35, of photographed
pottery 0.5 to 1."""
LEAST_TURNED_DEG = 2.0
"""By so much lobes turn typical normals: for less nothing is to be gained."""
PART_SURELY = 2.0
"""What fits a matte surface worst fits anything else better by chance: of it so many times more is asked."""
POINTS, FEWEST, MEASUREMENTS = 200, 100, 8000
"""Lobes are fitted to so many points, to fewer under many lights."""
TRIED, ALTERNATIONS, REWEIGHTED, SCALED = 3, 14, 8, 2
"""Lobes and normals follow each other so often from every first guess, and from the best one; steps of weights, and of
scales in each."""
LEAST_SHOWN = 0.02
"""Of a point's largest square root: so much is shown at least where roots are compared."""
APART_DEG, FARTHEST_DEG = 7.0, 85.0
"""Between the normals that are tried, and how far they lean from the camera's axis."""
WIDTH = 5.0
FIRST_LOBES = (3, 4, 10)
"""Which lobes are tried first, beside those that fit the matte surface's normals: h^8, h^16, and h^4 times n . l."""
NOT_METAL: tuple[Kind, ...] = ("shining", "rough", "soft")
"""What a subject is asked for beside metal."""
LEAST_FACING = 0.05
"""The cosine to the camera of what is seen."""
SLOPES = (0.7, 1.4)
"""How many times steeper surfaces are tried as well: of broad lobes slopes and profile stand in for each other."""
HOPELESS = 2.0
"""What is so many times above MOST_LEFT then is not followed further."""


Columns = tuple[int, ...]
ALL, PLAIN, SHADED = tuple(range(17)), tuple(range(9)), (0, *range(9, 17))
"""Which of a metal's numbers are fitted: all, and those of one kind of lobes."""


class LobesAndNormals(NamedTuple):
    """Lobes' numbers, the normals that follow them, and what they leave of every point."""

    numbers: Doubles
    normals: Doubles
    unlike: Doubles


def metal_of(looks: Sequence[SubjectPoints]) -> Metal | None:
    """Return what a subject shows as metal, from one look at it or several; None where it is none. Where all points
    show none, the half of them that fits a matte surface worst is asked: machines have painted parts, too."""
    if not looks:
        return None
    points = _fewer(joined(looks))
    if len(points.measured) < LIGHTS_FOR_METAL or points.measured.shape[1] < LEAST_POINTS:
        return None
    if off_a_ring(points.towards.mean(axis=1)) < ON_A_RING:
        return None
    matte = _matte(points)
    found = _metal(points, matte)
    if found is not None:
        return found
    worse = matte.unlike > median(matte.unlike)
    part = LobesAndNormals(matte.numbers, np.ascontiguousarray(matte.normals[worse]), matte.unlike[worse])
    return _metal(points.only(worse), part, surely=PART_SURELY)


def _metal(points: SubjectPoints, matte: LobesAndNormals, *, surely: float = 1.0) -> Metal | None:
    """Return what points show as metal, where that explains them far better than a ``matte`` surface; so many times
    more ``surely`` than for a whole subject."""
    if median(matte.unlike) < LEAST_UNLIKE * surely:
        return None
    best = _best(points, matte, ALL)
    if best is None:
        return None
    turned = np.degrees(np.arccos(np.clip((best.normals * matte.normals).sum(axis=1), -1, 1)))
    if median(best.unlike) > MOST_LEFT / surely * median(matte.unlike) or median(turned) < LEAST_TURNED_DEG * surely:
        return None
    return Metal(tuple(map(float, best.numbers)), *_rivals(points, best))


def _rivals(points: SubjectPoints, best: LobesAndNormals) -> tuple[tuple[tuple[float, ...], ...], tuple[float, ...]]:
    """Return lobes that were fitted to a surface that is flatter, and steeper, than the best, each let go for one step;
    and how likely they are: what the best leaves over what they do.

    Of narrow highlights nothing else comes near; under broad ones a flatter surface with other lobes may look alike."""
    from psvideo.solve.normals.metal.metal_kernel import fill_sums, find_normals

    rivals, likely = list[tuple[float, ...]](), list[float]()
    for slopes in SLOPES:
        numbers, normals = _fitted(points, leaning(best.normals, slopes)).numbers, np.empty_like(best.normals)
        find_normals(points.measured, points.seen, points.towards, points.half, directions(APART_DEG, FARTHEST_DEG), numbers, normals)
        shown = np.empty_like(points.measured)
        fill_sums(normals, points.towards, points.half, numbers, shown)
        rivals.append(tuple(map(float, numbers)))
        likely.append(min(float(median(best.unlike) / median(_unlike(points, shown))), 1.0))
    return tuple(rivals), tuple(likely)


def directions(apart_deg: float, farthest_deg: float) -> Doubles:
    """Return unit vectors evenly over a cap around the camera's axis, (vector, 3).

    >>> directions(30.0, 60.0).shape
    (17, 3)
    """
    found = list[tuple[float, float, float]]()
    for slant in np.radians(np.arange(0, farthest_deg + 1e-6, apart_deg)):
        many = max(round(2 * np.pi * np.sin(slant) / np.radians(apart_deg)), 1)
        for turn in np.arange(many) * 2 * np.pi / many:
            found.append((np.sin(slant) * np.cos(turn), np.sin(slant) * np.sin(turn), np.cos(slant)))
    return np.array(found)


def _fewer(points: SubjectPoints) -> SubjectPoints:
    """Return some of the points, evenly. In them every measurement counts that is not clipped: metal is dark where it
    mirrors no light, and that says where it faces."""
    lit = points.measured.max(axis=0) > 0
    where, many = np.flatnonzero(lit), max(min(POINTS, MEASUREMENTS // len(points.measured)), FEWEST)
    chosen = np.zeros(len(lit), bool)
    chosen[where[np.unique(np.linspace(0, len(where) - 1, many).astype(np.intp))] if len(where) else where] = True
    return points.only(chosen)


def _matte(points: SubjectPoints) -> LobesAndNormals:
    """Return what is left of the normals that a surface would have that is not metal: the least of lobes and light from
    around under the normals as they were solved, of the same under those that a shining, rough or soft subject turns
    them to, and of what such a subject shows itself."""
    sizes = sizes_of(points)
    typical = median(sizes[sizes > 0])
    g = points.normals * np.maximum(sizes, 1e-3 * typical)[:, None]
    kinds = [_fitted(points, _seen(points.normals), lit_from_around=True)]
    for kind in NOT_METAL:
        found = alternated(points, g, typical, Sought(kind))
        turned = _seen(found.g)
        lobes = _fitted(points, turned, lit_from_around=True)
        cosines = (points.towards * turned).sum(axis=-1)
        shown = cosines + np.tensordot(found.model, parts_of(points, found.g, typical)[1:], axes=1)
        kinds += [lobes, LobesAndNormals(lobes.numbers, turned, _unlike(points, shown))]
    return min(kinds, key=lambda one: median(one.unlike))


def _seen(normals: Doubles) -> Doubles:
    """Return unit normals (point, 3) of vectors, none of which faces away from the camera: what is seen does not."""
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    turned = np.where(normals[:, 2:] > LEAST_FACING * length, normals, (1, 1, 0) * normals + (0, 0, LEAST_FACING) * length)
    return np.ascontiguousarray(turned / np.linalg.norm(turned, axis=1, keepdims=True))


def _unlike(points: SubjectPoints, shown: Doubles) -> Doubles:
    """Return the share of every point's light that is not what is ``shown`` (light, point)."""
    from psvideo.solve.normals.metal.metal_kernel import fill_unlike

    unlike = np.empty(shown.shape[1])
    fill_unlike(points.measured, points.seen, np.ascontiguousarray(shown), unlike)
    return unlike


def _best(points: SubjectPoints, matte: LobesAndNormals, columns: Columns) -> LobesAndNormals | None:
    """Return the lobes, of some columns, that explain points best; None where they hardly explain them better."""
    starts = directions(APART_DEG, FARTHEST_DEG)
    tried = [_followed(points, first, starts, columns, times=TRIED) for first in _firsts(matte)]
    best = min(tried, key=lambda one: median(one.unlike))
    if median(best.unlike) > HOPELESS * MOST_LEFT * median(matte.unlike):
        return None
    found = _followed(points, best.numbers, starts, columns, times=ALTERNATIONS)
    for slopes in SLOPES:
        first = _fitted(points, leaning(found.normals, slopes), columns).numbers
        other = _followed(points, first, starts, columns, times=ALTERNATIONS)
        found = min(found, other, key=lambda one: median(one.unlike))
    return found


def leaning(normals: Doubles, slopes: float) -> Doubles:
    """Return unit normals (point, 3) of a surface whose slopes are so many times as steep.

    >>> leaning(np.array([[0.6, 0.0, 0.8]]), 16 / 9).round(6).tolist()
    [[0.8, 0.0, 0.6]]
    """
    steeper = normals * (slopes, slopes, 1.0)
    return np.ascontiguousarray(steeper / np.linalg.norm(steeper, axis=1, keepdims=True))


def _firsts(matte: LobesAndNormals) -> list[Doubles]:
    """Return the lobes that are tried first."""
    own = [matte.numbers]
    for lobe in FIRST_LOBES:
        one = np.zeros(len(matte.numbers))
        one[0], one[lobe] = 0.2, 0.8
        own.append(one)
    return own


def _followed(
    points: SubjectPoints, first: Doubles, starts: Doubles, columns: Columns, *, times: int
) -> LobesAndNormals:
    """Return lobes and normals that follow each other from a first guess."""
    from psvideo.solve.normals.metal.metal_kernel import find_normals

    numbers, found = first, LobesAndNormals(first, points.normals, np.ones(len(points.normals)))
    for _ in range(times):
        normals = np.empty_like(points.normals)
        find_normals(points.measured, points.seen, points.towards, points.half, starts, numbers, normals)
        found = _fitted(points, normals, columns)
        numbers = found.numbers
    return found


def _fitted(
    points: SubjectPoints, normals: Doubles, columns: Columns = ALL, *, lit_from_around: bool = False
) -> LobesAndNormals:
    """Return the lobes that explain points with these normals best, each point in a scale of its own; and where
    ``lit_from_around``, light of every lamp that reaches all points alike, shadows as well."""
    from psvideo.solve.normals.metal.metal_kernel import LOBES, fill_shown

    parts = np.empty((1 + 2 * LOBES, *points.measured.shape))
    fill_shown(np.ascontiguousarray(normals), points.towards, points.half, parts)
    if lit_from_around:
        parts = np.concatenate([parts, np.ones_like(parts[:1])])
        columns = (*columns, len(parts) - 1)
    bright = points.seen * np.maximum(points.measured, 0.0)
    bright /= np.maximum(bright.sum(axis=0), 1e-12)
    numbers = np.full(len(parts), 1 / len(parts))
    for _ in range(REWEIGHTED):
        scale, per = _per_root(points.seen, np.sqrt(bright), np.sqrt(np.tensordot(numbers, parts, axes=1)))
        wanted = (per * scale * parts[list(columns)]).reshape(len(columns), -1).T
        numbers = np.zeros(len(parts))
        numbers[list(columns)] = nnls(wanted, (per * bright).ravel())[0]
        numbers /= max(float(numbers.sum()), 1e-9)
    unlike = _unlike(points, np.tensordot(numbers, parts, axes=1))
    return LobesAndNormals(numbers[: 1 + 2 * LOBES], np.ascontiguousarray(normals), unlike)


def _per_root(seen: Doubles, root: Doubles, shown: Doubles) -> tuple[Doubles, Doubles]:
    """Return every point's scale of what is ``shown``, and by what differences of light are multiplied to become those
    of square roots, of which normals leave the least; where these stand out they count less. ``root`` and ``shown`` are
    square roots (light, point).

    Lobes that were fitted to light itself, and normals to its roots, drove each other away from where both were right.
    """
    weights = seen
    for _ in range(SCALED):
        scale = (weights * root * shown).sum(axis=0) / np.maximum((weights * shown**2).sum(axis=0), 1e-12)
        rest = root - scale * shown
        spread = WIDTH * 1.48 * median(np.abs(rest[seen > 0])) + 1e-9
        weights = seen / (1 + (rest / spread) ** 2)
    return scale**2, np.sqrt(weights) / (root + np.maximum(scale * shown, LEAST_SHOWN * root.max(axis=0)) + 1e-9)
