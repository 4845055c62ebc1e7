"""The fused least-squares kernel: from raw samples to stored normals in one pass over memory.

Plain loops over contiguous planes, which the compiler turns into vectors. A block's planes lie one after another in one
flat working array ``w``, BLOCK apart, so that the compiler sees that they do not overlap. A measurement that is
saturated, not a number or unseen becomes MISSING, far below every threshold.

Symbols: m = L g per pixel, with the measurements m, L = intensity * direction (light, 3) and g = albedo * normal.

All loops are in this one file because numba's cache notices a change only in the file of the function that is called.
"""

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from psvideo.normals.compiled import compiled, encoded, pointer

Floats = NDArray[np.float32]
Bytes = NDArray[np.uint8]
Samples = NDArray[np.float32] | NDArray[np.uint16]

BLOCK = 1024
MISSING = np.float32(-1e30)
ABSENT = np.float32(-1e29)  # what is below this is MISSING
ZERO, ONE, THREE, BIG = np.float32(0), np.float32(1), np.float32(3), np.float32(1e30)

# The planes of the working array: the solution, then what deciding on the measurements needs.
X, Y, Z, ALBEDO, TRUSTED, LIMIT, LOW, LOW_SHARE, SUM, COUNT = (BLOCK * plane for plane in range(10))
XX, XY, XZ, YY, YZ, ZZ = (BLOCK * plane for plane in range(10, 16))
PLANES = 16


class Task(NamedTuple):
    """What to solve. A plate's samples lie in memory pixel by pixel, channels side by side."""

    plates: NDArray[np.intp]  # (light,) addresses of the plates' first samples
    like: Samples  # any array of the samples' type
    cols: int
    tone: Floats  # (light, channel, 4): gain, offset and ceiling of the samples; factor from measurement to plate
    matrix: Floats  # (light, 3): L, one for all channels
    inverse: Floats  # (light, 3): its transposed pseudo-inverse
    per_strength: Floats  # (light,): 1 / intensity
    dark: np.float32  # a measurement must be above this,
    ratio: np.float32  # and in shares of the intensities above this times the pixel's mean
    condition_squared: np.float32  # largest trace(A) * trace(A^-1) of the usable lights' normal equations
    albedo_scale: np.float32
    seen: Bytes  # (light, row, col or 1), or empty
    mask: Bytes  # (row, col), or empty


class Result(NamedTuple):
    """Where the solution goes: planes of float32, or of half floats as the bits of uint16."""

    normals: Samples  # (3, pixel)
    albedo: Samples  # (channel, pixel)
    valid: Bytes  # (pixel,)
    residual: Samples  # (pixel,), or empty


@compiled
def solve_rows(task: Task, result: Result, first: int, last: int) -> None:
    """Solve the rows from ``first`` up to ``last``; no two calls may share rows, and any number may run at once."""
    lights, channels = task.tone.shape[:2]
    w = np.empty(PLANES * BLOCK, np.float32)
    values = np.empty((lights * channels, BLOCK), np.float32)
    m = values if channels == 1 else np.empty((lights, BLOCK), np.float32)
    for row in range(first, last):
        for col in range(0, task.cols, BLOCK):
            n = min(BLOCK, task.cols - col)
            if task.mask.size and not task.mask[row, col : col + n].any():
                w[TRUSTED : TRUSTED + n] = ZERO
            else:
                _solve_block(task, w, values, m, row, col, n, result.residual.size > 0)
            _store_block(task, result, w, values, m, row * task.cols + col, n)


@compiled
def _solve_block(
    task: Task, w: Floats, values: Floats, m: Floats, row: int, col: int, n: int, keep_measurements: bool
) -> None:
    start, channels = row * task.cols + col, task.tone.shape[1]
    done = channels == 1 and _all_seen(task.seen, row, col, n) and _solve_all_usable(task, w, start, n)
    if not done or keep_measurements:
        _gather(task, values, start, n)
        if channels > 1:
            _combine(w, values, m, n)
    if not done:
        _hide_unseen(task.seen, m, row, col, n)
        _solve_usable(task, w, m, n)
    if task.mask.size:
        for i in range(n):
            w[TRUSTED + i] *= ONE if task.mask[row, col + i] else ZERO


