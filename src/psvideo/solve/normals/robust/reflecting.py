"""Compiled part of the robust solver: pixels solved again under what their subject reflects beyond n . l.

A measurement is s (|g| f(n) + q(n)), f matte and q what varnish mirrors. Without s q it is J g exactly, with its
gradient J (light, 3, pixel) at g: a step of Gauss and Newton is what reweighted least squares does with J as the
lights.
"""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.model.arrays import Floats
from psvideo.solve.normals.loops.blocks import ABSENT, BLOCK, COUNT, MISSING, ONE, TINY, ZERO, X, Y, Z
from psvideo.solve.normals.loops.near_kernel import at, of_light
from psvideo.solve.normals.robust.any_lights import add_weighted, fill_residuals, find_scale
from psvideo.solve.normals.robust.equations import OUT, SCALE, VIEW_X, VIEW_Y, VIEW_Z, solve_equations
from psvideo.solve.normals.task import BROAD, MIDDLE, NARROW, Weights

STEPS = 4
FARTHEST = np.float32(0.3)  # so far, beside its length, does g go in one step
FROM_MEASUREMENTS = np.float32(5)  # of four any model explains too much
CLEARLY = np.float32(0.2)  # where a pixel's residuals come down by so much, in sum, the model holds; by less, in part
FAR_OFF = np.float32(1.5)  # the residual, over the pixel's own without the model, that counts half
TWO, TO_BROAD, TO_MIDDLE, TO_NARROW = np.float32(2), np.float32(BROAD), np.float32(MIDDLE), np.float32(NARROW)
LEAST_FACING = np.float32(0.05)  # of the cosines that roughness is divided by
LEAST_BRIGHT = np.float32(0.55)  # of what is less, high powers are nothing, and numbers too small to be quick
_MATTE_X, _MATTE_Y, _MATTE_Z, _BEFORE, _AFTER, _SPREAD, HOLDS, _OLD_X, _OLD_Y, _OLD_Z = (BLOCK * k for k in range(10))
_UNIT_X, _UNIT_Y, _UNIT_Z, _PER_SIZE, _GAIN, _SHINE = (BLOCK * k for k in range(10, 16))
_TO_X, _TO_Y, _TO_Z, _FACING = (BLOCK * k for k in range(16, 20))
KEPT, OF_LIGHT = 20, 4
"""Planes that ``reflecting`` keeps of a block: this many, then this many per light, its gradient and its shine."""
_SOUND_SQUARED = np.float32(1e4)


@FUSED.called
def find_ways(matrix: Floats, per_strength: Floats, v: Floats, ways: Floats, n: int) -> None:
    """What the model needs to know of the lights (light, 6, pixel): unit directions, what makes a unit vector of the
    sum with the camera's, strengths (0 of a copy), cosines to the way to the camera."""
    for light in range(len(ways)):
        lamp, per, way = of_light(matrix, light), per_strength[light], ways[light]
        for i in range(n):
            (x, y, z), one = at(lamp, i), at(per, i)
            way[0, i], way[1, i], way[2, i] = x * one, y * one, z * one
            way[5, i] = x * one * v[VIEW_X + i] + y * one * v[VIEW_Y + i] + z * one * v[VIEW_Z + i]
            way[3, i] = ONE / np.sqrt(TWO + TWO * way[5, i])
            way[4, i] = ONE / one if x * x + y * y + z * z > ZERO else ZERO


