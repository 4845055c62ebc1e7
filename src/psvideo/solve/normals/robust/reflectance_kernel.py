"""What a subject's model shows at its points, and a step of their normals under it, compiled.

Arrays are those of ``SubjectPoints``: (light, point), directions (light, point, 3) and (point, 3).
"""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.model.arrays import Doubles
from psvideo.solve.normals.robust.point_sums import add_square, along_way, solve_symmetric
from psvideo.solve.normals.robust.subject_points import ShownPoints
from psvideo.solve.normals.task import FEW

LEAST_FACING = 0.05
"""Of the cosines that roughness is divided by."""
MOST_BRIGHT = 5.0
"""Of the darkest points highlights are taken for this many times the albedo at most, while the model is fitted."""
WIDTH = 0.6
"""Cauchy's width in standard deviations of a pixel's own residuals, for its normal."""
LEAST_SHARE = 0.01
"""A pixel's residuals are at least this share of its light."""
LONGEST_STEP = 0.3
"""Of a normal times albedo, as a share of it."""


@FUSED.inlined
def _roughness(c: float, facing: float, towards: float) -> tuple[float, float, float]:
    """Return what rough surfaces add, and what it gains with the cosines to the light and to the camera."""
    seen = max(facing, LEAST_FACING)
    if not (c > 0.0 and towards > c * facing):
        return 0.0, 0.0, 0.0
    if c > seen:  # of the two angles this one is less
        return towards - c * seen, -seen, -c
    return c / seen * (towards - c * seen), towards / seen - 2 * c, -c / seen * towards / seen


@FUSED.kept
def fill_roughness_in_the_fit(angles: Doubles, found: Doubles) -> None:
    """Fill ``found`` (3, angle) with what roughness adds and gains; ``angles`` (3, angle) are the cosines between
    normal and light, normal and camera, light and camera."""
    for n in range(angles.shape[1]):
        found[0, n], found[1, n], found[2, n] = _roughness(angles[0, n], angles[1, n], angles[2, n])


@FUSED.inlined
def _facing(to_camera: Doubles, point: int, way: Doubles) -> float:
    return float(to_camera[point, 0] * way[0] + to_camera[point, 1] * way[1] + to_camera[point, 2] * way[2])


@FUSED.inlined
def _size_and_normal(g: Doubles, point: int, normal: Doubles) -> float:
    size = float(np.sqrt(g[point, 0] ** 2 + g[point, 1] ** 2 + g[point, 2] ** 2))
    for i in range(3):
        normal[i] = g[point, i] / size
    return size


@FUSED.kept
def fill_parts(points: ShownPoints, g: Doubles, typical: float, power: float, on_paint: bool, parts: Doubles) -> None:
    """Fill ``parts`` (part, light, point): what was measured, in albedos, and what each number of the model adds.

    A ``power`` above 0 puts a lobe h^power in softness' place, in shares of the albedo where ``on_paint``, else
    whatever the albedo."""
    measured, _, towards, half, to_camera = points
    normal = np.empty(3)
    for p in range(len(g)):
        size = _size_and_normal(g, p, normal)
        bright, facing = min(typical / size, MOST_BRIGHT), _facing(to_camera, p, normal)
        for light in range(len(measured)):
            c, h = along_way(towards, light, p, normal), max(along_way(half, light, p, normal), 0.0)
            lit = 1.0 if c > 0.0 else 0.0
            h8 = ((h * h) ** 2) ** 2
            h32 = (h8 * h8) ** 2
            parts[0, light, p] = measured[light, p] / size
            parts[1, light, p] = c * c * lit
            parts[2, light, p] = _roughness(c, facing, _facing(to_camera, p, towards[light, p]))[0]
            lobe = lit * (1.0 if on_paint else bright)
            parts[3, light, p] = lobe * h**power if power > 0.0 else 1.0 - c
            parts[4, light, p] = lit * bright * h8
            parts[5, light, p] = lit * bright * h32
            parts[6, light, p] = lit * bright * (h32 * h32) ** 2


