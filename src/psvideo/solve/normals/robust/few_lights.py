"""Compiled parts of the robust solver for rigs of up to FEW distant lights: a pixel's measurements all in registers.

What ``any_lights.py`` does for any number of lights, plane by plane in memory, is done here in one straight line per
pixel, with medians by a sorting network: most rigs have four to nine lights, and this takes half the time. Rigs with
fewer are filled up with lights that are MISSING everywhere. The straight lines are written out from FEW: a compiler
keeps in registers what has a name or a fixed place in a tuple, not what stands in an array.
"""

import re
from collections.abc import Iterator
from typing import Any

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.model.arrays import Floats
from psvideo.solve.normals.loops.blocks import ABSENT, BLOCK, COUNT, ONE, THREE, XX, XY, XZ, YY, YZ, ZERO, ZZ, X, Y, Z
from psvideo.solve.normals.loops.near_kernel import of_light  # noqa: F401 (in a text below)
from psvideo.solve.normals.robust.equations import FROM, HALF, OUT, RIGHT_X, RIGHT_Y, RIGHT_Z, SCALE, TO
from psvideo.solve.normals.task import FEW

LITTLE = np.float32(0.02)  # the weight of what the start leaves out, so that no start is singular
FOUR, EIGHT = np.float32(4), np.float32(8)
SIGMA_OF_MEDIAN = np.float32(1.4826)  # of Gaussian noise


def exchanges(count: int) -> Iterator[tuple[int, int]]:
    """Yield the places to compare and exchange that bring this many numbers into rising order.

    K. E. Batcher's merge exchange (D. E. Knuth, TAOCP 3, 5.2.2, algorithm M): 26 of nine, one more than the best known.

    >>> list(exchanges(3))
    [(0, 2), (0, 1), (1, 2)]
    """
    top = 1 << max((count - 1).bit_length() - 1, 0)
    p = top
    while p > 0:
        q, r, d = top, 0, p
        while True:
            yield from ((i, i + d) for i in range(count - d) if i & p == r)
            if q == p:
                break
            q, r, d = q // 2, p, q - p
        p //= 2


def _written(name: str, arguments: str, *lines: str) -> Any:
    """Compile a function of this module from its lines."""
    known: dict[str, Any] = {}
    exec(f"def {name}({arguments}):\n" + "".join(f"    {line}\n" for line in lines), globals(), known)
    return FUSED.inlined(known[name])


def _of_each(entry: str, arguments: str) -> Any:
    """Compile a function that gives a tuple of one ``entry`` per light, k being its place."""
    entries = (re.sub(r"\bk\b", str(k), entry) for k in range(FEW))
    return _written("each", arguments, f"return ({', '.join(entries)})")


def _choice(first: int, last: int) -> Any:
    """Compile a function that gives of numbers in rising order the rank-th smallest, for ranks from first to last."""
    higher = (f"value = ordered[{n}] if rank > np.float32({n}.5) else value" for n in range(first, last))
    return _written("ranked", "ordered, rank", f"value = ordered[{first - 1}]", *higher, "return value")


@FUSED.inlined
def _in_order(a: np.float32, b: np.float32) -> tuple[np.float32, np.float32]:
    return (a if a < b else b), (b if a < b else a)


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
def _error(m: np.float32, lamp: Any, x: np.float32, y: np.float32, z: np.float32) -> np.float32:
    """The absolute residual; OUT where the measurement is MISSING."""
    error: np.float32 = abs(m - (lamp[0] * x + lamp[1] * y + lamp[2] * z))
    return error if m > ABSENT else OUT


@FUSED.inlined
def _weight(error: np.float32, per_width: np.float32, tukey: bool) -> np.float32:
    square = (error * per_width) ** 2  # of what is OUT: infinite
    inside = max(ONE - square, ZERO)
    weight: np.float32 = inside * inside if tukey else ONE / (ONE + square)
    return weight


@FUSED.inlined
def _trimmed(bright: np.float32, lower: np.float32, upper: np.float32) -> np.float32:
    weight = ONE if (bright >= lower) & (bright <= upper) else LITTLE
    return weight if bright < OUT else ZERO


@FUSED.inlined
def _bright(m: np.float32, per: np.float32) -> np.float32:
    return m * per if m > ABSENT else OUT


