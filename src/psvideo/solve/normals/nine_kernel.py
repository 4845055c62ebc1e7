"""Compiled parts of the robust solver for rigs of up to nine distant lights: a pixel's measurements all in registers.

What ``equations.py`` and ``robust_kernel.py`` do for any number of lights, plane by plane in memory, is done here in
one straight line per pixel, with medians by a sorting network: most rigs have four to nine lights, and this takes half
the time. Rigs with fewer are filled up to nine with lights that are MISSING everywhere.
"""

from typing import Any

import numpy as np
from numba.extending import overload

from psvideo.compute.compiled import FUSED
from psvideo.solve.normals.equations import HALF, OUT, RIGHT_X, RIGHT_Y, RIGHT_Z, SCALE
from psvideo.solve.normals.kernel import ABSENT, BLOCK, COUNT, ONE, THREE, XX, XY, XZ, YY, YZ, ZERO, ZZ, X, Y, Z
from psvideo.solve.normals.near_kernel import of_light
from psvideo.solve.normals.task import Floats

Numbers = tuple[np.float32, ...]
NINE = 9
LITTLE = np.float32(0.02)  # the weight of what the start leaves out, so that no start is singular
FOUR, EIGHT = np.float32(4), np.float32(8)


@FUSED.inlined
def _in_order(a: np.float32, b: np.float32) -> tuple[np.float32, np.float32]:
    return (a if a < b else b), (b if a < b else a)


@FUSED.inlined
def _sorted_nine(values: Any) -> Any:
    """Nine numbers in rising order: the best network known for nine (25 exchanges; D. E. Knuth, TAOCP 3, 5.3.4)."""
    a, b, c, d, e, f, g, h, k = values
    a, d = _in_order(a, d)
    b, h = _in_order(b, h)
    c, f = _in_order(c, f)
    e, k = _in_order(e, k)
    a, h = _in_order(a, h)
    c, e = _in_order(c, e)
    d, k = _in_order(d, k)
    f, g = _in_order(f, g)
    a, c = _in_order(a, c)
    b, d = _in_order(b, d)
    e, f = _in_order(e, f)
    h, k = _in_order(h, k)
    b, e = _in_order(b, e)
    d, g = _in_order(d, g)
    f, h = _in_order(f, h)
    a, b = _in_order(a, b)
    c, e = _in_order(c, e)
    d, f = _in_order(d, f)
    g, k = _in_order(g, k)
    c, d = _in_order(c, d)
    e, f = _in_order(e, f)
    g, h = _in_order(g, h)
    b, c = _in_order(b, c)
    d, e = _in_order(d, e)
    f, g = _in_order(f, g)
    return a, b, c, d, e, f, g, h, k


@FUSED.inlined
def _ranked(ordered: Numbers, rank: np.float32) -> np.float32:
    """The rank-th smallest, from 1."""
    a, b, c, d, e, f, g, h, k = ordered
    value = a if rank < np.float32(1.5) else b
    value = c if rank > np.float32(2.5) else value
    value = d if rank > np.float32(3.5) else value
    value = e if rank > np.float32(4.5) else value
    value = f if rank > np.float32(5.5) else value
    value = g if rank > np.float32(6.5) else value
    value = h if rank > np.float32(7.5) else value
    return k if rank > np.float32(8.5) else value


@FUSED.inlined
def _middle_ranked(ordered: Numbers, rank: np.float32) -> np.float32:
    """The rank-th smallest, of ranks from 3 to 6, which is where the median of what is not fitted lies."""
    value = ordered[2] if rank < np.float32(3.5) else ordered[3]
    value = ordered[4] if rank > np.float32(4.5) else value
    return ordered[5] if rank > np.float32(5.5) else value


@FUSED.inlined
def _of_nine(planes: Floats, i: int) -> Any:
    return (
        planes[i], planes[BLOCK + i], planes[2 * BLOCK + i], planes[3 * BLOCK + i], planes[4 * BLOCK + i],
        planes[5 * BLOCK + i], planes[6 * BLOCK + i], planes[7 * BLOCK + i], planes[8 * BLOCK + i],
    )  # fmt: skip


@FUSED.inlined
def _of_lights(numbers: Floats) -> Any:
    return (
        numbers[0], numbers[1], numbers[2], numbers[3], numbers[4], numbers[5], numbers[6], numbers[7], numbers[8],
    )  # fmt: skip


