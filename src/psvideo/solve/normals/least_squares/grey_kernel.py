"""Compiled part of least squares: pixels of one channel all of whose measurements are usable, under distant lights.

One pseudo-inverse holds for all of them, and is applied to the samples as they are read.
"""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.compute.whole_stores import unmasked
from psvideo.model.arrays import Floats, Samples
from psvideo.solve.normals.loops.blocks import HIGH, LOW, MISSING, SLIGHTLY_MORE, X, Y, Z
from psvideo.solve.normals.loops.measuring import samples_of
from psvideo.solve.normals.task import Task


@FUSED.inlined
def solve_grey(task: Task, w: Floats, start: int, n: int) -> bool:
    """Solve a block of one channel as if all measurements were usable; False where one is not, or hardly is.

    The test is stricter than the rule for single pixels: every measurement is taken as if its light were the strongest
    or the weakest, and the shadow limit follows the largest instead of the mean. Who fails it is solved by the rule.
    """
    for k in range(0, len(task.plates), 3):
        a, b, c = samples_of(task, k, start, n), samples_of(task, k + 1, start, n), samples_of(task, k + 2, start, n)
        if k == 0:
            _add_three(w, n, a, b, c, task.inverse, 0, False)
        else:
            _add_three(w, n, a, b, c, task.inverse, k, True)
    (origin_x, origin_y, origin_z), (gain, offset, ceiling, _) = task.origin, task.tone[0, 0]
    dark, least, most = task.dark[0], task.least, task.ratio * task.most
    for light in range(1, task.lights):
        dark = max(dark, task.dark[light])
    dark *= SLIGHTLY_MORE
    unusable = np.int32(0)  # as wide as the samples: twice as many fit into a vector
    for i in range(n):
        x, y, z = w[X + i] + origin_x, w[Y + i] + origin_y, w[Z + i] + origin_z
        w[X + i], w[Y + i], w[Z + i] = x, y, z
        low, high = w[LOW + i] * gain + offset, w[HIGH + i] * gain + offset
        in_shadow = (low <= dark) | (low * least <= high * most * SLIGHTLY_MORE)
        unusable = np.int32(unusable | in_shadow | (high >= ceiling) | (not x + y + z < -MISSING))
    return bool(unusable == 0)


@FUSED.inlined
def _add_three(w: Floats, n: int, a: Samples, b: Samples, c: Samples, inverse: Floats, k: int, begun: bool) -> None:
    """Add three lights' samples, from light k, to g; beside it the lowest and the highest sample."""
    (xp, yp, zp), (xq, yq, zq), (xr, yr, zr) = inverse[k], inverse[k + 1], inverse[k + 2]
    for i in range(n):
        low, high = np.float32(min(a[i], min(b[i], c[i]))), np.float32(max(a[i], max(b[i], c[i])))
        p, q, r = np.float32(a[i]), np.float32(b[i]), np.float32(c[i])
        x = xp * p + xq * q + xr * r
        y = yp * p + yq * q + yr * r
        z = zp * p + zq * q + zr * r
        w[X + i] = w[X + i] + x if begun else x
        w[Y + i] = w[Y + i] + y if begun else y
        w[Z + i] = w[Z + i] + z if begun else z
        w[LOW + i] = min(unmasked(w[LOW + i]), low) if begun else low
        w[HIGH + i] = max(unmasked(w[HIGH + i]), high) if begun else high
