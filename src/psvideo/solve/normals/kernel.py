"""The fused least-squares kernel: from raw samples to stored normals in one pass over memory.

Plain loops over contiguous planes (``blocks.py``), which the compiler turns into vectors.

Symbols: m = L g per pixel, with the measurements m, L = intensity * direction (light, 3) and g = albedo * normal.

For distant lights the matrix is one for all pixels, for near ones each pixel of a block has its own: the same loops are
compiled for both.
"""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import encoded, lent
from psvideo.compute.symmetric import adjugate
from psvideo.solve.normals.blocks import (
    ABSENT,
    ALBEDO,
    BLOCK,
    COUNT,
    LEAST_Z,
    LIMIT,
    MISSING,
    ONE,
    PLANES,
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
from psvideo.solve.normals.colour_kernel import albedo_from_sums, gather_all, residuals_of_all, solve_all
from psvideo.solve.normals.grey_kernel import solve_grey
from psvideo.solve.normals.measuring import all_seen, any_asked, combine, gather_one, gather_three, hide_unseen
from psvideo.solve.normals.near_kernel import at, of_light, place_lights
from psvideo.solve.normals.task import Bytes, Floats, Near, Result, Samples, Task, Work

COLOUR_STEP = 160  # pixels of three channels that are solved together: few enough to stay in the nearest cache


def working_memory(task: Task) -> Work:
    """What one call of ``solve_rows`` works in; no two calls at a time may share it."""
    lights, channels = task.tone.shape[:2]
    values = np.full((lights * channels, BLOCK), MISSING, np.float32)
    combined = values if channels == 1 else np.full((lights, BLOCK), MISSING, np.float32)
    is_near = task.near.depth.size > 0
    return Work(
        planes=np.empty(PLANES * BLOCK, np.float32),
        values=values,
        measurements=combined,
        matrix=np.zeros((lights, 3, BLOCK), np.float32) if is_near else task.matrix,
        per_strength=np.zeros((lights, BLOCK), np.float32) if is_near else task.per_strength,
    )


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
            store_block(t, out, w, values, m, row * t.cols + col, n, summed)


@FUSED.inlined
def lent_task(task: Task, matrix: Floats, per_strength: Floats) -> Task:
    """The task without reference counts, with the memory that takes every pixel's lights where they are near."""
    near = task.near
    return Task(
        lent(task.plates), lent(task.like), task.lights, task.cols, lent(task.tone), lent(matrix), lent(per_strength),
        Near(
            lent(near.positions), lent(near.is_near), lent(near.axes), lent(near.anisotropy), lent(near.strengths),
            lent(near.depth), lent(near.pinhole),
        ),
        lent(task.inverse), lent(task.origin), task.least, task.most, task.dark,
        task.ratio, task.condition_squared, task.albedo_scale, lent(task.seen), lent(task.mask),
    )  # fmt: skip


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


@FUSED.called
def solve_colours(task: Task, w: Floats, values: Floats, m: Floats, start: int, n: int) -> bool:
    """Solve a block of three channels as if all measurements were usable; False where one is not."""
    return gather_all(task, w, values, start, n) and solve_all(task, w, values, m, n)


@FUSED.inlined
def _solve_usable(task: Task, w: Floats, m: Floats, n: int) -> None:
    """Solve every pixel from its own usable measurements; those in shadow become MISSING too."""
    w[SUM : SUM + n], w[COUNT : COUNT + n] = ZERO, ZERO
    for light in range(task.lights):
        plane, per = m[light], task.per_strength[light]
        for i in range(n):
            w[SUM + i] += plane[i] * at(per, i) if plane[i] > ABSENT else ZERO
            w[COUNT + i] += ONE if plane[i] > ABSENT else ZERO
    dark, ratio = task.dark, task.ratio
    for i in range(n):
        w[LIMIT + i] = max(dark, ratio * w[SUM + i] / (w[COUNT + i] + TINY))
    _add_equations(w, n, m[0], m[1], m[2], task.matrix, task.per_strength, 0, False)
    for k in range(3, m.shape[0], 3):
        _add_equations(w, n, m[k], m[k + 1], m[k + 2], task.matrix, task.per_strength, k, True)
    _solve_normal_equations(w, n, task.condition_squared)


@FUSED.inlined
def _add_equations(
    w: Floats, n: int, a: Floats, b: Floats, c: Floats, matrix: Floats, per_strength: Floats, k: int, begun: bool
) -> None:
    """Add three lights, from light k, to the normal equations of every pixel where they are usable."""
    light_a, per_a = of_light(matrix, k), per_strength[k]
    light_b, per_b = of_light(matrix, k + 1), per_strength[k + 1]
    light_c, per_c = of_light(matrix, k + 2), per_strength[k + 2]
    for i in range(n):
        (xa, ya, za), (xb, yb, zb), (xc, yc, zc) = at(light_a, i), at(light_b, i), at(light_c, i)
        p, q, r, limit = a[i], b[i], c[i], w[LIMIT + i]
        one_p = ONE if p * at(per_a, i) > limit else ZERO
        one_q = ONE if q * at(per_b, i) > limit else ZERO
        one_r = ONE if r * at(per_c, i) > limit else ZERO
        a[i] = p if one_p > ZERO else MISSING
        b[i] = q if one_q > ZERO else MISSING
        c[i] = r if one_r > ZERO else MISSING
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


@FUSED.called
def store_block(
    task: Task, result: Result, w: Floats, values: Floats, m: Floats, start: int, n: int, summed: bool
) -> None:
    """From g to what is stored; ``summed``: all measurements count, and three channels' sums are there."""
    end = start + n
    x, y, z = result.normals[0, start:end], result.normals[1, start:end], result.normals[2, start:end]
    _store_normals(w, n, x, y, z, result.albedo[0, start:end], result.valid[start:end], task.albedo_scale)
    if result.residual.size:
        w[XX : XX + n], w[XY : XY + n] = ZERO, ZERO
    for channel in range(task.tone.shape[1]):
        if summed:
            break
        if task.tone.shape[1] > 1:
            _albedo_given_normal(task, w, values, m, channel, n, result.albedo[channel, start:end])
        if result.residual.size:
            _add_residual(task, w, values, m, channel, n)
    if summed:
        red, green, blue = result.albedo[0, start:end], result.albedo[1, start:end], result.albedo[2, start:end]
        albedo_from_sums(task, w, n, red, green, blue)
    residual = result.residual[start:end]
    if summed and result.residual.size:
        residuals_of_all(task, w, values, n)
    for i in range(len(residual)):
        error = np.sqrt(w[XX + i] / max(w[XY + i], ONE))
        residual[i] = encoded(error if abs(w[X + i]) + abs(w[Y + i]) + abs(w[Z + i]) > ZERO else ZERO, residual)


@FUSED.inlined
def _store_normals(
    w: Floats, n: int, x: Samples, y: Samples, z: Samples, albedo: Samples, valid: Bytes, albedo_scale: np.float32
) -> None:
    """From g to the stored normal, albedo and validity, and to the planes X, Y, Z: all 0 where it faces away."""
    for i in range(n):
        gx, gy, gz = w[X + i], w[Y + i], w[Z + i]
        square = gx * gx + gy * gy + gz * gz
        length = np.sqrt(square)
        trusted = gz > LEAST_Z * length
        scale = ONE / length if trusted else ZERO
        size = square * scale if trusted else ZERO
        gx, gy, gz = gx * scale, gy * scale, gz * scale
        w[X + i], w[Y + i], w[Z + i], w[ALBEDO + i] = gx, gy, gz, size
        x[i] = encoded(gx, x)
        y[i] = encoded(gy, y)
        z[i] = encoded(gz, z)
        albedo[i] = encoded(size * albedo_scale, albedo)
        valid[i] = trusted


@FUSED.inlined
def _albedo_given_normal(task: Task, w: Floats, values: Floats, m: Floats, channel: int, n: int, out: Samples) -> None:
    """One channel's least squares albedo over the usable measurements, the normal being known."""
    w[SUM : SUM + n], w[COUNT : COUNT + n] = ZERO, ZERO
    for light in range(task.lights):
        lamp = of_light(task.matrix, light)
        plane = values[light * task.tone.shape[1] + channel]
        for i in range(n):
            x, y, z = at(lamp, i)
            here = m[light, i] > ABSENT
            shade = x * w[X + i] + y * w[Y + i] + z * w[Z + i]
            shade = shade if here else ZERO
            w[SUM + i] += shade * plane[i] if here else ZERO
            w[COUNT + i] += shade * shade
    scale = task.albedo_scale
    for i in range(n):
        albedo = w[SUM + i] / w[COUNT + i] if w[COUNT + i] > ZERO else ZERO
        w[ALBEDO + i] = max(albedo, ZERO)
        out[i] = encoded(max(albedo, ZERO) * scale, out)


@FUSED.inlined
def _add_residual(task: Task, w: Floats, values: Floats, m: Floats, channel: int, n: int) -> None:
    """Add one channel's squared residuals in plate units to the plane XX, and their count to XY."""
    for light in range(task.lights):
        lamp = of_light(task.matrix, light)
        plane, to_plate = values[light * task.tone.shape[1] + channel], task.tone[light, channel, 3]
        for i in range(n):
            x, y, z = at(lamp, i)
            here = m[light, i] > ABSENT
            shade = x * w[X + i] + y * w[Y + i] + z * w[Z + i]
            error = (plane[i] - w[ALBEDO + i] * shade) * to_plate
            w[XX + i] += error * error if here else ZERO
            w[XY + i] += ONE if here else ZERO