@FUSED.inlined
def _lamps(matrix: Floats) -> Any:
    return (
        of_light(matrix, 0), of_light(matrix, 1), of_light(matrix, 2), of_light(matrix, 3), of_light(matrix, 4),
        of_light(matrix, 5), of_light(matrix, 6), of_light(matrix, 7), of_light(matrix, 8),
    )  # fmt: skip


@FUSED.inlined
def _begun(lamp: Any, weight: np.float32, m: np.float32) -> Any:
    """The normal equations of one light: the matrix's six numbers, then the right side's three."""
    x, y, z = lamp
    wx, wy, wm = weight * x, weight * y, weight * m
    return wx * x, wx * y, wx * z, wy * y, wy * z, weight * (z * z), wm * x, wm * y, wm * z


@FUSED.inlined
def _added(sums: Any, lamp: Any, weight: np.float32, m: np.float32) -> Any:
    a, b, c, d, e, f, p, q, r = sums
    x, y, z = lamp
    wx, wy, wm = weight * x, weight * y, weight * m
    return (
        a + wx * x, b + wx * y, c + wx * z, d + wy * y, e + wy * z, f + weight * (z * z),
        p + wm * x, q + wm * y, r + wm * z,
    )  # fmt: skip


@FUSED.inlined
def _store_equations(w: Floats, i: int, lamps: Any, weights: Any, m: Any) -> None:
    sums = _begun(lamps[0], weights[0], m[0])
    sums = _added(sums, lamps[1], weights[1], m[1])
    sums = _added(sums, lamps[2], weights[2], m[2])
    sums = _added(sums, lamps[3], weights[3], m[3])
    sums = _added(sums, lamps[4], weights[4], m[4])
    sums = _added(sums, lamps[5], weights[5], m[5])
    sums = _added(sums, lamps[6], weights[6], m[6])
    sums = _added(sums, lamps[7], weights[7], m[7])
    sums = _added(sums, lamps[8], weights[8], m[8])
    w[XX + i], w[XY + i], w[XZ + i], w[YY + i], w[YZ + i], w[ZZ + i] = sums[:6]
    w[RIGHT_X + i], w[RIGHT_Y + i], w[RIGHT_Z + i] = sums[6:]


@FUSED.inlined
def _error(m: np.float32, lamp: Any, x: np.float32, y: np.float32, z: np.float32) -> np.float32:
    """The residual without its sign; of what is MISSING OUT."""
    error: np.float32 = abs(m - (lamp[0] * x + lamp[1] * y + lamp[2] * z))
    return error if m > ABSENT else OUT


@FUSED.inlined
def _errors(m: Any, lamps: Any, x: np.float32, y: np.float32, z: np.float32) -> Any:
    return (
        _error(m[0], lamps[0], x, y, z), _error(m[1], lamps[1], x, y, z), _error(m[2], lamps[2], x, y, z),
        _error(m[3], lamps[3], x, y, z), _error(m[4], lamps[4], x, y, z), _error(m[5], lamps[5], x, y, z),
        _error(m[6], lamps[6], x, y, z), _error(m[7], lamps[7], x, y, z), _error(m[8], lamps[8], x, y, z),
    )  # fmt: skip


@FUSED.inlined
def _weight(error: np.float32, per_width: np.float32, tukey: bool) -> np.float32:
    square = (error * per_width) ** 2  # of what is OUT: infinite
    inside = max(ONE - square, ZERO)
    weight: np.float32 = inside * inside if tukey else ONE / (ONE + square)
    return weight


@FUSED.inlined
def _weights(errors: Any, per_width: np.float32, tukey: bool) -> Any:
    return (
        _weight(errors[0], per_width, tukey), _weight(errors[1], per_width, tukey),
        _weight(errors[2], per_width, tukey), _weight(errors[3], per_width, tukey),
        _weight(errors[4], per_width, tukey), _weight(errors[5], per_width, tukey),
        _weight(errors[6], per_width, tukey), _weight(errors[7], per_width, tukey),
        _weight(errors[8], per_width, tukey),
    )  # fmt: skip


@FUSED.inlined
def _trimmed(bright: np.float32, lower: np.float32, upper: np.float32) -> np.float32:
    weight = ONE if (bright >= lower) & (bright <= upper) else LITTLE
    return weight if bright < OUT else ZERO


@FUSED.inlined
def _bright(m: np.float32, per: np.float32) -> np.float32:
    return m * per if m > ABSENT else OUT


