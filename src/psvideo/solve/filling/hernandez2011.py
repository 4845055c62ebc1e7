"""The normal of a pixel that two lights reach, or one, with what its neighbours say of it; compiled.

Two lights leave one line g0 + t d for albedo * normal; the albedo of solved neighbours of the same colour gives its
length, their normals the side (C. Hernandez, G. Vogiatzis, R. Cipolla, "Overcoming shadows in 3-source photometric
stereo", PAMI 33(2), 2011, section 4). One light leaves a cone, on which the normal nearest to the neighbours' is taken.
"""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.solve.filling.looking import Said
from psvideo.solve.normals.loops.blocks import ONE, ZERO

ALBEDO_SHARE = np.float32(0.1)  # how well the neighbours' albedo is that of a pixel,
OTHER_PAINT = np.float32(3.0)  # unless it is off by more than so many of that: then another paint is as likely
BENT = np.float32(np.radians(15.0))  # how well the neighbours' normal is
LEVEL = np.float32(np.radians(8.0))  # how well what they know of the surface across the way to it is
BEYOND = np.float32(0.1)  # what faces away from the camera costs: squared over this
ANGLES = np.radians(np.arange(-88.0, 89.0, 2.0)).astype(np.float32)
ANGLE_STEP = np.float32(np.radians(2.0))
COSINES, SINES = np.cos(ANGLES), np.sin(ANGLES)
LOG_COSINES = np.log(COSINES)
HALF, TWO = np.float32(0.5), np.float32(2)
TINY, FAR = np.float32(1e-6), np.float32(1e30)
TURN = np.float32(2 * np.pi)
LEAST_VOLUME = np.float32(0.05)  # of three unit vectors to lights
LEAST_COSINE, LEAST_SINE_SQUARED = np.float32(0.05), np.float32(1e-3)


@FUSED.inlined
def from_two(
    s: Said, pixel: int, nx: np.float32, ny: np.float32, nz: np.float32, albedo: np.float32,
    tx: np.float32, ty: np.float32, tz: np.float32,
) -> tuple[np.float32, np.float32, np.float32, np.float32]:  # fmt: skip
    """The normal of those that two lights leave that fits the neighbours' normal (nx, ny, nz) and albedo best, and
    is level along the vector (tx, ty, tz) in the surface that they know.

    Where there are no neighbours, ``albedo`` is 0 and does not count. Returned with the albedo.
    """
    ax, ay, az = s.towards[pixel, 0, 0], s.towards[pixel, 0, 1], s.towards[pixel, 0, 2]
    bx, by, bz = s.towards[pixel, 1, 0], s.towards[pixel, 1, 1], s.towards[pixel, 1, 2]
    first, second = s.bright[pixel, 0], s.bright[pixel, 1]
    cosine = ax * bx + ay * by + az * bz
    sine_squared = max(ONE - cosine * cosine, LEAST_SINE_SQUARED)
    p, q = (first - cosine * second) / sine_squared, (second - cosine * first) / sine_squared
    gx, gy, gz = p * ax + q * bx, p * ay + q * by, p * az + q * bz
    length = np.sqrt(gx * gx + gy * gy + gz * gz)
    one = ONE / max(length, TINY)
    gx, gy, gz = gx * one, gy * one, gz * one
    one = ONE / np.sqrt(sine_squared)
    dx, dy, dz = (ay * bz - az * by) * one, (az * bx - ax * bz) * one, (ax * by - ay * bx) * one
    guess = np.arctan2(nx * dx + ny * dy + nz * dz, nx * gx + ny * gy + nz * gz)
    offset = np.log(max(length, TINY)) - np.log(albedo) if albedo > ZERO else ZERO
    per_albedo = ONE / ALBEDO_SHARE if albedo > ZERO else ZERO
    level_g, level_d = (gx * tx + gy * ty + gz * tz) / LEVEL, (dx * tx + dy * ty + dz * tz) / LEVEL
    best, least, before, last, after, closing = 0, FAR, ZERO, ZERO, ZERO, False
    for k in range(len(ANGLES)):
        apart = abs(ANGLES[k] - guess)
        apart = min(apart, TURN - apart)
        away = max(-(gz * COSINES[k] + dz * SINES[k]), ZERO) / BEYOND
        level = level_g * COSINES[k] + level_d * SINES[k]
        paint = ((offset - LOG_COSINES[k]) * per_albedo) ** 2
        paint /= ONE + paint / (OTHER_PAINT * OTHER_PAINT)
        cost = paint + (apart / BENT) ** 2 + away * away + level * level
        if closing:
            after, closing = cost, False
        if cost < least:
            best, least, before, closing = k, cost, last, True
        last = cost
    angle = ANGLES[best]
    if 0 < best < len(ANGLES) - 1:
        curve = before - TWO * least + after
        angle += ANGLE_STEP * HALF * (before - after) / max(curve, TINY)
    c, d = np.cos(angle), np.sin(angle)
    found = length / max(c, LEAST_COSINE)
    if albedo > ZERO and abs(np.log(max(found, TINY) / albedo)) < OTHER_PAINT * ALBEDO_SHARE:
        found = min(max(found, albedo * (ONE - TWO * ALBEDO_SHARE)), albedo * (ONE + TWO * ALBEDO_SHARE))
    return gx * c + dx * d, gy * c + dy * d, gz * c + dz * d, found


