"""The fused least-squares kernel: from raw samples to stored normals in one pass over memory.

Plain loops over contiguous planes (``blocks.py``), which the compiler turns into vectors.

Symbols: m = L g per pixel, with the measurements m, L = intensity * direction (light, 3) and g = albedo * normal.

For distant lights the matrix is one for all pixels, for near ones each pixel of a block has its own: the same loops are
compiled for both.
"""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import lent
from psvideo.compute.symmetric import adjugate
from psvideo.compute.whole_stores import unmasked
from psvideo.model.arrays import Floats
from psvideo.solve.normals.least_squares.grey_kernel import solve_grey
from psvideo.solve.normals.loops.blocks import (
    ABSENT,
    BLOCK,
    COUNT,
    LIMIT,
    MISSING,
    ONE,
    SUM,
    THREE,
    TINY,
    XX,
    XY,
    XZ,
    YY,
    YZ,
    ZERO,
    ZZ,
    X,
    Y,
    Z,
)
from psvideo.solve.normals.loops.colour_kernel import solve_colours
from psvideo.solve.normals.loops.measuring import (
    all_seen,
    any_asked,
    combine,
    gather_one,
    gather_three,
    hide_unseen,
    mark_three,
)
from psvideo.solve.normals.loops.near_kernel import at, lent_task, of_light, place_lights
from psvideo.solve.normals.loops.storing import store_block
from psvideo.solve.normals.result import Result
from psvideo.solve.normals.task import Task, Work

COLOUR_STEP = 160  # pixels of three channels that are solved together: few enough to stay in the nearest cache


@FUSED.kept
def solve_rows(task: Task, result: Result, work: Work, first: int, last: int) -> None:
    """Solve the rows from ``first`` up to ``last``; no two calls may share rows, and any number may run at once."""
    t = lent_task(task, work.matrix, work.per_strength)
    out = Result(lent(result.normals), lent(result.albedo), lent(result.valid), lent(result.residual))
    w, values, m = lent(work.planes), lent(work.values), lent(work.measurements)
    step = BLOCK if t.tone.shape[1] == 1 else COLOUR_STEP
    for row in range(first, last):
        for col in range(0, t.cols, step):
            n = min(step, t.cols - col)
            summed = False
            if t.mask.size and not any_asked(t.mask, row, col, n):
                w[X : X + n], w[Y : Y + n], w[Z : Z + n] = ZERO, ZERO, ZERO
            else:
                summed = _solve_block(t, w, values, m, row, col, n, out.residual.size > 0)
            store_block(t, out, w, values, m, m, row * t.cols + col, n, summed, False)


@FUSED.inlined
def _solve_block(
    task: Task, w: Floats, values: Floats, m: Floats, row: int, col: int, n: int, keep_measurements: bool
) -> bool:
    """Leave g in the planes X, Y, Z, all 0 where the pixel has no solution to be trusted.

    Returned is whether three channels' sums are left as well (``colour_kernel.py``).
    """
    start, channels = row * task.cols + col, task.tone.shape[1]
    place_lights(task.matrix, task.per_strength, task.near, row, col, n)
    plain = task.near.depth.size == 0 and all_seen(task.seen, row, col, n)
    summed = plain and channels == 3 and solve_colours(task, w, values, m, start, n)
    done = summed or (plain and channels == 1 and solve_grey(task, w, start, n))
    if not done or (keep_measurements and not summed):
        if channels == 1:
            gather_one(task, values, start, n)
        elif plain:
            mark_three(task, values, n)
        else:
            gather_three(task, values, start, n)
        hide_unseen(task, values, row, col, n)
        if channels > 1:
            combine(task, w, values, m, n)
    if not done:
        _solve_usable(task, w, m, n)
    if task.mask.size:
        for i in range(n):
            kept = ONE if task.mask[row, col + i] else ZERO
            w[X + i], w[Y + i], w[Z + i] = w[X + i] * kept, w[Y + i] * kept, w[Z + i] * kept
    return summed


