"""Compiled part of both solvers: pixels of three channels all of whose measurements are usable, under distant lights.

One matrix L holds for all of them, so that each channel's L^T m is added up as the samples are read; the normal and all
albedos follow from these three vectors, without looking at the lights again. With the channels' weights s_c
(``measuring.weigh_channels``), g = (L^T L)^-1 sum_c s_c L^T m_c; for a normal n a channel's albedo is
n . L^T m_c / n . L^T L n. Where a pixel lacks a measurement its whole block is solved by the general rule, to the same
result but for rounding.
"""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import encoded, flattened
from psvideo.compute.symmetric import adjugate
from psvideo.compute.whole_stores import unmasked
from psvideo.model.arrays import Floats, Samples
from psvideo.solve.normals.loops.blocks import (
    BLOCK,
    LOW,
    MISSING,
    ONE,
    SUM,
    SUMS,
    TINY,
    XX,
    YY,
    ZERO,
    ZZ,
    X,
    Y,
    Z,
)
from psvideo.solve.normals.loops.measuring import samples_of, weigh_channels
from psvideo.solve.normals.loops.near_kernel import at, of_light
from psvideo.solve.normals.task import Task

TWO = np.float32(2)
RX, RY, RZ, GX, GY, GZ, BX, BY, BZ = (SUMS + BLOCK * plane for plane in range(9))


@FUSED.called
def solve_colours(task: Task, w: Floats, values: Floats, m: Floats, start: int, n: int) -> bool:
    """Solve a block of three channels as if all measurements were usable; False where one is not."""
    return _gather_all(task, w, values, start, n) and _solve_all(task, w, values, m, n)


@FUSED.inlined
def _sent(task: Task, light: int) -> tuple[np.float32, np.float32, np.float32]:
    """What a distant light sends everywhere. (Compiled for near lights too, and never called then.)"""
    sent: tuple[np.float32, np.float32, np.float32] = at(of_light(task.matrix, light), 0)
    return sent


@FUSED.inlined
def _gather_all(task: Task, w: Floats, values: Floats, start: int, n: int) -> bool:
    """Read a block's samples, (light * channel, pixel), and add them up; False where one cannot be used.

    The planes XX, YY, ZZ become the channels' light, and RX to BZ their L^T m. ``values`` holds no mark of what is
    saturated then.
    """
    line = flattened(values)
    unusable = _add_two(task, w, line, start, n, 0, False)
    for light in range(2, task.lights - 1, 2):
        unusable |= _add_two(task, w, line, start, n, light, True)
    if task.lights % 2:
        unusable |= _add_one(task, w, line, start, n, task.lights - 1)
    return bool(unusable == 0)


@FUSED.inlined
def _add_two(task: Task, w: Floats, values: Floats, start: int, n: int, light: int, begun: bool) -> np.int32:
    """Two lights at a time, which halves the ways of the sums to memory and back; returns what cannot be used."""
    first, second = samples_of(task, light, start, n), samples_of(task, light + 1, start, n)
    (gain_r, add_r, top_r, _), (gain_g, add_g, top_g, _) = task.tone[light, 0], task.tone[light, 1]
    (gain_b, add_b, top_b, _), (gain_s, add_s, top_s, _) = task.tone[light, 2], task.tone[light + 1, 0]
    (gain_t, add_t, top_t, _), (gain_u, add_u, top_u, _) = task.tone[light + 1, 1], task.tone[light + 1, 2]
    (xa, ya, za), (xb, yb, zb) = _sent(task, light), _sent(task, light + 1)
    v = values[3 * BLOCK * light : 3 * BLOCK * (light + 2)]
    unusable = np.int32(0)
    for i in range(n):
        r, s = np.float32(first[3 * i]) * gain_r + add_r, np.float32(second[3 * i]) * gain_s + add_s
        g, t = np.float32(first[3 * i + 1]) * gain_g + add_g, np.float32(second[3 * i + 1]) * gain_t + add_t
        b, u = np.float32(first[3 * i + 2]) * gain_b + add_b, np.float32(second[3 * i + 2]) * gain_u + add_u
        v[i], v[BLOCK + i], v[2 * BLOCK + i] = r, g, b
        v[3 * BLOCK + i], v[4 * BLOCK + i], v[5 * BLOCK + i] = s, t, u
        unusable = np.int32(
            unusable | (r >= top_r) | (g >= top_g) | (b >= top_b) | (s >= top_s) | (t >= top_t) | (u >= top_u)
        )
        _begin_or_add(w, XX + i, max(r, ZERO) + max(s, ZERO), begun)
        _begin_or_add(w, YY + i, max(g, ZERO) + max(t, ZERO), begun)
        _begin_or_add(w, ZZ + i, max(b, ZERO) + max(u, ZERO), begun)
        _begin_or_add(w, RX + i, xa * r + xb * s, begun)
        _begin_or_add(w, RY + i, ya * r + yb * s, begun)
        _begin_or_add(w, RZ + i, za * r + zb * s, begun)
        _begin_or_add(w, GX + i, xa * g + xb * t, begun)
        _begin_or_add(w, GY + i, ya * g + yb * t, begun)
        _begin_or_add(w, GZ + i, za * g + zb * t, begun)
        _begin_or_add(w, BX + i, xa * b + xb * u, begun)
        _begin_or_add(w, BY + i, ya * b + yb * u, begun)
        _begin_or_add(w, BZ + i, za * b + zb * u, begun)
    return unusable


