"""Compiled part of the robust solver: what a subject that is not matte shows beyond n . l, what measurements leave of
that, and samples without it.

A measurement is s (|g| f(n) + q(n)), f matte and q what varnish mirrors.
"""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.model.arrays import Floats
from psvideo.solve.normals.loops.blocks import ABSENT, BLOCK, MISSING, ONE, TINY, ZERO, X, Y, Z
from psvideo.solve.normals.loops.near_kernel import at, of_light
from psvideo.solve.normals.robust.equations import OUT, VIEW_X, VIEW_Y, VIEW_Z
from psvideo.solve.normals.robust.room import (
    FACING,
    GAIN,
    HOLDS,
    KEPT,
    OF_LIGHT,
    PER_SIZE,
    SHINE,
    TO_X,
    TO_Y,
    TO_Z,
    UNIT_X,
    UNIT_Y,
    UNIT_Z,
    Room,
)
from psvideo.solve.normals.robust.weighing import BROAD, MIDDLE, NARROW, Weights

TWO, TO_BROAD, TO_MIDDLE, TO_NARROW = np.float32(2), np.float32(BROAD), np.float32(MIDDLE), np.float32(NARROW)
LEAST_FACING = np.float32(0.05)  # of the cosines that roughness is divided by
LEAST_BRIGHT = np.float32(0.55)  # of what is less, high powers are nothing, and numbers too small to be quick


@FUSED.called
def find_ways(room: Room, n: int) -> None:
    """What the model needs to know of the lights (light, 6, pixel): unit directions, what makes a unit vector of the
    sum with the camera's, strengths (0 of a copy), cosines to the way to the camera."""
    v = room.more
    for light in range(len(room.ways)):
        lamp, per, way = of_light(room.matrix, light), room.per_strength[light], room.ways[light]
        for i in range(n):
            (x, y, z), one = at(lamp, i), at(per, i)
            way[0, i], way[1, i], way[2, i] = x * one, y * one, z * one
            way[5, i] = x * one * v[VIEW_X + i] + y * one * v[VIEW_Y + i] + z * one * v[VIEW_Z + i]
            way[3, i] = ONE / np.sqrt(TWO + TWO * way[5, i])
            way[4, i] = ONE / one if x * x + y * y + z * z > ZERO else ZERO


@FUSED.inlined
def shine(weights: Weights, cosine: np.float32) -> tuple[np.float32, np.float32]:
    """What varnish mirrors at a cosine to half way, and what it gains with the cosine."""
    two = cosine * cosine
    four = two * two
    seven = four * two * cosine
    least = max(cosine, LEAST_BRIGHT)
    far_two = least * least
    far_four = far_two * far_two
    far_eight = far_four * far_four
    sixteen = far_eight * far_eight
    thirty_one = sixteen * far_eight * far_four * far_two * least
    thirty_two = sixteen * sixteen
    ninety_six = thirty_two * thirty_two * thirty_two
    much = weights.broad * four * four + weights.middle * thirty_two + weights.narrow * ninety_six * thirty_two
    more = weights.broad * TO_BROAD * seven + weights.middle * TO_MIDDLE * thirty_one
    more += weights.narrow * TO_NARROW * ninety_six * thirty_one
    return much, more


@FUSED.inlined
def rough_share(cosine: np.float32, facing: np.float32, towards: np.float32) -> np.float32:
    """What rough surfaces add, over the cosine to a light; ``facing`` and ``towards`` are the normal's and the light's
    cosines to the camera."""
    seen = max(facing, LEAST_FACING)
    beyond = max(towards - cosine * seen, ZERO) if cosine > ZERO else ZERO
    return np.float32(beyond / max(cosine, seen))


