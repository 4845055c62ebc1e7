"""Compiled parts of the robust solver: weighted normal equations of every pixel of a block, and medians over lights.

Planes lie in two flat working arrays, ``w`` (those of ``kernel.py``) and ``v`` (those below), BLOCK apart.
"""

import numpy as np

from psvideo.normals.compiled import inlined
from psvideo.normals.kernel import BLOCK, COUNT, HIGH, LOW, ONE, SUM, THREE, XX, XY, XZ, YY, YZ, ZERO, ZZ, X, Y, Z
from psvideo.normals.task import Floats

HALF = np.float32(0.5)
HALVINGS = 9  # a quantile is found to a 512th of the interval that holds it
OUT = np.float32(1e30)  # beyond every interval: stands for what is MISSING

# Planes of v: an interval (FROM, TO) around the value of that RANK; what the steps hand on; COUNTED is scratch.
FROM, TO, RANK, COUNTED, LOWER, UPPER, SCALE, ODD, DOUBT = (BLOCK * plane for plane in range(9))
RIGHT_X, RIGHT_Y, RIGHT_Z = LOW, HIGH, SUM  # the equations' right sides, in planes of w that are free by now


@inlined
def clear_equations(w: Floats, n: int) -> None:
    """Begin the normal equations anew."""
    for plane in (XX, XY, XZ, YY, YZ, ZZ, RIGHT_X, RIGHT_Y, RIGHT_Z):
        w[plane : plane + n] = ZERO


@inlined
def add_one(
    w: Floats, i: int, x: np.float32, y: np.float32, z: np.float32, weight: np.float32, value: np.float32
) -> None:
    """Add one measurement of one pixel to its normal equations."""
    a, b, c = weight * x, weight * y, weight * z
    w[XX + i] += a * x
    w[XY + i] += a * y
    w[XZ + i] += a * z
    w[YY + i] += b * y
    w[YZ + i] += b * z
    w[ZZ + i] += c * z
    w[RIGHT_X + i] += a * value
    w[RIGHT_Y + i] += b * value
    w[RIGHT_Z + i] += c * value


@inlined
def solve_equations(w: Floats, n: int, condition_squared: np.float32, keep: bool) -> None:
    """g from the normal equations; where they are badly conditioned what was there stays (``keep``), or 0."""
    for i in range(n):
        a, b, c, d, e, f = w[XX + i], w[XY + i], w[XZ + i], w[YY + i], w[YZ + i], w[ZZ + i]
        xx, xy, xz = d * f - e * e, c * e - b * f, b * e - c * d
        yy, yz, zz = a * f - c * c, b * c - a * e, a * d - b * b
        p, q, r = w[RIGHT_X + i], w[RIGHT_Y + i], w[RIGHT_Z + i]
        determinant = a * xx + b * xy + c * xz
        sound = (a + d + f) * (xx + yy + zz) <= condition_squared * determinant
        sound = sound & (determinant > ZERO) & (w[COUNT + i] >= THREE)
        scale = ONE / determinant if sound else ZERO
        x, y, z = xx * p + xy * q + xz * r, xy * p + yy * q + yz * r, xz * p + yz * q + zz * r
        kept = keep & (not sound)
        w[X + i] = w[X + i] if kept else x * scale
        w[Y + i] = w[Y + i] if kept else y * scale
        w[Z + i] = w[Z + i] if kept else z * scale


@inlined
def halve(v: Floats, e: Floats, n: int) -> None:
    """Narrow FROM, TO around the RANK-th smallest of e (light, pixel): fewer than RANK lie up to FROM, RANK up to TO.

    Halving an interval runs over planes without a branch, for any number of lights.
    """
    for _ in range(HALVINGS):
        for i in range(n):
            v[COUNTED + i] = ZERO
        for light in range(e.shape[0]):
            plane = e[light]
            for i in range(n):
                v[COUNTED + i] += ONE if plane[i] <= HALF * (v[FROM + i] + v[TO + i]) else ZERO
        for i in range(n):
            middle, enough = HALF * (v[FROM + i] + v[TO + i]), v[COUNTED + i] >= v[RANK + i]
            v[TO + i] = middle if enough else v[TO + i]
            v[FROM + i] = v[FROM + i] if enough else middle
