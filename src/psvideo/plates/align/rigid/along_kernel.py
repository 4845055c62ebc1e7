"""The compiled loop over a body's points: what one normal explains of plates along the ways that points go."""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import lent
from psvideo.model.arrays import Floats
from psvideo.model.irradiance.near_light import LEAST_COSINE as FAINTEST
from psvideo.plates.align.by_surface import CLIPPED, LEAST_LIT

SOLVED = 3
"""This many plates are explained by a normal and an albedo, whatever they show."""
UNLIKE = np.float32(0.1)
"""What no surface explains, as a share of the mean light, counts half where it is so much."""
FLAT = np.float32(1e-4)
"""How firmly a normal is held to 0, as a share of what all plates tell of it."""
PLANES = 6
"""What is told of every plate at a point: what is left, how that grows to the right and down, and with the turn about
three axes."""
OF_PLATE = 4
"""What is told of every plate, its time and how it lights a normal; more only of near lights."""
LEAST_COSINE = np.float32(FAINTEST)
ZERO, ONE, HALF = np.float32(0), np.float32(1), np.float32(0.5)


@FUSED.inlined
def _shown(picture: Floats, row: np.float32, col: np.float32, light: Floats, plate: int) -> None:
    """Fill ``light`` (3.., plate) with what a picture (row, col, 3) shows at a place; beyond the border, the border."""
    row = min(max(row, ZERO), np.float32(picture.shape[0] - 1))
    col = min(max(col, ZERO), np.float32(picture.shape[1] - 1))
    whole_row, whole_col = int(row), int(col)
    top, left = np.uintp(whole_row), np.uintp(whole_col)  # unsigned: no place is counted from the end
    below = min(top + np.uintp(1), np.uintp(picture.shape[0] - 1))
    right = min(left + np.uintp(1), np.uintp(picture.shape[1] - 1))
    down, across = row - np.float32(whole_row), col - np.float32(whole_col)
    for plane in range(3):
        upper = picture[top, left, plane] * (ONE - across) + picture[top, right, plane] * across
        lower = picture[below, left, plane] * (ONE - across) + picture[below, right, plane] * across
        light[plane, plate] = upper * (ONE - down) + lower * down


@FUSED.inlined
def _shine(near: Floats, right: np.float32, down: np.float32, rises: np.float32, lamps: Floats, plate: int) -> None:
    """Fill ``lamps`` (plate, 1..3) with how a near light lights a place that so much ``rises`` above the ground's
    middle; ``near`` (20,) is the light, as told in ``near_plates``, and how the body turned on since its plate."""
    farther = ONE - rises * near[10]
    x = near[1] - (right - near[8]) * farther
    y = near[2] - (down - near[9]) * farther
    z = near[3] - rises
    square = x * x + y * y + z * z
    sends = near[0] / (square * np.sqrt(square))
    if near[7] != ZERO:
        cosine = -(x * near[4] + y * near[5] + z * near[6]) / np.sqrt(square)
        sends *= max(cosine, LEAST_COSINE) ** near[7]
    for axis in range(3):
        turn = 11 + 3 * axis
        lamps[plate, 1 + axis] = sends * (near[turn] * x + near[turn + 1] * y + near[turn + 2] * z)


@FUSED.inlined
def _inverse(lamps: Floats, lit: Floats, inverse: Floats) -> None:
    """Fill ``inverse`` (6,) with that of the sums of squares of ``lamps`` (plate, 4: span, right, down, near) that are
    ``lit`` (plate,), 1 or 0: its numbers right of and on the diagonal."""
    a, b, c, d, e, f, every = ZERO, ZERO, ZERO, ZERO, ZERO, ZERO, ZERO
    for plate in range(lamps.shape[0]):
        x, y, z, own = lamps[plate, 1], lamps[plate, 2], lamps[plate, 3], lit[plate]
        a += own * x * x
        b += own * x * y
        c += own * x * z
        d += own * y * y
        e += own * y * z
        f += own * z * z
        every += x * x + y * y + z * z
    a, d, f = a + FLAT * every, d + FLAT * every, f + FLAT * every
    one, two, three = d * f - e * e, c * e - b * f, b * e - c * d
    share = ONE / (a * one + b * two + c * three)
    inverse[0], inverse[1], inverse[2] = one * share, two * share, three * share
    inverse[3], inverse[4], inverse[5] = (a * f - c * c) * share, (b * c - a * e) * share, (a * d - b * b) * share


