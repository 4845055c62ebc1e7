"""Compiled part of the robust solver: what a measurement of a subject that is not matte gains with g.

A measurement is s (|g| f(n) + q(n)), as in ``reflected_light``. Without s q it is J g exactly, with its gradient J
(light, 3, pixel) at g.
"""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.model.arrays import Floats
from psvideo.solve.normals.loops.blocks import ABSENT, BLOCK, MISSING, ONE, ZERO
from psvideo.solve.normals.robust.reflected_light import LEAST_FACING, TWO, fill_units, rough_share, shine
from psvideo.solve.normals.robust.room import (
    FACING,
    HOLDS,
    KEPT,
    OF_LIGHT,
    PER_SIZE,
    TO_X,
    TO_Y,
    TO_Z,
    UNIT_X,
    UNIT_Y,
    UNIT_Z,
    Room,
)
from psvideo.solve.normals.robust.weighing import Weights


@FUSED.called
def fill_gradient(room: Room, lights: int, weights: Weights, n: int) -> None:
    """What each measurement gains by a little more of g, in each direction, at g; and measurements without shine.

    The long loop writes into ``kept`` alone, so that the compiler sees that nothing overlaps and makes vectors of it.
    """
    kept = room.kept
    fill_units(room, n)
    plain = weights.rough == ZERO and weights.soft == ZERO
    for light in range(lights):
        begin = BLOCK * (KEPT + OF_LIGHT * light)
        way, line = room.ways[light], kept[begin : begin + BLOCK * OF_LIGHT]
        if plain:
            _fill_shining(line, way, kept, weights, n)
        else:
            _fill_line(line, way, kept, weights, n)
        there, without = room.measurements[light], room.matte[light]
        for i in range(n):
            without[i] = there[i] - line[3 * BLOCK + i] if there[i] > ABSENT else MISSING


@FUSED.inlined
def _fill_line(line: Floats, way: Floats, kept: Floats, weights: Weights, n: int) -> None:
    """What measurements of one light gain in each direction, and their shine."""
    for i in range(n):
        a, b, c, per_size = kept[UNIT_X + i], kept[UNIT_Y + i], kept[UNIT_Z + i], kept[PER_SIZE + i]
        dx, dy, dz, to_half, strength, towards = way[0, i], way[1, i], way[2, i], way[3, i], way[4, i], way[5, i]
        x, y, z, facing = kept[TO_X + i], kept[TO_Y + i], kept[TO_Z + i], kept[FACING + i]
        cosine = a * dx + b * dy + c * dz
        half = max((cosine + facing) * to_half, ZERO)
        holds = kept[HOLDS + i] if cosine > ZERO else ZERO
        much, more = shine(weights, half)
        curve, by_half = weights.curve * holds, more * holds * per_size
        added, rough_by_cosine, by_facing = _rough(cosine, facing, towards)
        rough, soft = weights.rough * holds, weights.soft * kept[HOLDS + i]
        by_cosine = ONE - soft + TWO * curve * cosine + rough * rough_by_cosine
        by_facing *= rough
        along = cosine + soft * (ONE - cosine) + curve * cosine * cosine + rough * added
        along -= by_cosine * cosine + by_half * half + by_facing * facing
        by_half *= to_half
        by_light = by_cosine + by_half
        line[i] = strength * (along * a + by_light * dx + by_half * x + by_facing * x)
        line[BLOCK + i] = strength * (along * b + by_light * dy + by_half * y + by_facing * y)
        line[2 * BLOCK + i] = strength * (along * c + by_light * dz + by_half * z + by_facing * z)
        line[3 * BLOCK + i] = strength * holds * much


@FUSED.inlined
def _fill_shining(line: Floats, way: Floats, kept: Floats, weights: Weights, n: int) -> None:
    """As ``_fill_line``, to the same bytes, of a subject that is neither rough nor soft, as most glossy ones: that
    takes no division, and two thirds of the steps."""
    for i in range(n):
        a, b, c, per_size = kept[UNIT_X + i], kept[UNIT_Y + i], kept[UNIT_Z + i], kept[PER_SIZE + i]
        dx, dy, dz, to_half, strength = way[0, i], way[1, i], way[2, i], way[3, i], way[4, i]
        x, y, z, facing = kept[TO_X + i], kept[TO_Y + i], kept[TO_Z + i], kept[FACING + i]
        cosine = a * dx + b * dy + c * dz
        half = max((cosine + facing) * to_half, ZERO)
        holds = kept[HOLDS + i] if cosine > ZERO else ZERO
        much, more = shine(weights, half)
        curve, by_half = weights.curve * holds, more * holds * per_size
        by_cosine = ONE + TWO * curve * cosine
        along = cosine + curve * cosine * cosine
        along -= by_cosine * cosine + by_half * half
        by_half *= to_half
        by_light = by_cosine + by_half
        line[i] = strength * (along * a + by_light * dx + by_half * x)
        line[BLOCK + i] = strength * (along * b + by_light * dy + by_half * y)
        line[2 * BLOCK + i] = strength * (along * c + by_light * dz + by_half * z)
        line[3 * BLOCK + i] = strength * holds * much


@FUSED.inlined
def _rough(cosine: np.float32, facing: np.float32, towards: np.float32) -> tuple[np.float32, np.float32, np.float32]:
    """What rough surfaces add, and what it gains with the cosines to the light and to the camera."""
    share = rough_share(cosine, facing, towards)
    back = ONE if share > ZERO else ZERO
    seen = max(facing, LEAST_FACING)
    over = cosine > seen
    by_cosine = -seen if over else towards / seen - TWO * cosine
    by_facing = -cosine if over else -cosine * towards / (seen * seen)
    return share * cosine, back * by_cosine, back * by_facing