@FUSED.inlined
def _solve_usable(task: Task, w: Floats, m: Floats, n: int) -> None:
    """Solve every pixel from its own usable measurements; those in shadow become MISSING too."""
    w[SUM : SUM + n], w[COUNT : COUNT + n] = ZERO, ZERO
    for light in range(task.lights):
        plane, per = m[light], task.per_strength[light]
        for i in range(n):
            w[SUM + i] += plane[i] * at(per, i) if plane[i] > ABSENT else ZERO
            w[COUNT + i] += ONE if plane[i] > ABSENT else ZERO
    ratio = task.ratio
    for i in range(n):
        w[LIMIT + i] = ratio * w[SUM + i] / (w[COUNT + i] + TINY)
    _add_equations(task, w, n, m[0], m[1], m[2], 0, False)
    for k in range(3, m.shape[0], 3):
        _add_equations(task, w, n, m[k], m[k + 1], m[k + 2], k, True)
    _solve_normal_equations(w, n, task.condition_squared)


@FUSED.inlined
def _add_equations(task: Task, w: Floats, n: int, a: Floats, b: Floats, c: Floats, k: int, begun: bool) -> None:
    """Add three lights, from light k, to the normal equations of every pixel where they are usable."""
    light_a, per_a, dark_a = of_light(task.matrix, k), task.per_strength[k], task.dark[k]
    light_b, per_b, dark_b = of_light(task.matrix, k + 1), task.per_strength[k + 1], task.dark[k + 1]
    light_c, per_c, dark_c = of_light(task.matrix, k + 2), task.per_strength[k + 2], task.dark[k + 2]
    for i in range(n):
        (xa, ya, za), (xb, yb, zb), (xc, yc, zc) = at(light_a, i), at(light_b, i), at(light_c, i)
        p, q, r, limit = a[i], b[i], c[i], w[LIMIT + i]
        one_p = ONE if (p > dark_a) & (p * at(per_a, i) > limit) else ZERO
        one_q = ONE if (q > dark_b) & (q * at(per_b, i) > limit) else ZERO
        one_r = ONE if (r > dark_c) & (r * at(per_c, i) > limit) else ZERO
        a[i] = unmasked(p) if one_p > ZERO else MISSING
        b[i] = unmasked(q) if one_q > ZERO else MISSING
        c[i] = unmasked(r) if one_r > ZERO else MISSING
        p, q, r = p * one_p, q * one_q, r * one_r
        x, y, z = xa * p + xb * q + xc * r, ya * p + yb * q + yc * r, za * p + zb * q + zc * r
        w[X + i] = w[X + i] + x if begun else x
        w[Y + i] = w[Y + i] + y if begun else y
        w[Z + i] = w[Z + i] + z if begun else z
        count = one_p + one_q + one_r
        w[COUNT + i] = w[COUNT + i] + count if begun else count
        xx = xa * xa * one_p + xb * xb * one_q + xc * xc * one_r
        xy = xa * ya * one_p + xb * yb * one_q + xc * yc * one_r
        xz = xa * za * one_p + xb * zb * one_q + xc * zc * one_r
        yy = ya * ya * one_p + yb * yb * one_q + yc * yc * one_r
        yz = ya * za * one_p + yb * zb * one_q + yc * zc * one_r
        zz = za * za * one_p + zb * zb * one_q + zc * zc * one_r
        w[XX + i] = w[XX + i] + xx if begun else xx
        w[XY + i] = w[XY + i] + xy if begun else xy
        w[XZ + i] = w[XZ + i] + xz if begun else xz
        w[YY + i] = w[YY + i] + yy if begun else yy
        w[YZ + i] = w[YZ + i] + yz if begun else yz
        w[ZZ + i] = w[ZZ + i] + zz if begun else zz


@FUSED.inlined
def _solve_normal_equations(w: Floats, n: int, condition_squared: np.float32) -> None:
    """g = adj(A) b / det(A), or 0 where A is badly conditioned or of fewer than three lights."""
    for i in range(n):
        a, b, c, d, e, f = w[XX + i], w[XY + i], w[XZ + i], w[YY + i], w[YZ + i], w[ZZ + i]
        xx, xy, xz, yy, yz, zz, determinant = adjugate(a, b, c, d, e, f)
        x = xx * w[X + i] + xy * w[Y + i] + xz * w[Z + i]
        y = xy * w[X + i] + yy * w[Y + i] + yz * w[Z + i]
        z = xz * w[X + i] + yz * w[Y + i] + zz * w[Z + i]
        sound = (a + d + f) * (xx + yy + zz) <= condition_squared * determinant
        trusted = sound & (determinant > ZERO) & (w[COUNT + i] >= THREE)  # the latter as roundings may seem sound
        scale = ONE / determinant if trusted else ZERO
        w[X + i], w[Y + i], w[Z + i] = x * scale, y * scale, z * scale