@FUSED.inlined
def _brights(m: Any, per: Floats) -> Any:
    return (
        _bright(m[0], per[0]), _bright(m[1], per[1]), _bright(m[2], per[2]), _bright(m[3], per[3]),
        _bright(m[4], per[4]), _bright(m[5], per[5]), _bright(m[6], per[6]), _bright(m[7], per[7]),
        _bright(m[8], per[8]),
    )  # fmt: skip


@FUSED.called
def _begin(
    matrix: Floats, per_strength: Floats, darkest: np.float32, brightest: np.float32, w: Floats, m: Floats, n: int
) -> None:
    lamps, per = _lamps(matrix), _of_lights(per_strength)
    for i in range(n):
        here, count = _of_nine(m, i), w[COUNT + i]
        bright = _brights(here, per)
        ordered = _sorted_nine(bright)
        spare = max(count - FOUR, ZERO)
        left_out = np.floor(min(brightest * count, spare))
        upper = _ranked(ordered, count - left_out)
        lower = _ranked(ordered, np.floor(min(darkest * count, spare - left_out)) + ONE)
        weights = (
            _trimmed(bright[0], lower, upper), _trimmed(bright[1], lower, upper), _trimmed(bright[2], lower, upper),
            _trimmed(bright[3], lower, upper), _trimmed(bright[4], lower, upper), _trimmed(bright[5], lower, upper),
            _trimmed(bright[6], lower, upper), _trimmed(bright[7], lower, upper), _trimmed(bright[8], lower, upper),
        )  # fmt: skip
        _store_equations(w, i, lamps, weights, here)


@FUSED.called
def _reweigh(
    matrix: Floats, tukey: bool, width: np.float32, noise: np.float32, signal_noise: np.float32,
    sigma_of_median: np.float32, w: Floats, v: Floats, m: Floats, n: int,
) -> None:  # fmt: skip
    """SCALE and the weighted normal equations, as robust_kernel's ``_find_scale`` and ``_add_weighted`` give them."""
    lamps = _lamps(matrix)
    for i in range(n):
        x, y, z = w[X + i], w[Y + i], w[Z + i]
        here = _of_nine(m, i)
        errors = _errors(here, lamps, x, y, z)
        rank = np.floor(HALF * (w[COUNT + i] + THREE))
        least = noise + signal_noise * np.sqrt(x * x + y * y + z * z)
        median = _middle_ranked(_sorted_nine(errors), rank)
        scale = max(sigma_of_median * median if median < OUT else ZERO, least)
        v[SCALE + i] = scale
        weights = _weights(errors, ONE / (width * scale), tukey)
        _store_equations(w, i, lamps, weights, here)


def begin_nine(
    matrix: Floats, per_strength: Floats, darkest: np.float32, brightest: np.float32, w: Floats, m: Floats, n: int
) -> None:
    """The normal equations of the start, as robust_kernel's ``_choose_start`` and ``_add_start`` give them.

    Nothing is done where lights are near: matrix (light, 3, pixel). ``m`` is flat. Compiled only.
    """
    raise NotImplementedError


def reweigh_nine(
    matrix: Floats, tukey: bool, width: np.float32, noise: np.float32, signal_noise: np.float32,
    sigma_of_median: np.float32, w: Floats, v: Floats, m: Floats, n: int,
) -> None:  # fmt: skip
    """SCALE and the weighted normal equations, as robust_kernel's ``_find_scale`` and ``_add_weighted`` give them.

    Nothing is done where lights are near. Compiled only.
    """
    raise NotImplementedError


@overload(begin_nine, jit_options={"forceinline": True}, strict=False)
def _begin_nine(matrix: Any, per_strength: Any, darkest: Any, brightest: Any, w: Any, m: Any, n: Any) -> Any:
    if matrix.ndim != 2:
        return lambda matrix, per_strength, darkest, brightest, w, m, n: None
    return lambda matrix, per_strength, darkest, brightest, w, m, n: _begin(
        matrix, per_strength, darkest, brightest, w, m, n
    )


@overload(reweigh_nine, jit_options={"forceinline": True}, strict=False)
def _reweigh_nine(
    matrix: Any, tukey: Any, width: Any, noise: Any, signal_noise: Any, sigma_of_median: Any,
    w: Any, v: Any, m: Any, n: Any,
) -> Any:  # fmt: skip
    if matrix.ndim != 2:
        return lambda matrix, tukey, width, noise, signal_noise, sigma_of_median, w, v, m, n: None
    return lambda matrix, tukey, width, noise, signal_noise, sigma_of_median, w, v, m, n: _reweigh(
        matrix, tukey, width, noise, signal_noise, sigma_of_median, w, v, m, n
    )