@compiled
def _plate(task: Task, light: int, start: int, n: int) -> Samples:
    """The samples of n pixels of one light's plate."""
    channels = task.tone.shape[1]
    end = (start + n) * channels
    plate: Samples = numba.carray(pointer(task.plates[light], task.like), end)
    return plate[start * channels : end]


@compiled
def _solve_all_usable(task: Task, w: Floats, start: int, n: int) -> bool:
    """Solve a block of one channel as if all measurements were usable; False where one is not after all."""
    lights = task.matrix.shape[0]
    light = 0
    while light + 3 <= lights:
        a, b, c = (_plate(task, light, start, n), _plate(task, light + 1, start, n), _plate(task, light + 2, start, n))
        _add_three(w, n, a, b, c, task.inverse, task.tone, task.per_strength, light)
        light += 3
    while light < lights:
        _add_one(w, n, _plate(task, light, start, n), task.inverse, task.tone, task.per_strength, light)
        light += 1
    share = task.ratio / np.float32(lights)
    unusable = 0
    for i in range(n):
        unusable += (w[LOW + i] <= task.dark) | (w[LOW_SHARE + i] <= share * w[SUM + i])
    if unusable > 0:
        return False
    for i in range(n):
        x, y, z = w[X + i], w[Y + i], w[Z + i]
        square = x * x + y * y + z * z
        trusted = z > ZERO
        scale = ONE / np.sqrt(square) if trusted else ZERO
        w[X + i], w[Y + i], w[Z + i] = x * scale, y * scale, z * scale
        w[ALBEDO + i] = square * scale
        w[TRUSTED + i] = ONE if trusted else ZERO
    return True


@compiled
def _add_three(
    w: Floats,
    n: int,
    a: Samples,
    b: Samples,
    c: Samples,
    inverse: Floats,
    tone: Floats,
    per_strength: Floats,
    k: int,
) -> None:
    """Add three lights, from light k, to g; beside it the lowest measurement, and lowest and sum as shares."""
    begun = k > 0
    for i in range(n):
        p = np.float32(a[i]) * tone[k, 0, 0] + tone[k, 0, 1]
        q = np.float32(b[i]) * tone[k + 1, 0, 0] + tone[k + 1, 0, 1]
        r = np.float32(c[i]) * tone[k + 2, 0, 0] + tone[k + 2, 0, 1]
        p = p if p < tone[k, 0, 2] else MISSING
        q = q if q < tone[k + 1, 0, 2] else MISSING
        r = r if r < tone[k + 2, 0, 2] else MISSING
        x = inverse[k, 0] * p + inverse[k + 1, 0] * q + inverse[k + 2, 0] * r
        y = inverse[k, 1] * p + inverse[k + 1, 1] * q + inverse[k + 2, 1] * r
        z = inverse[k, 2] * p + inverse[k + 1, 2] * q + inverse[k + 2, 2] * r
        w[X + i] = w[X + i] + x if begun else x
        w[Y + i] = w[Y + i] + y if begun else y
        w[Z + i] = w[Z + i] + z if begun else z
        low = min(p, min(q, r))
        w[LOW + i] = min(w[LOW + i], low) if begun else low
        p, q, r = p * per_strength[k], q * per_strength[k + 1], r * per_strength[k + 2]
        low = min(p, min(q, r))
        w[LOW_SHARE + i] = min(w[LOW_SHARE + i], low) if begun else low
        w[SUM + i] = w[SUM + i] + (p + q + r) if begun else p + q + r


@compiled
def _add_one(w: Floats, n: int, a: Samples, inverse: Floats, tone: Floats, per_strength: Floats, k: int) -> None:
    """Go on with one light, number k."""
    for i in range(n):
        p = np.float32(a[i]) * tone[k, 0, 0] + tone[k, 0, 1]
        p = p if p < tone[k, 0, 2] else MISSING
        w[X + i] += inverse[k, 0] * p
        w[Y + i] += inverse[k, 1] * p
        w[Z + i] += inverse[k, 2] * p
        w[LOW + i] = min(w[LOW + i], p)
        p = p * per_strength[k]
        w[LOW_SHARE + i] = min(w[LOW_SHARE + i], p)
        w[SUM + i] += p


