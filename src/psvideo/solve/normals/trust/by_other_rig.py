"""Which share of what lights leave over other directions and strengths of them would explain.

A rig that is off leaves light that goes with the normal, and so does much of what a surface is that is not matte. So a
model of the surface says something only where such a rig does not leave far less than it.
"""

from typing import NamedTuple

import numpy as np

from psvideo.compute.ranks import median
from psvideo.model.arrays import Doubles
from psvideo.solve.normals.robust.point_sums import add_squares
from psvideo.solve.normals.robust.reflectance_model import COUNTED, MODEL_WIDTH, OUTLYING, REWEIGHTED, left_over
from psvideo.solve.normals.robust.subject_points import SubjectPoints

LIKELY_OFF = 0.1
"""Vectors to lights are off by this share of themselves (6 degrees, or a tenth in strength)."""


class LeftOver(NamedTuple):
    """Which share of the squares a model leaves, ``weighted`` as its fit weighs them, and ``evenly`` where all count
    alike."""

    weighted: float
    evenly: float


class OtherRig(NamedTuple):
    """What a subject's points say of lights that are off: which share of what is ``left`` over other lights leave, and
    of the changes of the vectors to them, in units of their strengths (light after light, x, y, z), how ``surely``
    points tell them, (3 light, 3 light), one over their square, and ``told``, that times what they tell."""

    left: LeftOver
    surely: Doubles
    told: Doubles


def other_rig(points: SubjectPoints, g: Doubles) -> OtherRig:
    """Return what other lights would leave of what a vector of each point's own leaves, ``g`` (point, 3)."""
    points = points.in_order()
    parts = _parts(points, g)
    weights, changes = points.counts, np.zeros(len(parts) - 1)
    left, square, right = parts, np.empty((len(changes),) * 2), np.empty(len(changes))
    per = 0.0
    for turn in range(REWEIGHTED):
        left = left_over(points, weights, parts)
        spread = max(float(1.48 * median(np.abs(_rest(left, changes)[points.counts > 0]))), 1e-4)
        per = COUNTED / spread**2 / points.counts.sum()
        add_squares(weights, left, square, right)
        changes = np.linalg.solve(per * square + np.eye(len(changes)) / LIKELY_OFF**2, per * right)
        if turn < REWEIGHTED - 1:
            weights = points.counts / (1 + (_rest(left, changes) / (MODEL_WIDTH * spread)) ** 2)
    weighted = _share(weights * _rest(left, changes) ** 2, weights * left[0] ** 2)
    left = left_over(points, points.counts, parts)
    most = OUTLYING**2 * float((points.counts * left[0] ** 2).sum() / max(points.counts.sum(), 1))
    after, before = (points.counts * np.minimum(each**2, most) for each in (_rest(left, changes), left[0]))
    return OtherRig(LeftOver(weighted, _share(after, before)), per * square, per * right)


def _parts(points: SubjectPoints, g: Doubles) -> Doubles:
    """Return what was measured, in albedos, and what each number of each light's vector would add, (part, light,
    point)."""
    sizes, lights = np.linalg.norm(g, axis=1), len(points.measured)
    parts = np.zeros((1 + 3 * lights, *points.measured.shape))
    parts[0] = points.measured / sizes
    for light in range(lights):
        parts[1 + 3 * light : 4 + 3 * light, light] = (g / sizes[:, None]).T
    return parts


def _rest(left: Doubles, changes: Doubles) -> Doubles:
    return np.asarray(left[0] - np.tensordot(changes, left[1:], axes=1))


def _share(after: Doubles, before: Doubles) -> float:
    return float(after.sum() / max(float(before.sum()), 1e-30))