@FUSED.inlined
def fill_units(room: Room, n: int) -> None:
    """Unit normals of g, 1 / |g|, the ways to the camera, and the cosines between both."""
    kept, w, v = room.kept, room.planes, room.more
    for i in range(n):
        a, b, c = w[X + i], w[Y + i], w[Z + i]
        per_size = ONE / np.sqrt(max(a * a + b * b + c * c, TINY * TINY))
        kept[UNIT_X + i], kept[UNIT_Y + i], kept[UNIT_Z + i] = a * per_size, b * per_size, c * per_size
        kept[PER_SIZE + i] = per_size
        x, y, z = v[VIEW_X + i], v[VIEW_Y + i], v[VIEW_Z + i]
        kept[TO_X + i], kept[TO_Y + i], kept[TO_Z + i] = x, y, z
        kept[FACING + i] = kept[UNIT_X + i] * x + kept[UNIT_Y + i] * y + kept[UNIT_Z + i] * z


@FUSED.called
def fill_left_over(room: Room, lights: int, weights: Weights, n: int) -> None:
    """Absolute residuals under the model at g; OUT where a measurement is MISSING."""
    kept = room.kept
    fill_units(room, n)
    for light in range(lights):
        begin = BLOCK * (KEPT + OF_LIGHT * light)
        way, line, there, errors = room.ways[light], kept[begin:], room.measurements[light], room.errors[light]
        for i in range(n):
            cosine = kept[UNIT_X + i] * way[0, i] + kept[UNIT_Y + i] * way[1, i] + kept[UNIT_Z + i] * way[2, i]
            facing = kept[FACING + i]
            holds = kept[HOLDS + i] if cosine > ZERO else ZERO
            much, _ = shine(weights, max((cosine + facing) * way[3, i], ZERO))
            rough = weights.rough * rough_share(cosine, facing, way[5, i])
            matte = cosine + weights.soft * kept[HOLDS + i] * (ONE - cosine)
            matte += holds * (weights.curve * cosine + rough) * cosine
            line[i] = way[4, i] * (matte / kept[PER_SIZE + i] + holds * much)
        for i in range(n):
            error = abs(there[i] - line[i])
            errors[i] = error if there[i] > ABSENT else OUT


@FUSED.called
def take_off(room: Room, lights: int, weights: Weights, n: int) -> None:
    """Leave of every sample what a matte surface would show: highlights are alike in all channels, the curve is not.

    The unit normals, and how they face the camera, are those that ``fill_gradient`` left.
    """
    ways, kept, values = room.ways, room.kept, room.values
    channels = len(values) // len(ways)
    for light in range(lights):
        way = ways[light]
        for i in range(n):
            facing = kept[FACING + i]
            cosine = kept[UNIT_X + i] * way[0, i] + kept[UNIT_Y + i] * way[1, i] + kept[UNIT_Z + i] * way[2, i]
            half = max((cosine + facing) * way[3, i], ZERO)
            holds = kept[HOLDS + i] if cosine > ZERO else ZERO
            much, _ = shine(weights, half)
            kept[SHINE + i] = holds * much * way[4, i]
            share = rough_share(cosine, facing, way[5, i])
            kept[GAIN + i] = ONE / (ONE + holds * (weights.curve * cosine + weights.rough * share))
        for channel in range(channels):
            plane = values[light * channels + channel]
            for i in range(n):
                without = (plane[i] - kept[SHINE + i]) * kept[GAIN + i]
                plane[i] = without if plane[i] > ABSENT else MISSING
    if weights.soft > ZERO:
        _take_off_soft(ways, lights, weights, kept, values, n)


@FUSED.called
def _take_off_soft(ways: Floats, lights: int, weights: Weights, kept: Floats, values: Floats, n: int) -> None:
    """Leave of samples without highlights what a surface would show that lets no light through."""
    channels = len(values) // len(ways)
    for light in range(lights):
        way = ways[light]
        for i in range(n):
            cosine = kept[UNIT_X + i] * way[0, i] + kept[UNIT_Y + i] * way[1, i] + kept[UNIT_Z + i] * way[2, i]
            soft = weights.soft * kept[HOLDS + i]
            kept[GAIN + i] = max(cosine, ZERO) / max(cosine + soft * (ONE - cosine), TINY)
        for channel in range(channels):
            plane = values[light * channels + channel]
            for i in range(n):
                plane[i] = plane[i] * kept[GAIN + i] if plane[i] > ABSENT else MISSING
