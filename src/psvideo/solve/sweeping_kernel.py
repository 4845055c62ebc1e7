"""The compiled loop of sweeping: how well every distance explains what near lights show in a point."""

from typing import NamedTuple

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.model.arrays import Doubles
from psvideo.model.irradiance.near_light import LEAST_COSINE

ROUNDS = 4
"""Of weighing down what does not fit."""
TINY = 1e-12
FACES_AWAY = -0.2
"""What is seen faces the camera: a normal whose cosine to it is below this belongs to no distance. Lamps that stand in
a plane explain a surface behind it and its mirror image before it alike, whose normals face away."""


class SweptLamps(NamedTuple):
    """The lights: ``positions`` (light, 3) in metres, of a distant one its direction; ``axes`` (light, 3), the ways
    they shine; and ``sent`` (light, 3), intensity, anisotropy, and 1 for a near light."""

    positions: Doubles
    axes: Doubles
    sent: Doubles


@FUSED.kept
def sweep_points(
    light: Doubles, rays: Doubles, plane_m: Doubles, ratios: Doubles, lamps: SweptLamps, least_lit: int,
    noise: float, own: float, costs: Doubles,
) -> None:  # fmt: skip
    """Fill ``costs`` (ratio, point): the mean of log(1 + r^2) over the lights that reach a point, r what the best
    normal leaves of their light in units of its error; 0 where too few do.

    light: (point, light), below 0 where it is not known. rays: (point, 3), to depth 1. plane_m: (point,), the depth of
    ratio 1. least_lit: how many lights must reach a point. noise: of dark light; own: what else a point's brightest
    light is off by, as a share.
    """
    positions, axes, sends = lamps
    points, lights = light.shape
    vectors, weight, left = np.zeros((lights, 3)), np.zeros(lights), np.zeros(lights)
    for point in range(points):
        lit, most = 0, 0.0
        for k in range(lights):
            lit += light[point, k] > 6 * noise
            most = max(most, light[point, k])
        if lit < least_lit:
            costs[:, point] = 0.0
            continue
        off = np.sqrt(noise * noise + own * own * most * most)
        for n in range(len(ratios)):
            depth, mean = plane_m[point] * ratios[n], 0.0
            for k in range(lights):
                x, y, z, sent = positions[k, 0], positions[k, 1], positions[k, 2], sends[k, 0]
                if sends[k, 2] > 0:
                    x, y, z = x - depth * rays[point, 0], y - depth * rays[point, 1], z - depth * rays[point, 2]
                    away = np.sqrt(x * x + y * y + z * z)
                    x, y, z = x / away, y / away, z / away
                    sent /= away * away
                    if sends[k, 1] > 0:
                        sent *= max(-(x * axes[k, 0] + y * axes[k, 1] + z * axes[k, 2]), LEAST_COSINE) ** sends[k, 1]
                vectors[k, 0], vectors[k, 1], vectors[k, 2] = x * sent, y * sent, z * sent
                mean += sent / lights
                weight[k] = 1.0 if light[point, k] > 6 * noise else 0.0
            vectors /= mean  # what lamps send is in any unit, and TINY in none
            total = 0.0
            for _ in range(ROUNDS):
                _left_over(light[point], vectors, weight, rays[point], left)
                total = 0.0
                for k in range(lights):
                    if light[point, k] > 6 * noise:
                        square = (left[k] / off) ** 2
                        total += np.log1p(square)
                        weight[k] = 1.0 / (1.0 + 0.25 * square)
            costs[n, point] = total / lit


@FUSED.inlined
def _left_over(light: Doubles, vectors: Doubles, weight: Doubles, ray: Doubles, left: Doubles) -> None:
    """Fill ``left`` with what weighted least squares leaves of the light, by Cramer's rule: all of it where the normal
    faces away along the ``ray`` from the camera."""
    xx = xy = xz = yy = yz = zz = a = b = c = 0.0
    for k in range(len(light)):
        w, x, y, z = weight[k], vectors[k, 0], vectors[k, 1], vectors[k, 2]
        xx, xy, xz = xx + w * x * x, xy + w * x * y, xz + w * x * z
        yy, yz, zz = yy + w * y * y, yz + w * y * z, zz + w * z * z
        a, b, c = a + w * x * light[k], b + w * y * light[k], c + w * z * light[k]
    one, two, three = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    det = max(xx * one + xy * two + xz * three, TINY)
    gx = (one * a + two * b + three * c) / det
    gy = (two * a + (xx * zz - xz * xz) * b + (xy * xz - xx * yz) * c) / det
    gz = (three * a + (xy * xz - xx * yz) * b + (xx * yy - xy * xy) * c) / det
    along = gx * ray[0] + gy * ray[1] + gz * ray[2]
    squares = (gx * gx + gy * gy + gz * gz) * (ray[0] * ray[0] + ray[1] * ray[1] + ray[2] * ray[2])
    if along > 0.0 and along * along > FACES_AWAY * FACES_AWAY * squares:
        gx, gy, gz = 0.0, 0.0, 0.0
    for k in range(len(light)):
        left[k] = light[k] - (vectors[k, 0] * gx + vectors[k, 1] * gy + vectors[k, 2] * gz)
