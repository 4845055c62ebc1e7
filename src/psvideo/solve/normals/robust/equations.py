"""Compiled parts of the robust solver: weighted normal equations of every pixel of a block, and medians over lights.

Planes lie in two flat working arrays, ``w`` (those of ``blocks.py``) and ``v`` (those below), BLOCK apart.
"""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.compute.symmetric import adjugate
from psvideo.compute.whole_stores import unmasked
from psvideo.model.arrays import Floats
from psvideo.solve.normals.loops.blocks import (
    BLOCK,
    COUNT,
    HIGH,
    LOW,
    ONE,
    SUM,
    THREE,
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
from psvideo.solve.normals.loops.near_kernel import at, of_light

HALF = np.float32(0.5)
HALVINGS = 6  # a quantile is found to a 64th of the interval that holds it
OUT = np.float32(1e30)  # beyond every interval: stands for what is MISSING

# Planes of v: an interval (FROM, TO) around the value of that RANK; what the steps hand on; COUNTED is scratch; SENT is
# what lights send to a pixel in the mean, over what they send to the middle of the picture (distant ones: 1); VIEW is
# the unit vector to the camera (along its axis where the lens is not known).
FROM, TO, RANK, COUNTED, LOWER, UPPER, SCALE, ODD, DOUBT, SENT = (BLOCK * plane for plane in range(10))
VIEW_X, VIEW_Y, VIEW_Z = (BLOCK * plane for plane in range(10, 13))
PLANES_OF_V = 13
RIGHT_X, RIGHT_Y, RIGHT_Z = LOW, HIGH, SUM  # the equations' right sides, in planes of w that are free by now


@FUSED.called
def add_equations(matrix: Floats, w: Floats, m: Floats, weights: Floats, n: int) -> None:
    """The normal equations of every pixel; ``m`` and ``weights`` are (light, pixel), of whole threes of lights."""
    for k in range(0, len(m), 3):
        _add_three(matrix, w, m[k], m[k + 1], m[k + 2], weights[k], weights[k + 1], weights[k + 2], k, n)


@FUSED.inlined
def _add_three(
    matrix: Floats, w: Floats, a: Floats, b: Floats, c: Floats, p: Floats, q: Floats, r: Floats, k: int, n: int
) -> None:
    """Add three lights, from light k, with the weights p, q, r; the first three begin new equations."""
    first, second, third = of_light(matrix, k), of_light(matrix, k + 1), of_light(matrix, k + 2)
    old = ONE if k > 0 else ZERO
    for i in range(n):
        (xa, ya, za), (xb, yb, zb), (xc, yc, zc) = at(first, i), at(second, i), at(third, i)
        pa, qb, rc = p[i] * a[i], q[i] * b[i], r[i] * c[i]
        w[RIGHT_X + i] = old * w[RIGHT_X + i] + xa * pa + xb * qb + xc * rc
        w[RIGHT_Y + i] = old * w[RIGHT_Y + i] + ya * pa + yb * qb + yc * rc
        w[RIGHT_Z + i] = old * w[RIGHT_Z + i] + za * pa + zb * qb + zc * rc
    for i in range(n):
        (xa, ya, za), (xb, yb, zb), (xc, yc, zc) = at(first, i), at(second, i), at(third, i)
        pa, qb, rc = p[i] * xa, q[i] * xb, r[i] * xc
        w[XX + i] = old * w[XX + i] + pa * xa + qb * xb + rc * xc
        w[XY + i] = old * w[XY + i] + pa * ya + qb * yb + rc * yc
        w[XZ + i] = old * w[XZ + i] + pa * za + qb * zb + rc * zc
        pa, qb, rc = p[i] * ya, q[i] * yb, r[i] * yc
        w[YY + i] = old * w[YY + i] + pa * ya + qb * yb + rc * yc
        w[YZ + i] = old * w[YZ + i] + pa * za + qb * zb + rc * zc
        w[ZZ + i] = old * w[ZZ + i] + p[i] * za * za + q[i] * zb * zb + r[i] * zc * zc


@FUSED.called
def solve_equations(w: Floats, n: int, condition_squared: np.float32, keep: bool) -> None:
    """g from the normal equations; where they are badly conditioned what was there stays (``keep``), or 0."""
    for i in range(n):
        a, b, c, d, e, f = w[XX + i], w[XY + i], w[XZ + i], w[YY + i], w[YZ + i], w[ZZ + i]
        old_x, old_y, old_z = unmasked(w[X + i]), unmasked(w[Y + i]), unmasked(w[Z + i])
        xx, xy, xz, yy, yz, zz, determinant = adjugate(a, b, c, d, e, f)
        p, q, r = w[RIGHT_X + i], w[RIGHT_Y + i], w[RIGHT_Z + i]
        sound = (a + d + f) * (xx + yy + zz) <= condition_squared * determinant
        sound = sound & (determinant > ZERO) & (w[COUNT + i] >= THREE)
        scale = ONE / determinant if sound else ZERO
        x, y, z = xx * p + xy * q + xz * r, xy * p + yy * q + yz * r, xz * p + yz * q + zz * r
        kept = keep & (not sound)
        w[X + i] = old_x if kept else x * scale
        w[Y + i] = old_y if kept else y * scale
        w[Z + i] = old_z if kept else z * scale


@FUSED.called
def fill_sent(per_strength: Floats, lights: int, v: Floats, n: int) -> None:
    """SENT of a block's pixels under near lights, of which per_strength (light, pixel) holds 1 / strength."""
    v[SENT : SENT + n] = ZERO
    for light in range(lights):
        per = per_strength[light]
        for i in range(n):
            v[SENT + i] += ONE / (np.float32(lights) * per[i])


@FUSED.called
def fill_view(pinhole: Floats, row: int, col: int, v: Floats, n: int) -> None:
    """VIEW of n pixels of a row from ``col`` on, through a pinhole as in ``task.Near``."""
    across, down, middle_col, middle_row = pinhole
    y = (np.float32(row) - middle_row) * down
    for i in range(n):
        x = (middle_col - np.float32(col + i)) * across
        one = ONE / np.sqrt(x * x + y * y + ONE)
        v[VIEW_X + i], v[VIEW_Y + i], v[VIEW_Z + i] = x * one, y * one, one


@FUSED.called
def halve(v: Floats, e: Floats, n: int) -> None:
    """Narrow FROM, TO around the RANK-th smallest of e (light, pixel): fewer than RANK lie up to FROM, RANK up to TO.

    Halving an interval runs over planes without a branch, for any number of lights.
    """
    for _ in range(HALVINGS):
        for k in range(0, len(e), 3):
            a, b, c, old = e[k], e[k + 1], e[k + 2], ONE if k > 0 else ZERO
            for i in range(n):
                middle = HALF * (v[FROM + i] + v[TO + i])
                two = (ONE if a[i] <= middle else ZERO) + (ONE if b[i] <= middle else ZERO)
                v[COUNTED + i] = old * v[COUNTED + i] + two + (ONE if c[i] <= middle else ZERO)
        for i in range(n):
            start, end = unmasked(v[FROM + i]), unmasked(v[TO + i])
            middle, enough = HALF * (start + end), v[COUNTED + i] >= v[RANK + i]
            v[TO + i] = middle if enough else end
            v[FROM + i] = start if enough else middle