@FUSED.inlined
def _begin_or_add(w: Floats, at: int, value: np.float32, begun: bool) -> None:
    w[at] = w[at] + value if begun else value


@FUSED.inlined
def _add_one(task: Task, w: Floats, values: Floats, start: int, n: int, light: int) -> np.int32:
    """The last of an odd number of lights."""
    samples = samples_of(task, light, start, n)
    (gain_r, add_r, top_r, _), (gain_g, add_g, top_g, _) = task.tone[light, 0], task.tone[light, 1]
    gain_b, add_b, top_b, _ = task.tone[light, 2]
    x, y, z = _sent(task, light)
    v = values[3 * BLOCK * light : 3 * BLOCK * (light + 1)]
    unusable = np.int32(0)
    for i in range(n):
        r = np.float32(samples[3 * i]) * gain_r + add_r
        g = np.float32(samples[3 * i + 1]) * gain_g + add_g
        b = np.float32(samples[3 * i + 2]) * gain_b + add_b
        v[i], v[BLOCK + i], v[2 * BLOCK + i] = r, g, b
        unusable = np.int32(unusable | (r >= top_r) | (g >= top_g) | (b >= top_b))
        w[XX + i] += max(r, ZERO)
        w[YY + i] += max(g, ZERO)
        w[ZZ + i] += max(b, ZERO)
        w[RX + i], w[RY + i], w[RZ + i] = w[RX + i] + x * r, w[RY + i] + y * r, w[RZ + i] + z * r
        w[GX + i], w[GY + i], w[GZ + i] = w[GX + i] + x * g, w[GY + i] + y * g, w[GZ + i] + z * g
        w[BX + i], w[BY + i], w[BZ + i] = w[BX + i] + x * b, w[BY + i] + y * b, w[BZ + i] + z * b
    return unusable


@FUSED.inlined
def _solve_all(task: Task, w: Floats, values: Floats, measurements: Floats, n: int) -> bool:
    """Leave g in the planes X, Y, Z and the combined measurements in ``measurements``; False where one is in shadow."""
    line = flattened(values)
    weigh_channels(task, w, n)
    for i in range(n):
        w[SUM + i], w[LOW + i] = ZERO, -MISSING
    unusable = np.int32(0)
    for light in range(task.lights):
        per, v, m = at(task.per_strength[light], 0), line[3 * BLOCK * light :], measurements[light]
        dark = task.dark[light]
        for i in range(n):
            value = w[XX + i] * v[i] + w[YY + i] * v[BLOCK + i] + w[ZZ + i] * v[2 * BLOCK + i]
            m[i] = value
            unusable = np.int32(unusable | (value <= dark))
            w[SUM + i] += value * per
            w[LOW + i] = min(unmasked(w[LOW + i]), value * per)
    a, b, c, d, e, f, determinant = adjugate(*_squares(task))
    one = ONE / determinant
    a, b, c, d, e, f = a * one, b * one, c * one, d * one, e * one, f * one
    share = task.ratio / (np.float32(task.lights) + TINY)
    for i in range(n):
        red, green, blue = w[XX + i], w[YY + i], w[ZZ + i]
        p = red * w[RX + i] + green * w[GX + i] + blue * w[BX + i]
        q = red * w[RY + i] + green * w[GY + i] + blue * w[BY + i]
        r = red * w[RZ + i] + green * w[GZ + i] + blue * w[BZ + i]
        x, y, z = a * p + b * q + c * r, b * p + d * q + e * r, c * p + e * q + f * r
        w[X + i], w[Y + i], w[Z + i] = x, y, z
        unusable = np.int32(unusable | (w[LOW + i] <= share * w[SUM + i]) | (not x + y + z < -MISSING))
    return bool(unusable == 0)


@FUSED.inlined
def _squares(task: Task) -> tuple[np.float32, np.float32, np.float32, np.float32, np.float32, np.float32]:
    """The symmetric matrix L^T L: its first row, and what is below."""
    xx = xy = xz = yy = yz = zz = ZERO
    for light in range(task.lights):
        x, y, z = _sent(task, light)
        xx, xy, xz, yy, yz, zz = xx + x * x, xy + x * y, xz + x * z, yy + y * y, yz + y * z, zz + z * z
    return xx, xy, xz, yy, yz, zz


@FUSED.inlined
def albedo_from_sums(task: Task, w: Floats, n: int, red: Samples, green: Samples, blue: Samples) -> None:
    """Every channel's least squares albedo, the normal being known, of what ``_gather_all`` added up."""
    xx, xy, xz, yy, yz, zz = _squares(task)
    scale = task.albedo_scale
    for i in range(n):
        x, y, z = w[X + i], w[Y + i], w[Z + i]
        square = x * x * xx + y * y * yy + z * z * zz + TWO * (x * y * xy + x * z * xz + y * z * yz)
        one = ONE / square if square > ZERO else ZERO
        w[RX + i] = max((x * w[RX + i] + y * w[RY + i] + z * w[RZ + i]) * one, ZERO)
        w[GX + i] = max((x * w[GX + i] + y * w[GY + i] + z * w[GZ + i]) * one, ZERO)
        w[BX + i] = max((x * w[BX + i] + y * w[BY + i] + z * w[BZ + i]) * one, ZERO)
    for i in range(n):
        red[i] = encoded(w[RX + i] * scale, red)
        green[i] = encoded(w[GX + i] * scale, green)
        blue[i] = encoded(w[BX + i] * scale, blue)