@FUSED.inlined
def _without(lamps: Floats, lit: Floats, inverse: Floats, light: Floats, normal: Floats) -> None:
    """Take from ``light`` (plate,) what a surface explains of it, whose ``normal`` (3,) times albedo is filled in; what
    is not lit becomes 0."""
    x, y, z = ZERO, ZERO, ZERO
    for plate in range(light.shape[0]):
        own = lit[plate] * light[plate]
        x += own * lamps[plate, 1]
        y += own * lamps[plate, 2]
        z += own * lamps[plate, 3]
    normal[0] = inverse[0] * x + inverse[1] * y + inverse[2] * z
    normal[1] = inverse[1] * x + inverse[3] * y + inverse[4] * z
    normal[2] = inverse[2] * x + inverse[4] * y + inverse[5] * z
    for plate in range(light.shape[0]):
        lamp = normal[0] * lamps[plate, 1] + normal[1] * lamps[plate, 2] + normal[2] * lamps[plate, 3]
        light[plate] = lit[plate] * (light[plate] - lamp)


@FUSED.inlined
def _turning(lamps: Floats, normal: Floats, light: Floats) -> None:
    """Fill planes 3 to 5 of ``light`` (6, plate) with how much less plates show of a normal as its body turns on about
    the axes right, down and near."""
    for plate in range(lamps.shape[0]):
        span, x, y, z = lamps[plate, 0], lamps[plate, 1], lamps[plate, 2], lamps[plate, 3]
        light[3, plate] = span * (z * normal[1] - y * normal[2])
        light[4, plate] = span * (x * normal[2] - z * normal[0])
        light[5, plate] = span * (y * normal[0] - x * normal[1])


@FUSED.kept
def along_points(
    pictures: Floats, plates: Floats, places: Floats, first: int, last: int, left: Floats, told: Floats
) -> None:
    """Fill ``left`` (2, point) and ``told`` (plane, plate, point) of some points.

    ``pictures`` (plate, row, col, 3) are light, and how much it grows to the right and down; ``plates`` (plate, 4) are
    the times from them to the instant, and how they light normals there along right, down and near; (plate, 24) where
    some are of near lights, which ``near_plates`` tells. ``places`` (7, point) are columns and rows, velocities right
    and down, how fast these change, and how much nearer than the ground's middle they are. ``left`` is what no normal
    explains, 0 to 1, and of how many plates more than SOLVED it is told, 0 where not of any; ``told`` has PLANES, as
    shares of the mean light, or none.
    """
    picture, given, place, rest, made = lent(pictures), lent(plates), lent(places), lent(left), lent(told)
    lamp, near = given[:, :OF_PLATE].copy(), given.shape[1] > OF_PLATE
    light, lit = np.empty((PLANES, lamp.shape[0]), np.float32), np.empty(lamp.shape[0], np.float32)
    normal, other, inverse = np.empty(3, np.float32), np.empty(3, np.float32), np.empty(6, np.float32)
    for point in range(first, last):
        count, total = 0, ZERO
        for plate in range(lamp.shape[0]):
            span = lamp[plate, 0]
            col = place[0, point] - span * (place[2, point] - HALF * span * place[4, point])
            row = place[1, point] - span * (place[3, point] - HALF * span * place[5, point])
            _shown(picture[plate], row, col, light, plate)
            if near and given[plate, OF_PLATE] != ZERO:
                _shine(given[plate, OF_PLATE:], col, row, place[6, point], lamp, plate)
            seen = LEAST_LIT < light[0, plate] < CLIPPED
            lit[plate] = ONE if seen else ZERO
            count += seen
            total += lit[plate] * light[0, plate]
        size = ONE / max(total / np.float32(max(count, 1)), LEAST_LIT)
        _inverse(lamp, lit, inverse)
        _without(lamp, lit, inverse, light[0], normal)
        square = ZERO
        for plate in range(lamp.shape[0]):
            square += light[0, plate] * light[0, plate]
        square *= size * size / np.float32(max(count - SOLVED, 1))
        rest[0, point] = square / (square + UNLIKE * UNLIKE)
        rest[1, point] = np.float32(max(count - SOLVED, 0))
        if made.shape[0] == 0:
            continue
        for plate in range(lamp.shape[0]):
            light[1, plate] *= -lamp[plate, 0]
            light[2, plate] *= -lamp[plate, 0]
        _turning(lamp, normal, light)
        for plane in range(1, PLANES):
            _without(lamp, lit, inverse, light[plane], other)
        for plane in range(PLANES):
            for plate in range(lamp.shape[0]):
                made[plane, plate, point] = size * light[plane, plate]
