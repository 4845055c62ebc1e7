"""By how much lights that are off turn normals, where points of a subject show that they are.

Of the changes of k lights' vectors, 3 k numbers, a subject shows 3 (k - 3): the others turn normals and leave nothing
over. So what shows only says how far lights typically are off, and the rest may be off as much: changes are Gaussian,
of directions and of strengths, of sizes that what shows makes likely (a mixture over ``OFF`` and ``STRENGTHS``, by
their evidence).
"""

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.solve.normals.robust.subject_points import SubjectPoints
from psvideo.solve.normals.trust.by_other_rig import OtherRig

OFF = np.radians([0.15, 0.3, 0.6, 1.2, 2.4, 4.8, 9.6])
"""So far lights may typically be off, across each of two axes."""
STRENGTHS = (0.0, 0.5, 1.0, 2.0, 4.0)
"""And their strengths by so many times as much, as a share of them."""
HELD = 1.07
"""This many times the root of mean squares holds 68 % of two-dimensional Gaussian errors."""


def turned_by_rig_deg(points: SubjectPoints, normals: Doubles, rig: OtherRig) -> Doubles:
    """Return by how many degrees such lights as the points show turn their ``normals``, unit vectors (point, 3): what
    holds 68 % of the errors, (point,)."""
    along, numbers = _along(points), len(rig.told)
    logs, squares = [], []
    for off in OFF:
        for times in STRENGTHS:
            before = off**2 * (times**2 * along + np.eye(numbers) - along)
            shown = np.eye(numbers) + rig.surely @ before
            after = before @ np.linalg.inv(shown)
            mean = after @ rig.told
            logs.append(0.5 * float(rig.told @ mean) - 0.5 * float(np.linalg.slogdet(shown)[1]))
            squares.append(after + np.outer(mean, mean))
    likely = np.exp(np.array(logs) - max(logs))
    turned = 0.5 * np.log(np.maximum(_squares_turned(points, normals, np.array(squares)), 1e-12))
    return np.asarray(np.degrees(HELD * np.exp(turned @ likely / likely.sum())))


def _along(points: SubjectPoints) -> Doubles:
    """Return the matrix (3 light, 3 light) that keeps of lights' changes what is their strengths'."""
    lights = len(points.towards)
    along = np.zeros((lights, 3, lights, 3))
    mean = points.towards.mean(axis=1)
    for light, way in enumerate(mean / np.linalg.norm(mean, axis=1, keepdims=True)):
        along[light, :, light] = np.outer(way, way)
    return along.reshape(3 * lights, 3 * lights)


def _squares_turned(points: SubjectPoints, normals: Doubles, squares: Doubles) -> Doubles:
    """Return the mean squares by which lights' changes, of these mean ``squares`` (case, 3 light, 3 light), turn
    normals, radians, (point, case)."""
    towards = (points.towards * points.counts[..., None]).transpose(1, 0, 2)
    solving = np.linalg.pinv(towards)
    across = solving - normals[:, :, None] * (normals[:, None] @ solving)
    turns = (across[..., None] * normals[:, None, None, :]).reshape(len(normals), 3, -1)
    of_each = (turns.transpose(0, 2, 1) @ turns).reshape(len(normals), -1)
    return np.asarray(of_each @ squares.reshape(len(squares), -1).T)
