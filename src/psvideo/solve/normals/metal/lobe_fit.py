"""Lobes of a subject's points, and the normals that follow them: each is fitted to the other in turn.

A point's normal under given lobes is looked for everywhere, not only around the one that a matte surface would have.
Lobes h^2 to h^256 in sums follow microfacets of any roughness (B. Walter et al., "Microfacet models for refraction
through rough surfaces", EGSR 2007) closely enough. Lobes and normals leave least of the same thing, square roots of
brightness: lobes that were fitted to light itself drove normals away from where both were right.
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls  # type: ignore[attr-defined]  # its stubs leave it out

from psvideo.compute.ranks import median
from psvideo.model.arrays import Doubles
from psvideo.solve.normals.robust.subject_points import SubjectPoints

REWEIGHTED, SCALED = 8, 2
"""Steps of weights, and of scales in each."""
WIDTH = 3.5
"""Cauchy's, in standard deviations of what is left: with less the steep points, which tell lobes apart, hardly
counted."""
LEAST_SHOWN = 0.02
"""Of a point's largest square root: so much is shown at least where roots are compared."""
APART_DEG, FARTHEST_DEG = 7.0, 85.0
"""Between the normals that are tried, and how far they lean from the camera's axis."""


class LobesAndNormals(NamedTuple):
    """Lobes' numbers, the normals that follow them (point, 3), and the share of every point's light that they leave."""

    numbers: Doubles
    normals: Doubles
    unlike: Doubles

    @property
    def left(self) -> float:
        """What is left of a typical point."""
        return float(median(self.unlike))

    def only(self, some: np.ndarray) -> "LobesAndNormals":
        """Return the same of some points, a mask."""
        return LobesAndNormals(self.numbers, np.ascontiguousarray(self.normals[some]), self.unlike[some])


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


def leaning(normals: Doubles, slopes: float) -> Doubles:
    """Return unit normals (point, 3) of a surface whose slopes are so many times as steep.

    >>> leaning(np.array([[0.6, 0.0, 0.8]]), 16 / 9).round(6).tolist()
    [[0.8, 0.0, 0.6]]
    """
    steeper = normals * (slopes, slopes, 1.0)
    return np.ascontiguousarray(steeper / np.linalg.norm(steeper, axis=1, keepdims=True))


def followed(points: SubjectPoints, first: Doubles, *, times: int) -> LobesAndNormals:
    """Return lobes and normals that follow each other from a first guess at lobes."""
    numbers, found = first, LobesAndNormals(first, points.normals, np.ones(len(points.normals)))
    for _ in range(times):
        found = lobes_of(points, normals_under(points, numbers))
        numbers = found.numbers
    return found


def normals_under(points: SubjectPoints, numbers: Doubles) -> Doubles:
    """Return the normals (point, 3) that explain points best under given lobes."""
    from psvideo.solve.normals.metal.metal_normals import find_normals

    normals, starts = np.empty_like(points.normals), directions(APART_DEG, FARTHEST_DEG)
    find_normals(points.measured, points.seen, points.towards, points.half, starts, numbers, normals)
    return normals


def lobes_of(points: SubjectPoints, normals: Doubles, *, lit_from_around: bool = False) -> LobesAndNormals:
    """Return the lobes that explain points with these normals best, each point in a scale of its own; and where
    ``lit_from_around``, light of every lamp that reaches all points alike, shadows as well."""
    from psvideo.solve.normals.metal.lobe_kernel import LOBES, fill_shown

    parts = np.empty((1 + 2 * LOBES, *points.measured.shape))
    fill_shown(np.ascontiguousarray(normals), points.towards, points.half, parts)
    if lit_from_around:
        parts = np.concatenate([parts, np.ones_like(parts[:1])])
    bright = points.seen * np.maximum(points.measured, 0.0)
    bright /= np.maximum(bright.sum(axis=0), 1e-12)
    numbers = np.full(len(parts), 1 / len(parts))
    for _ in range(REWEIGHTED):
        scale, per = _per_root(points.seen, np.sqrt(bright), np.sqrt(np.tensordot(numbers, parts, axes=1)))
        numbers = nnls((per * scale * parts).reshape(len(parts), -1).T, (per * bright).ravel())[0]
        numbers /= max(float(numbers.sum()), 1e-9)
    unlike = unlike_shown(points, np.tensordot(numbers, parts, axes=1))
    return LobesAndNormals(numbers[: 1 + 2 * LOBES], np.ascontiguousarray(normals), unlike)


def _per_root(seen: Doubles, root: Doubles, shown: Doubles) -> tuple[Doubles, Doubles]:
    """Return every point's scale of what is ``shown``, and by what differences of light are multiplied to become those
    of square roots; where these stand out they count less. ``root`` and ``shown`` are square roots (light, point)."""
    weights = seen
    for _ in range(SCALED):
        scale = (weights * root * shown).sum(axis=0) / np.maximum((weights * shown**2).sum(axis=0), 1e-12)
        rest = root - scale * shown
        spread = WIDTH * 1.48 * median(np.abs(rest[seen > 0])) + 1e-9
        weights = seen / (1 + (rest / spread) ** 2)
    return scale**2, np.sqrt(weights) / (root + np.maximum(scale * shown, LEAST_SHOWN * root.max(axis=0)) + 1e-9)


def unlike_shown(points: SubjectPoints, shown: Doubles) -> Doubles:
    """Return the share of every point's light that is not what is ``shown`` (light, point)."""
    from psvideo.solve.normals.metal.lobe_kernel import fill_unlike

    unlike = np.empty(shown.shape[1])
    fill_unlike(points.measured, points.seen, np.ascontiguousarray(shown), unlike)
    return unlike


def unlike_under(points: SubjectPoints, numbers: Doubles, normals: Doubles) -> Doubles:
    """Return the share of every point's light that lobes leave of it with these normals (point, 3)."""
    from psvideo.solve.normals.metal.lobe_kernel import fill_sums

    shown = np.empty_like(points.measured)
    fill_sums(normals, points.towards, points.half, numbers, shown)
    return unlike_shown(points, shown)