@compiled
def _gather(task: Task, values: Floats, start: int, n: int) -> None:
    """Raw samples to measurements, a plane per light and channel."""
    lights, channels = task.tone.shape[:2]
    for light in range(lights):
        samples = _plate(task, light, start, n)
        for channel in range(channels):
            gain, offset, ceiling, _ = task.tone[light, channel]
            plane = values[light * channels + channel]
            for i in range(n):
                value = np.float32(samples[i * channels + channel]) * gain + offset
                plane[i] = value if value < ceiling else MISSING


@compiled
def _combine(w: Floats, values: Floats, m: Floats, n: int) -> None:
    """One measurement per light from three channels, each weighted by its own brightness over the lights.

    That is the matched filter for noise alike in all channels: a channel in which the surface is black adds nothing.
    """
    for plane in (XX, YY, ZZ):
        w[plane : plane + n] = ZERO
    for light in range(m.shape[0]):
        red, green, blue = values[3 * light], values[3 * light + 1], values[3 * light + 2]
        for i in range(n):
            here = min(red[i], min(green[i], blue[i])) > ABSENT
            w[XX + i] += max(red[i], ZERO) if here else ZERO
            w[YY + i] += max(green[i], ZERO) if here else ZERO
            w[ZZ + i] += max(blue[i], ZERO) if here else ZERO
    for i in range(n):
        total = w[XX + i] + w[YY + i] + w[ZZ + i]
        scale = ONE / total if total > ZERO else ZERO
        w[XX + i], w[YY + i], w[ZZ + i] = w[XX + i] * scale, w[YY + i] * scale, w[ZZ + i] * scale
    for light in range(m.shape[0]):
        red, green, blue = values[3 * light], values[3 * light + 1], values[3 * light + 2]
        for i in range(n):
            here = min(red[i], min(green[i], blue[i])) > ABSENT
            value = w[XX + i] * red[i] + w[YY + i] * green[i] + w[ZZ + i] * blue[i]
            m[light, i] = value if here else MISSING


@compiled
def _all_seen(seen: Bytes, row: int, col: int, n: int) -> bool:
    if not seen.size:
        return True
    if seen.shape[2] == 1:
        return seen[:, row, 0].all()
    return seen[:, row, col : col + n].all()


@compiled
def _hide_unseen(seen: Bytes, m: Floats, row: int, col: int, n: int) -> None:
    for light in range(seen.shape[0]):
        if seen.shape[2] == 1:
            if not seen[light, row, 0]:
                m[light, :n] = MISSING
        else:
            for i in range(n):
                m[light, i] = m[light, i] if seen[light, row, col + i] else MISSING


@compiled
def _solve_usable(task: Task, w: Floats, m: Floats, n: int) -> None:
    """Solve every pixel from its own usable measurements; those in shadow become MISSING too."""
    w[SUM : SUM + n] = ZERO
    w[COUNT : COUNT + n] = ZERO
    for light in range(m.shape[0]):
        for i in range(n):
            here = m[light, i] > ABSENT
            w[SUM + i] += m[light, i] * task.per_strength[light] if here else ZERO
            w[COUNT + i] += ONE if here else ZERO
    for i in range(n):
        w[LIMIT + i] = task.ratio * w[SUM + i] / max(w[COUNT + i], ONE)
    for plane in (X, Y, Z, COUNT, XX, XY, XZ, YY, YZ, ZZ):
        w[plane : plane + n] = ZERO
    for light in range(m.shape[0]):
        x, y, z = task.matrix[light]
        for i in range(n):
            v = m[light, i]
            usable = (v > ABSENT) & (v > task.dark) & (v * task.per_strength[light] > w[LIMIT + i])
            m[light, i] = v if usable else MISSING
            v = v if usable else ZERO
            one = ONE if usable else ZERO
            w[X + i] += x * v
            w[Y + i] += y * v
            w[Z + i] += z * v
            w[COUNT + i] += one
            w[XX + i] += one * (x * x)
            w[XY + i] += one * (x * y)
            w[XZ + i] += one * (x * z)
            w[YY + i] += one * (y * y)
            w[YZ + i] += one * (y * z)
            w[ZZ + i] += one * (z * z)
    _solve_normal_equations(w, n, task.condition_squared)