@FUSED.called
def reflect(
    matrix: Floats, ways: Floats, lights: int, weights: Weights, kept: Floats, matte: Floats,
    w: Floats, v: Floats, m: Floats, e: Floats, n: int,
) -> None:  # fmt: skip
    """Solve solved pixels again under the subject's model, where that explains them better.

    How far the model holds in each is left in the plane HOLDS of ``kept``. Nothing it takes has a type that pictures
    decide, so that it is compiled once for all of them.
    """
    noise, least = weights.noise, weights.signal_noise
    gradient = kept[BLOCK * KEPT :].reshape(len(ways), OF_LIGHT, BLOCK)
    find_scale(matrix, noise, least, w, v, m, e, n)
    for i in range(n):
        kept[_MATTE_X + i], kept[_MATTE_Y + i], kept[_MATTE_Z + i] = w[X + i], w[Y + i], w[Z + i]
        kept[_SPREAD + i], kept[HOLDS + i] = ONE / (FAR_OFF * v[SCALE + i]), ONE
    _add_up(kept, _BEFORE, e, n)
    for step in range(STEPS):
        _fill_gradient(ways, lights, weights, kept, matte, w, v, m, n)
        for i in range(n):
            kept[_OLD_X + i], kept[_OLD_Y + i], kept[_OLD_Z + i] = w[X + i], w[Y + i], w[Z + i]
        if step == 0:
            find_scale(gradient, noise, least, w, v, matte, e, n)
        else:
            fill_residuals(gradient, w, matte, e, n)
        add_weighted(gradient, weights.tukey, weights.width, False, w, v, matte, e, n)
        solve_equations(w, n, _SOUND_SQUARED, True)
        _shorten(kept, w, n)
    _fill_gradient(ways, lights, weights, kept, matte, w, v, m, n)
    fill_residuals(gradient, w, matte, e, n)
    _add_up(kept, _AFTER, e, n)
    unseen = ONE if weights.rough > ZERO or weights.soft > ZERO else ZERO
    more = ONE if weights.soft > ZERO else ZERO  # it turns normals where residuals do not show it, too
    for i in range(n):
        gained = (kept[_BEFORE + i] - kept[_AFTER + i]) / (CLEARLY * max(kept[_BEFORE + i], TINY))
        gained += more
        holds = min(max(gained, ZERO), ONE) if w[COUNT + i] >= FROM_MEASUREMENTS else unseen
        kept[HOLDS + i] = holds
        w[X + i] = kept[_MATTE_X + i] + holds * (w[X + i] - kept[_MATTE_X + i])
        w[Y + i] = kept[_MATTE_Y + i] + holds * (w[Y + i] - kept[_MATTE_Y + i])
        w[Z + i] = kept[_MATTE_Z + i] + holds * (w[Z + i] - kept[_MATTE_Z + i])


@FUSED.called
def weigh_reflecting(
    ways: Floats, lights: int, weights: Weights, share: np.float32, kept: Floats, matte: Floats,
    w: Floats, v: Floats, values: Floats, m: Floats, e: Floats, n: int,
) -> None:  # fmt: skip
    """SCALE and the weighted normal equations under the model as far as it holds; values (light * channel, pixel) are
    left without what the model adds, for the albedo."""
    gradient = kept[BLOCK * KEPT :].reshape(len(ways), OF_LIGHT, BLOCK)
    _fill_gradient(ways, lights, weights, kept, matte, w, v, m, n)
    find_scale(gradient, weights.least, share, w, v, matte, e, n)
    add_weighted(gradient, False, TWO, True, w, v, matte, e, n)
    _take_off(ways, lights, weights, kept, values, n)
    if weights.soft > ZERO:
        _take_off_soft(ways, lights, weights, kept, values, n)


@FUSED.called
def _add_up(kept: Floats, plane: int, e: Floats, n: int) -> None:
    """Add up residuals, each as a share of one: a measurement that is far off counts as one, however far."""
    kept[plane : plane + n] = ZERO
    for light in range(len(e)):
        for i in range(n):
            error = e[light, i]
            share = error * kept[_SPREAD + i]
            square = share * share
            kept[plane + i] += square / (ONE + square) if error < OUT else ZERO


@FUSED.inlined
def _shorten(kept: Floats, w: Floats, n: int) -> None:
    """No step is longer than a share of g."""
    for i in range(n):
        a, b, c = kept[_OLD_X + i], kept[_OLD_Y + i], kept[_OLD_Z + i]
        x, y, z = w[X + i] - a, w[Y + i] - b, w[Z + i] - c
        far, size = np.sqrt(x * x + y * y + z * z), np.sqrt(a * a + b * b + c * c)
        share = min(FARTHEST * size / max(far, TINY), ONE)
        w[X + i], w[Y + i], w[Z + i] = a + share * x, b + share * y, c + share * z


@FUSED.inlined
def _shine(weights: Weights, cosine: np.float32) -> tuple[np.float32, np.float32]:
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
def _rough_share(cosine: np.float32, facing: np.float32, towards: np.float32) -> np.float32:
    """What rough surfaces add, over the cosine to a light; ``facing`` and ``towards`` are the normal's and the light's
    cosines to the camera."""
    seen = max(facing, LEAST_FACING)
    beyond = max(towards - cosine * seen, ZERO) if cosine > ZERO else ZERO
    return np.float32(beyond / max(cosine, seen))


@FUSED.inlined
def _rough(cosine: np.float32, facing: np.float32, towards: np.float32) -> tuple[np.float32, np.float32, np.float32]:
    """What rough surfaces add, and what it gains with the cosines to the light and to the camera."""
    share = _rough_share(cosine, facing, towards)
    back = ONE if share > ZERO else ZERO
    seen = max(facing, LEAST_FACING)
    over = cosine > seen
    by_cosine = -seen if over else towards / seen - TWO * cosine
    by_facing = -cosine if over else -cosine * towards / (seen * seen)
    return share * cosine, back * by_cosine, back * by_facing


