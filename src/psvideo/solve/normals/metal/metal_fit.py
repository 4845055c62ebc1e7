"""Whether a subject is metal, and what it then shows: lobes that explain its points far better than any matte surface,
and lobes of flatter and steeper surfaces that explain them nearly as well."""

from collections.abc import Sequence

import numpy as np

from psvideo.compute.ranks import median
from psvideo.model.arrays import Doubles
from psvideo.model.surface import Metal, RivalLobes
from psvideo.solve.normals.metal.lobe_fit import (
    LobesAndNormals,
    followed,
    leaning,
    lobes_of,
    normals_under,
    unlike_shown,
    unlike_under,
)
from psvideo.solve.normals.robust.reflectance_fit import ON_A_RING, off_a_ring
from psvideo.solve.normals.robust.reflectance_model import Kind, Sought, alternated, parts_of
from psvideo.solve.normals.robust.subject_points import LEAST_POINTS, SubjectPoints, joined, sizes_of

LIGHTS_FOR_METAL = 7
"""Under six some pixels find where lamps are mirrored on the wrong side: of what is trusted 5 % is over 10 degrees."""
LEAST_UNLIKE = 1e-4
"""What a matte surface with highlights leaves, as a share of the light's square roots, below which nobody asks."""
MOST_LEFT = 0.4
"""Of what that leaves, metal leaves at most this: of bronze, brushed and rough metal 0.01 to 0.4, of what is no metal
under a rig of the wrong strengths 0.5 and more, and otherwise above 0.7."""
LEAST_TURNED_DEG = 2.0
"""By so much lobes turn typical normals: for less nothing is to be gained."""
PART_SURELY = 2.0
"""What fits a matte surface worst fits anything else better by chance: of it so many times more is asked."""
POINTS, FEWEST, MEASUREMENTS = 200, 100, 8000
"""Lobes are fitted to so many points, to fewer under many lights."""
TRIED, ALTERNATIONS = 3, 14
"""Lobes and normals follow each other so often from every first guess, and from the best one."""
FIRST_LOBES = (3, 4, 10)
"""Which lobes are tried first, beside those that fit the matte surface's normals: h^8, h^16, and h^4 times n . l."""
NOT_METAL: tuple[Kind, ...] = ("shining", "rough", "soft")
"""What a subject is asked for beside metal."""
LEAST_FACING = 0.05
"""The cosine to the camera of what is seen."""
SLOPES = (0.7, 1.4)
"""How many times steeper surfaces are tried as well: under broad lobes slopes and profile stand in for each other."""
HOPELESS = 2.0
"""What is so many times above MOST_LEFT then is not followed further."""


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
    worse = matte.unlike > matte.left
    return _metal(points.only(worse), matte.only(worse), surely=PART_SURELY)


def _metal(points: SubjectPoints, matte: LobesAndNormals, *, surely: float = 1.0) -> Metal | None:
    """Return what points show as metal, where that explains them far better than a ``matte`` surface; so many times
    more ``surely`` than for a whole subject."""
    if matte.left < LEAST_UNLIKE * surely:
        return None
    best = _best(points, matte)
    if best is None:
        return None
    turned = np.degrees(np.arccos(np.clip((best.normals * matte.normals).sum(axis=1), -1, 1)))
    if best.left > MOST_LEFT / surely * matte.left or median(turned) < LEAST_TURNED_DEG * surely:
        return None
    return Metal(tuple(map(float, best.numbers)), tuple(_rival(points, best, slopes) for slopes in SLOPES))


def _rival(points: SubjectPoints, best: LobesAndNormals, slopes: float) -> RivalLobes:
    """Return lobes that were fitted to a surface so many times as steep as the best, whose normals then follow them.

    Of narrow highlights nothing else comes near the best; under broad ones a flatter surface may look alike."""
    numbers = lobes_of(points, leaning(best.normals, slopes)).numbers
    left = float(median(unlike_under(points, numbers, normals_under(points, numbers))))
    return RivalLobes(tuple(map(float, numbers)), min(best.left / left, 1.0) if left > 0 else 1.0)


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
    kinds = [lobes_of(points, _facing(points.normals), lit_from_around=True)]
    for kind in NOT_METAL:
        found = alternated(points, g, typical, Sought(kind))
        turned = _facing(found.g)
        lobes = lobes_of(points, turned, lit_from_around=True)
        cosines = (points.towards * turned).sum(axis=-1)
        shown = cosines + np.tensordot(found.model, parts_of(points, found.g, typical)[1:], axes=1)
        kinds += [lobes, LobesAndNormals(lobes.numbers, turned, unlike_shown(points, shown))]
    return min(kinds, key=lambda one: one.left)


def _facing(vectors: Doubles) -> Doubles:
    """Return unit normals along vectors (point, 3), none of which faces away: what is seen does not, and wild normals
    of a matte surface under light from around would explain all that metal shows."""
    length = np.linalg.norm(vectors, axis=1)
    turned = vectors.copy()
    turned[:, 2] = np.maximum(turned[:, 2], LEAST_FACING * length)
    return np.ascontiguousarray(turned / np.linalg.norm(turned, axis=1, keepdims=True))


def _best(points: SubjectPoints, matte: LobesAndNormals) -> LobesAndNormals | None:
    """Return the lobes that explain points best; None where they hardly explain them better."""
    tried = [followed(points, first, times=TRIED) for first in _firsts(matte)]
    best = min(tried, key=lambda one: one.left)
    if best.left > HOPELESS * MOST_LEFT * matte.left:
        return None
    found = followed(points, best.numbers, times=ALTERNATIONS)
    for slopes in SLOPES:
        first = lobes_of(points, leaning(found.normals, slopes)).numbers
        found = min(found, followed(points, first, times=ALTERNATIONS), key=lambda one: one.left)
    return found


def _firsts(matte: LobesAndNormals) -> list[Doubles]:
    """Return the lobes that are tried first."""
    own = [matte.numbers]
    for lobe in FIRST_LOBES:
        one = np.zeros(len(matte.numbers))
        one[0], one[lobe] = 0.2, 0.8
        own.append(one)
    return own