@compiled
def _solve_normal_equations(w: Floats, n: int, condition_squared: np.float32) -> None:
    """g = adj(A) b / det(A); trusted where three or more lights remain and A is well enough conditioned."""
    for i in range(n):
        a, b, c, d, e, f = w[XX + i], w[XY + i], w[XZ + i], w[YY + i], w[YZ + i], w[ZZ + i]
        xx, xy, xz = d * f - e * e, c * e - b * f, b * e - c * d
        yy, yz, zz = a * f - c * c, b * c - a * e, a * d - b * b
        determinant = a * xx + b * xy + c * xz
        x = xx * w[X + i] + xy * w[Y + i] + xz * w[Z + i]
        y = xy * w[X + i] + yy * w[Y + i] + yz * w[Z + i]
        z = xz * w[X + i] + yz * w[Y + i] + zz * w[Z + i]
        sound = (a + d + f) * (xx + yy + zz) <= condition_squared * determinant
        trusted = sound & (determinant > ZERO) & (w[COUNT + i] >= THREE) & (z > ZERO)
        square = x * x + y * y + z * z
        scale = ONE / np.sqrt(square) if trusted else ZERO
        w[X + i], w[Y + i], w[Z + i] = x * scale, y * scale, z * scale
        w[ALBEDO + i] = square * scale / determinant if trusted else ZERO
        w[TRUSTED + i] = ONE if trusted else ZERO


@compiled
def _store_block(task: Task, result: Result, w: Floats, values: Floats, m: Floats, start: int, n: int) -> None:
    end, channels = start + n, task.tone.shape[1]
    _store(w, n, X, ONE, result.normals[0, start:end])
    _store(w, n, Y, ONE, result.normals[1, start:end])
    _store(w, n, Z, ONE, result.normals[2, start:end])
    for i in range(n):
        result.valid[start + i] = w[TRUSTED + i] > ZERO
    if result.residual.size:
        w[XX : XX + n] = ZERO
        w[XY : XY + n] = ZERO
    for channel in range(channels):
        if channels > 1:
            _albedo_given_normal(task, w, values, m, channel, n)
        _store(w, n, ALBEDO, task.albedo_scale, result.albedo[channel, start:end])
        if result.residual.size:
            _add_residual(task, w, values, m, channel, n)
    if result.residual.size:
        for i in range(n):
            w[ALBEDO + i] = np.sqrt(w[XX + i] / max(w[XY + i], ONE))
        _store(w, n, ALBEDO, ONE, result.residual[start:end])


@compiled
def _albedo_given_normal(task: Task, w: Floats, values: Floats, m: Floats, channel: int, n: int) -> None:
    """One channel's least squares albedo over the usable measurements, the normal being known."""
    w[SUM : SUM + n] = ZERO
    w[COUNT : COUNT + n] = ZERO
    for light in range(m.shape[0]):
        x, y, z = task.matrix[light]
        for i in range(n):
            here = m[light, i] > ABSENT
            shade = x * w[X + i] + y * w[Y + i] + z * w[Z + i] if here else ZERO
            w[SUM + i] += shade * values[light * task.tone.shape[1] + channel, i] if here else ZERO
            w[COUNT + i] += shade * shade
    for i in range(n):
        w[ALBEDO + i] = max(w[SUM + i] / w[COUNT + i], ZERO) if w[COUNT + i] > ZERO else ZERO


@compiled
def _add_residual(task: Task, w: Floats, values: Floats, m: Floats, channel: int, n: int) -> None:
    """Add one channel's squared residuals in plate units to the plane XX, and their count to XY."""
    for light in range(m.shape[0]):
        x, y, z = task.matrix[light]
        to_plate = task.tone[light, channel, 3]
        for i in range(n):
            here = m[light, i] > ABSENT
            shade = x * w[X + i] + y * w[Y + i] + z * w[Z + i]
            error = (values[light * task.tone.shape[1] + channel, i] - w[ALBEDO + i] * shade) * to_plate
            w[XX + i] += error * error if here else ZERO
            w[XY + i] += ONE if here else ZERO


@compiled
def _store(w: Floats, n: int, plane: int, scale: np.float32, out: Samples) -> None:
    """Write one plane into the result, as float32 or as half floats; 0 where the pixel is not to be trusted."""
    for i in range(n):
        out[i] = encoded(w[plane + i] * scale if w[TRUSTED + i] > ZERO else ZERO, out)