@FUSED.inlined
def _typical(rest: Doubles, counts: Doubles, point: int, order: Doubles) -> float:
    """Return what is typical of a point's residuals, of which normal and albedo have taken three."""
    many = 0
    for light in range(len(counts)):
        if counts[light, point] > 0.0:
            place = many
            while place > 0 and order[place - 1] > rest[light]:
                order[place] = order[place - 1]
                place -= 1
            order[place] = rest[light]
            many += 1
    return 1.48 * order[min((many + 3) // 2 - 1, many - 1)] if many else 0.0


@FUSED.kept
def solve_again(
    points: ShownPoints, g: Doubles, model: Doubles, typical: float, power: float, on_paint: bool, found: Doubles
) -> None:
    """Fill ``found`` with g (point, 3) after a step of reweighted Gauss and Newton under the model, ``power`` and
    ``on_paint`` as in ``fill_parts``."""
    measured, counts, towards, half, to_camera = points
    lights, soft = len(measured), 0.0 if power > 0.0 else model[2]
    normal, matrix, right = np.empty(3), np.empty(6), np.empty(3)
    rows, matte, rest, order = np.empty((lights, 3)), np.empty(lights), np.empty(lights), np.empty(lights)
    for p in range(len(g)):
        size = _size_and_normal(g, p, normal)
        bright, facing = min(typical / size, MOST_BRIGHT), _facing(to_camera, p, normal)
        many = 0.0
        for light in range(lights):
            many += counts[light, p]
            c, h = along_way(towards, light, p, normal), max(along_way(half, light, p, normal), 0.0)
            lit = 1.0 if c > 0.0 else 0.0
            towards_camera = _facing(to_camera, p, towards[light, p])
            added, added_by_c, added_by_facing = _roughness(c, facing, towards_camera)
            h7 = h * h * h * (h * h) ** 2
            h31 = h7 * ((h7 * h) ** 2 * (h7 * h))
            h127 = h31 * ((h31 * h) ** 2 * (h31 * h))
            much = lit * bright
            broad, middle, narrow = much * model[3], much * model[4], much * model[5]
            very_broad = lit * model[2] * (1.0 if on_paint else bright) * h ** (power - 1) if power > 0.0 else 0.0
            matte[light] = measured[light, p] - size * h * (very_broad + broad * h7 + middle * h31 + narrow * h127)
            by_h = power * very_broad + 8 * broad * h7 + 32 * middle * h31 + 128 * narrow * h127
            by_c = 1 - soft + 2 * model[0] * lit * c + model[1] * added_by_c
            by_facing = model[1] * added_by_facing
            shade = c + soft * (1 - c) + model[0] * lit * c * c + model[1] * added
            along = shade - by_c * c - by_h * h - by_facing * facing
            for i in range(3):
                rows[light, i] = along * normal[i] + by_c * towards[light, p, i] + by_h * half[light, p, i]
                rows[light, i] += by_facing * to_camera[p, i]
            rest[light] = abs(matte[light] - size * shade)
        spread = max(_typical(rest, counts, p, order), LEAST_SHARE * size)
        width = WIDTH * min(1.0, np.sqrt(FEW / max(many, FEW)))
        matrix[:], right[:] = 0.0, 0.0
        for light in range(lights):
            weight = counts[light, p] / (1 + (rest[light] / (width * spread)) ** 2)
            add_square(matrix, weight, rows[light, 0], rows[light, 1], rows[light, 2])
            for i in range(3):
                right[i] += weight * matte[light] * rows[light, i]
        more = 1e-6 * (matrix[0] + matrix[3] + matrix[5]) + 1e-12
        matrix[0], matrix[3], matrix[5] = matrix[0] + more, matrix[3] + more, matrix[5] + more
        solve_symmetric(matrix, right)
        far = np.sqrt((right[0] - g[p, 0]) ** 2 + (right[1] - g[p, 1]) ** 2 + (right[2] - g[p, 2]) ** 2)
        share = min(1.0, LONGEST_STEP * size / max(far, 1e-12))
        for i in range(3):
            found[p, i] = g[p, i] + share * (right[i] - g[p, i])