@FUSED.called
def _fill_gradient(
    ways: Floats, lights: int, weights: Weights, kept: Floats, matte: Floats, w: Floats, v: Floats, m: Floats, n: int
) -> None:
    """What each measurement gains by a little more of g, in each direction, at g; and measurements without shine.

    The long loop writes into ``kept`` alone, so that the compiler sees that nothing overlaps and makes vectors of it.
    """
    for i in range(n):
        a, b, c = w[X + i], w[Y + i], w[Z + i]
        per_size = ONE / np.sqrt(max(a * a + b * b + c * c, TINY * TINY))
        kept[_UNIT_X + i], kept[_UNIT_Y + i], kept[_UNIT_Z + i] = a * per_size, b * per_size, c * per_size
        kept[_PER_SIZE + i] = per_size
        x, y, z = v[VIEW_X + i], v[VIEW_Y + i], v[VIEW_Z + i]
        kept[_TO_X + i], kept[_TO_Y + i], kept[_TO_Z + i] = x, y, z
        kept[_FACING + i] = kept[_UNIT_X + i] * x + kept[_UNIT_Y + i] * y + kept[_UNIT_Z + i] * z
    for light in range(lights):
        begin = BLOCK * (KEPT + OF_LIGHT * light)
        way, line = ways[light], kept[begin : begin + BLOCK * OF_LIGHT]
        for i in range(n):
            a, b, c, per_size = kept[_UNIT_X + i], kept[_UNIT_Y + i], kept[_UNIT_Z + i], kept[_PER_SIZE + i]
            dx, dy, dz, to_half, strength, towards = way[0, i], way[1, i], way[2, i], way[3, i], way[4, i], way[5, i]
            x, y, z, facing = kept[_TO_X + i], kept[_TO_Y + i], kept[_TO_Z + i], kept[_FACING + i]
            cosine = a * dx + b * dy + c * dz
            half = max((cosine + facing) * to_half, ZERO)
            holds = kept[HOLDS + i] if cosine > ZERO else ZERO
            much, more = _shine(weights, half)
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
        there, without = m[light], matte[light]
        for i in range(n):
            without[i] = there[i] - line[3 * BLOCK + i] if there[i] > ABSENT else MISSING


@FUSED.called
def _take_off(ways: Floats, lights: int, weights: Weights, kept: Floats, values: Floats, n: int) -> None:
    """Leave of every sample what a matte surface would show: highlights are alike in all channels, the curve is not.

    The unit normals, and how they face the camera, are those that ``_fill_gradient`` left.
    """
    channels = len(values) // len(ways)
    for light in range(lights):
        way = ways[light]
        for i in range(n):
            facing = kept[_FACING + i]
            cosine = kept[_UNIT_X + i] * way[0, i] + kept[_UNIT_Y + i] * way[1, i] + kept[_UNIT_Z + i] * way[2, i]
            half = max((cosine + facing) * way[3, i], ZERO)
            holds = kept[HOLDS + i] if cosine > ZERO else ZERO
            much, _ = _shine(weights, half)
            kept[_SHINE + i] = holds * much * way[4, i]
            share = _rough_share(cosine, facing, way[5, i])
            kept[_GAIN + i] = ONE / (ONE + holds * (weights.curve * cosine + weights.rough * share))
        for channel in range(channels):
            plane = values[light * channels + channel]
            for i in range(n):
                without = (plane[i] - kept[_SHINE + i]) * kept[_GAIN + i]
                plane[i] = without if plane[i] > ABSENT else MISSING


@FUSED.called
def _take_off_soft(ways: Floats, lights: int, weights: Weights, kept: Floats, values: Floats, n: int) -> None:
    """Leave of samples without highlights what a surface would show that lets no light through."""
    channels = len(values) // len(ways)
    for light in range(lights):
        way = ways[light]
        for i in range(n):
            cosine = kept[_UNIT_X + i] * way[0, i] + kept[_UNIT_Y + i] * way[1, i] + kept[_UNIT_Z + i] * way[2, i]
            soft = weights.soft * kept[HOLDS + i]
            kept[_GAIN + i] = max(cosine, ZERO) / max(cosine + soft * (ONE - cosine), TINY)
        for channel in range(channels):
            plane = values[light * channels + channel]
            for i in range(n):
                plane[i] = plane[i] * kept[_GAIN + i] if plane[i] > ABSENT else MISSING
