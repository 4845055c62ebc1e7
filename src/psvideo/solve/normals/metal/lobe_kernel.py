"""Loops over points of metal: what lobes show of them, and how much of their light that leaves unexplained.

Arrays are those of ``SubjectPoints``: (light, point), directions (light, point, 3). What is compared are square roots
of brightness, of which shot noise is as large in the dark as in a highlight: of light itself, highlights alone would
count. A point's own scale is free.
"""

import numpy as np

from psvideo.compute.compiled import EXACT, FUSED
from psvideo.model.arrays import Doubles

LOBES = 8
"""Of h^2, h^4 and so on, each the square of the one before."""
LEFT_OUT_OF = 6
"""One of so many measurements is left out where it is asked how well points are explained."""
TINY = 1e-12


@FUSED.inlined
def shown_by_lobes(numbers: Doubles, c: float, h: float) -> tuple[float, float, float]:
    """Return what a light shows at cosines to it and to half way, and what that gains with either."""
    if c <= 0.0:
        return 0.0, 0.0, 0.0
    least = max(h, 1e-3)
    power, plain, by_plain, shaded, by_shaded, number = least * least, 0.0, 0.0, numbers[0], 0.0, 2.0
    for k in range(1, LOBES + 1):
        one, other = numbers[k] * power, numbers[LOBES + k] * power
        plain += one
        by_plain += number * one
        shaded += other
        by_shaded += number * other
        power *= power
        number *= 2.0
    return plain + c * shaded, shaded, (by_plain + c * by_shaded) / least


@FUSED.inlined
def sort_in(order: Doubles, many: int, one: float) -> None:
    """Put a number where it belongs among the first ``many`` of ``order``, which are sorted."""
    place = many
    while place > 0 and order[place - 1] > one:
        order[place] = order[place - 1]
        place -= 1
    order[place] = one


@EXACT.kept
def fill_shown(normals: Doubles, towards: Doubles, half: Doubles, parts: Doubles) -> None:
    """Fill ``parts`` (1 + 2 LOBES, light, point) with n . l, the lobes, and the lobes times n . l of points with these
    normals (point, 3)."""
    for p in range(len(normals)):
        x, y, z = normals[p, 0], normals[p, 1], normals[p, 2]
        for light in range(len(towards)):
            c = x * towards[light, p, 0] + y * towards[light, p, 1] + z * towards[light, p, 2]
            h = x * half[light, p, 0] + y * half[light, p, 1] + z * half[light, p, 2]
            power = max(h, 1e-3) ** 2
            parts[0, light, p] = max(c, 0.0)
            for k in range(1, LOBES + 1):
                parts[k, light, p] = power if c > 0.0 else 0.0
                parts[LOBES + k, light, p] = power * max(c, 0.0)
                power *= power


@FUSED.kept
def fill_sums(normals: Doubles, towards: Doubles, half: Doubles, numbers: Doubles, shown: Doubles) -> None:
    """Fill ``shown`` (light, point) with what points with these normals (point, 3) show, in their own scale."""
    for p in range(len(normals)):
        for light in range(len(towards)):
            c, h = 0.0, 0.0
            for i in range(3):
                c += normals[p, i] * towards[light, p, i]
                h += normals[p, i] * half[light, p, i]
            shown[light, p] = shown_by_lobes(numbers, c, h)[0]


@FUSED.kept
def fill_unlike(measured: Doubles, counts: Doubles, shown: Doubles, unlike: Doubles) -> None:
    """Fill ``unlike`` (point,) with the share of what was measured (light, point), as square roots, that is not what is
    ``shown``, in any scale: 0 is all of it, 1 nothing. The worst few measurements are left out, as a cast shadow's edge
    is."""
    lights = len(measured)
    order, bright, root = np.empty(lights), np.empty(lights), np.empty(lights)
    for p in range(len(unlike)):
        along, square, there, many = 0.0, TINY, TINY, 0
        for light in range(lights):
            bright[light], root[light] = np.sqrt(max(shown[light, p], 0.0)), np.sqrt(max(measured[light, p], 0.0))
            along += counts[light, p] * root[light] * bright[light]
            square += counts[light, p] * bright[light] * bright[light]
            there += counts[light, p] * root[light] * root[light]
        for _ in range(2):
            scale, many = along / square, 0
            for light in range(lights):
                if counts[light, p] > 0.0:
                    sort_in(order, many, abs(root[light] - scale * bright[light]))
                    many += 1
            most = order[max(many - 1 - many // LEFT_OUT_OF, 0)] if many else 0.0
            along, square = 0.0, TINY
            for light in range(lights):
                if counts[light, p] > 0.0 and abs(root[light] - scale * bright[light]) <= most:
                    along += root[light] * bright[light]
                    square += bright[light] * bright[light]
        total = 0.0
        for k in range(many - many // LEFT_OUT_OF):
            total += order[k] * order[k]
        unlike[p] = total / there