@FUSED.inlined
def from_three(
    s: Said, pixel: int, nx: np.float32, ny: np.float32, nz: np.float32, albedo: np.float32,
    tx: np.float32, ty: np.float32, tz: np.float32,
) -> tuple[np.float32, np.float32, np.float32, np.float32]:  # fmt: skip
    """The normal and albedo that three lights give, where a fourth is left out; where these stand nearly in a plane, or
    give what faces away from the camera, that of the two brightest and the neighbours."""
    first, second, third = s.bright[pixel, 0], s.bright[pixel, 1], s.bright[pixel, 2]
    ax, ay, az = s.towards[pixel, 0, 0], s.towards[pixel, 0, 1], s.towards[pixel, 0, 2]
    bx, by, bz = s.towards[pixel, 1, 0], s.towards[pixel, 1, 1], s.towards[pixel, 1, 2]
    cx, cy, cz = s.towards[pixel, 2, 0], s.towards[pixel, 2, 1], s.towards[pixel, 2, 2]
    ux, uy, uz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
    volume = ax * ux + ay * uy + az * uz
    if abs(volume) < LEAST_VOLUME:
        return from_two(s, pixel, nx, ny, nz, albedo, tx, ty, tz)
    one = ONE / volume
    vx, vy, vz = cy * az - cz * ay, cz * ax - cx * az, cx * ay - cy * ax
    wx, wy, wz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    gx, gy = (first * ux + second * vx + third * wx) * one, (first * uy + second * vy + third * wy) * one
    gz = (first * uz + second * vz + third * wz) * one
    if not gz > ZERO:
        return from_two(s, pixel, nx, ny, nz, albedo, tx, ty, tz)
    length = np.sqrt(gx * gx + gy * gy + gz * gz)
    one = ONE / length
    return gx * one, gy * one, gz * one, length


@FUSED.inlined
def from_one(
    s: Said, pixel: int, nx: np.float32, ny: np.float32, nz: np.float32, albedo: np.float32
) -> tuple[np.float32, np.float32, np.float32, np.float32]:
    """The normal on the one light's cone that is nearest to the neighbours', with the albedo.

    Where there are no neighbours the normal stays and gives the albedo.
    """
    x, y, z, bright = s.towards[pixel, 0, 0], s.towards[pixel, 0, 1], s.towards[pixel, 0, 2], s.bright[pixel, 0]
    along = nx * x + ny * y + nz * z
    if not albedo > ZERO:
        return nx, ny, nz, bright / max(along, LEAST_COSINE)
    cosine = min(bright / albedo, ONE)
    tx, ty, tz = nx - along * x, ny - along * y, nz - along * z
    one = np.sqrt(max(ONE - cosine * cosine, ZERO) / max(tx * tx + ty * ty + tz * tz, TINY))
    cx, cy, cz = x * cosine + tx * one, y * cosine + ty * one, z * cosine + tz * one
    if cz < ZERO:
        one = ONE / np.sqrt(max(cx * cx + cy * cy, TINY))
        cx, cy, cz = cx * one, cy * one, ZERO
    return cx, cy, cz, albedo
