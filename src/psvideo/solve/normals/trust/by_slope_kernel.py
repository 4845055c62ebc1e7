"""The compiled loops over points whose albedo is held against their slope: what is averaged, and what all lamps light.

Numpy took twenty passes of a small picture. All are planes of the points in one line, (point,).
"""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.model.arrays import Bytes, Floats

ZERO, ONE = np.float32(0), np.float32(1)
SUMMED = 6
"""What is averaged: three numbers of a normal times albedo, albedo and its square, and whether a point is known."""
WHOLE, TINY = np.float32(0.999), np.float32(1e-12)
SMOOTH = np.float32(0.98)
"""Where normals of a square are so much shorter in the mean, by their albedo, a crease goes through it."""


@FUSED.kept
def fill_summed(planes: Floats, albedo: Floats, known: Bytes, summed: Floats) -> None:
    """Fill ``summed`` (SUMMED, point) from normals (3, point) and albedo, zeros where nothing is known."""
    x, y, z, level, square, one = summed[0], summed[1], summed[2], summed[3], summed[4], summed[5]
    for i in range(len(known)):
        level[i] = albedo[i] if known[i] else ZERO
        one[i] = ONE if known[i] else ZERO
    for i in range(len(known)):
        each = level[i]
        square[i] = each * each
        x[i], y[i], z[i] = planes[0, i] * each, planes[1, i] * each, planes[2, i] * each


@FUSED.kept
def fill_averaged(means: Floats, known: Bytes, varies: Floats, whole: Bytes) -> None:
    """Make unit normals of the first three of the means over squares of what ``fill_summed`` gave; fill by which share
    of itself albedo ``varies`` there, and whether all of a square is known."""
    x, y, z, level, square, one = means[0], means[1], means[2], means[3], means[4], means[5]
    for i in range(len(known)):
        size = np.sqrt(x[i] * x[i] + y[i] * y[i] + z[i] * z[i])
        whole[i] = (known[i] > 0) & (one[i] > WHOLE) & (size > SMOOTH * level[i])
        length = ONE / max(size, TINY)
        x[i], y[i], z[i] = x[i] * length, y[i] * length, z[i] * length
    for i in range(len(known)):
        varies[i] = np.sqrt(max(square[i] - level[i] * level[i], ZERO)) / max(level[i], TINY)


@FUSED.kept
def fill_in_light(normals: Floats, directions: Floats, least: float, known: Bytes, in_light: Bytes) -> None:
    """Fill whether every light (light, 3) shines on a known point by more than a share ``least`` of the mean."""
    lights = len(directions)
    share = np.float32(least) / np.float32(lights)
    total, darkest = np.zeros(len(known), np.float32), np.ones(len(known), np.float32)
    for light in range(lights):
        x, y, z = directions[light, 0], directions[light, 1], directions[light, 2]
        for i in range(len(known)):
            cosine = x * normals[0, i] + y * normals[1, i] + z * normals[2, i]
            total[i] += max(cosine, ZERO)
            darkest[i] = min(darkest[i], cosine)
    for i in range(len(known)):
        in_light[i] = (known[i] > 0) & (darkest[i] > share * total[i])
