"""The compiled loop that asks how well one normal and one albedo explain the lights' plates, as they are and moved."""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import lent
from psvideo.model.arrays import Codes8, Doubles, Floats

SOLVED = 3
"""This many lights are explained by a normal and an albedo, whatever they show."""
CLIPPED = 250
"""Codes from here on may be cut off at a sketch's white."""
FLAT = 1e-4
"""Lights of which less than this share (of the cube of their mean size) spans all three directions tell nothing."""
MOST = 1.0
"""What is left counts up to so much of the albedo, squared: one pixel does not speak for a window."""


@FUSED.kept
def leave_rows(
    rest: Codes8, moved: Codes8, light: Doubles, matrix: Doubles, evening: Floats, least: Doubles, factors: Doubles,
    first: int, last: int, left: Floats,
) -> None:  # fmt: skip
    """Fill rows of ``left`` (3, row, col) where plates ``rest`` and ``moved`` (light, row, col) differ; 0 elsewhere.

    Its planes are what is left of the plates as they are, and of those moved, as sums of squares in units of albedo;
    and what noise and surfaces that are not matte leave. ``light`` (light, 256) is
    what a code stands for, ``matrix`` (light, 3) the directions times the strengths, ``least`` (light,) what counts as
    lit. ``factors``: what is not matte, squared; noise, as a variance per unit of light and at no light; the least
    albedo.
    """
    one, other, made = lent(rest), lent(moved), lent(left)
    sums = np.empty(12, np.float64)
    for row in range(first, last):
        for col in range(one.shape[2]):
            made[:, row, col] = np.float32(0)
            sums[:] = 0.0
            lit, differ, own, their, noise = 0, False, 0.0, 0.0, 0.0
            for k in range(one.shape[0]):
                a, b = one[k, row, col], other[k, row, col]
                differ |= a != b
                p, q = light[k, a], light[k, b]
                if p <= least[k] or q <= least[k] or a >= CLIPPED or b >= CLIPPED:
                    continue
                even = evening[k, min(row, evening.shape[1] - 1), min(col, evening.shape[2] - 1)]
                noise += even * even * (factors[1] * p + factors[2])
                p, q = p * even, q * even
                lit += 1
                own += p * p
                their += q * q
                x, y, z = matrix[k, 0], matrix[k, 1], matrix[k, 2]
                sums[0] += x * x
                sums[1] += x * y
                sums[2] += x * z
                sums[3] += y * y
                sums[4] += y * z
                sums[5] += z * z
                sums[6] += p * x
                sums[7] += p * y
                sums[8] += p * z
                sums[9] += q * x
                sums[10] += q * y
                sums[11] += q * z
            if not differ or lit <= SOLVED:
                continue
            xx = sums[3] * sums[5] - sums[4] * sums[4]
            xy = sums[2] * sums[4] - sums[1] * sums[5]
            xz = sums[1] * sums[4] - sums[2] * sums[3]
            yy = sums[0] * sums[5] - sums[2] * sums[2]
            yz = sums[1] * sums[2] - sums[0] * sums[4]
            zz = sums[0] * sums[3] - sums[1] * sums[1]
            size = sums[0] * xx + sums[1] * xy + sums[2] * xz
            mean = (sums[0] + sums[3] + sums[5]) / 3
            if size <= FLAT * mean * mean * mean:
                continue
            for n in range(2):
                u, v, w = sums[6 + 3 * n], sums[7 + 3 * n], sums[8 + 3 * n]
                x = (xx * u + xy * v + xz * w) / size
                y = (xy * u + yy * v + yz * w) / size
                z = (xz * u + yz * v + zz * w) / size
                albedo = max(x * x + y * y + z * z, factors[3] * factors[3])
                over = max((own if n == 0 else their) - (x * u + y * v + z * w), 0.0)
                made[n, row, col] = np.float32(min(over / albedo, MOST))
                if n == 0:
                    usual = factors[0] + noise / (lit * albedo)
                    made[2, row, col] = np.float32((lit - SOLVED) * usual)
