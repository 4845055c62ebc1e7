"""The reflectance fit's sums over lights and points, and the small equations that come of them, compiled: numpy takes
longer to call than to add up so few.

Arrays are those of ``SubjectPoints``: (light, point), directions (light, point, 3).
"""

import numpy as np

from psvideo.compute.compiled import EXACT, FUSED
from psvideo.model.arrays import Doubles

DESCENTS = 50
"""Mostly far fewer are needed."""


@FUSED.inlined
def along_way(ways: Doubles, light: int, point: int, normal: Doubles) -> float:
    """Return the product of a vector with one of the ways (light, point, 3): of unit vectors, their cosine."""
    x, y, z = ways[light, point, 0], ways[light, point, 1], ways[light, point, 2]
    return float(x * normal[0] + y * normal[1] + z * normal[2])


@FUSED.inlined
def add_square(m: Doubles, weight: float, x: float, y: float, z: float) -> None:
    """Add a vector's square, so often, to a matrix (its upper triangle row by row)."""
    m[0] += weight * x * x
    m[1] += weight * x * y
    m[2] += weight * x * z
    m[3] += weight * y * y
    m[4] += weight * y * z
    m[5] += weight * z * z


@FUSED.inlined
def solve_symmetric(m: Doubles, x: Doubles) -> None:
    """Solve with a positive definite matrix (its upper triangle row by row); the answer stands in ``x``."""
    b, c = m[1] / m[0], m[2] / m[0]
    d = m[3] - b * m[1]
    t = m[4] - c * m[1]
    e = t / d
    f = m[5] - c * m[2] - e * t
    y = x[1] - b * x[0]
    x[2] = (x[2] - c * x[0] - e * y) / f
    x[1] = y / d - e * x[2]
    x[0] = x[0] / m[0] - b * x[1] - c * x[2]


@FUSED.kept
def take_off_own(towards: Doubles, weights: Doubles, parts: Doubles, left: Doubles) -> None:
    """Fill ``left`` with what a vector of each pixel's own does not explain of the parts (part, light, point)."""
    matrix, own = np.empty(6), np.empty(3)
    for p in range(parts.shape[2]):
        matrix[:] = 0.0
        matrix[0] = matrix[3] = matrix[5] = 1e-9
        for light in range(len(towards)):
            x, y, z = towards[light, p, 0], towards[light, p, 1], towards[light, p, 2]
            add_square(matrix, weights[light, p], x, y, z)
        for k in range(len(parts)):
            own[:] = 0.0
            for light in range(len(towards)):
                for i in range(3):
                    own[i] += weights[light, p] * parts[k, light, p] * towards[light, p, i]
            solve_symmetric(matrix, own)
            for light in range(len(towards)):
                left[k, light, p] = parts[k, light, p] - along_way(towards, light, p, own)


@FUSED.kept
def add_squares(weights: Doubles, left: Doubles, square: Doubles, right: Doubles) -> None:
    """Fill the model's normal equations: sums over lights and points of the weighted products of what each of its
    numbers adds, ``left[1:]``, with each other and with what was measured, ``left[0]``."""
    square[:], right[:] = 0.0, 0.0
    size = len(right)
    for light in range(weights.shape[0]):
        for p in range(weights.shape[1]):
            for k in range(size):
                part = weights[light, p] * left[1 + k, light, p]
                right[k] += part * left[0, light, p]
                for j in range(k + 1):
                    square[k, j] += part * left[1 + j, light, p]
    for k in range(size):
        for j in range(k):
            square[j, k] = square[k, j]


@EXACT.kept
def descend_within(square: Doubles, wanted: Doubles, least: Doubles, most: Doubles, found: Doubles) -> None:
    """Fill ``found`` with the least of a strictly convex square form within bounds, number by number."""
    size = len(found)
    found[:] = 0.0
    for _ in range(DESCENTS):
        moved = False
        for k in range(size):
            other = 0.0
            for n in range(size):
                if n != k:
                    other += square[k, n] * found[n]
            now = min(max((wanted[k] - other) / square[k, k], least[k]), most[k])
            moved = moved or now != found[k]
            found[k] = now
        if not moved:
            break