_of_pixel = _of_each(f"planes[k * {BLOCK} + i]", "planes, i")
_of_planes = _of_each("planes[k, i]", "planes, i")
_lamps = _of_each("of_light(matrix, k)", "matrix")
_of_lights = _of_each("numbers[k]", "numbers")
_brights = _of_each("_bright(m[k], per[k])", "m, per")
_trims = _of_each("_trimmed(bright[k], lower, upper)", "bright, lower, upper")
_errors = _of_each("_error(m[k], lamps[k], x, y, z)", "m, lamps, x, y, z")
_weights = _of_each("_weight(errors[k], per_width, tukey)", "errors, per_width, tukey")
_numbers = ", ".join(f"v{k}" for k in range(FEW))
_sorted = _written(
    "in_rising_order",
    "values",
    f"{_numbers} = values",
    *(f"v{a}, v{b} = _in_order(v{a}, v{b})" for a, b in exchanges(FEW)),
    f"return {_numbers}",
)
_sums = _written(
    "sums",
    "lamps, weights, m",
    "total = _begun(lamps[0], weights[0], m[0])",
    *(f"total = _added(total, lamps[{k}], weights[{k}], m[{k}])" for k in range(1, FEW)),
    "return total",
)
_ranked = _choice(1, FEW)
_median = _choice(3, (FEW + 3) // 2)  # of what is not fitted


@FUSED.inlined
def _store_equations(w: Floats, i: int, lamps: Any, weights: Any, m: Any) -> None:
    sums = _sums(lamps, weights, m)
    w[XX + i], w[XY + i], w[XZ + i], w[YY + i], w[YZ + i], w[ZZ + i] = sums[:6]
    w[RIGHT_X + i], w[RIGHT_Y + i], w[RIGHT_Z + i] = sums[6:]


@FUSED.called
def median_few(e: Floats, w: Floats, v: Floats, n: int) -> None:
    """The median of residuals e (light, pixel) of what is not fitted, into FROM and TO, as ``halve`` leaves it."""
    for i in range(n):
        median = _median(_sorted(_of_planes(e, i)), np.floor(HALF * (w[COUNT + i] + THREE)))
        v[FROM + i] = median if median < OUT else ZERO
        v[TO + i] = v[FROM + i]


@FUSED.called
def begin_few(
    matrix: Floats, per_strength: Floats, darkest: np.float32, brightest: np.float32, w: Floats, m: Floats, n: int
) -> None:
    """The normal equations of the start, as ``choose_start`` and ``add_start`` give them. ``m`` is flat."""
    lamps, per = _lamps(matrix), _of_lights(per_strength)
    for i in range(n):
        here, count = _of_pixel(m, i), w[COUNT + i]
        bright = _brights(here, per)
        ordered = _sorted(bright)
        spare = max(count - FOUR, ZERO)
        left_out = np.floor(min(brightest * count, spare))
        upper = _ranked(ordered, count - left_out)
        lower = _ranked(ordered, np.floor(min(darkest * count, spare - left_out)) + ONE)
        weights = _trims(bright, lower, upper)
        _store_equations(w, i, lamps, weights, here)


@FUSED.called
def reweigh_few(
    matrix: Floats, tukey: bool, width: np.float32, noise: np.float32, signal_noise: np.float32,
    w: Floats, v: Floats, m: Floats, n: int,
) -> None:  # fmt: skip
    """SCALE and the weighted normal equations, as ``find_scale`` and ``add_weighted`` give them."""
    lamps = _lamps(matrix)
    for i in range(n):
        x, y, z = w[X + i], w[Y + i], w[Z + i]
        here = _of_pixel(m, i)
        errors = _errors(here, lamps, x, y, z)
        rank = np.floor(HALF * (w[COUNT + i] + THREE))
        least = noise + signal_noise * np.sqrt(x * x + y * y + z * z)
        median = _median(_sorted(errors), rank)
        scale = max(SIGMA_OF_MEDIAN * median if median < OUT else ZERO, least)
        v[SCALE + i] = scale
        weights = _weights(errors, ONE / (width * scale), tukey)
        _store_equations(w, i, lamps, weights, here)
