"""From raw samples to measurements, a plane per light: the part of every kernel that reads plates.

A measurement that is saturated, not a number or unseen becomes MISSING, far below every threshold.
"""

import numpy as np
from numba.np.numpy_support import carray

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import flattened, pointer
from psvideo.compute.whole_stores import unmasked
from psvideo.model.arrays import Bytes, Floats, Samples
from psvideo.solve.normals.loops.blocks import (
    ABSENT,
    BLOCK,
    COUNT,
    LIMIT,
    MISSING,
    ONE,
    SUM,
    THREE,
    TINY,
    XX,
    YY,
    ZERO,
    ZZ,
)
from psvideo.solve.normals.loops.near_kernel import at, place_lights
from psvideo.solve.normals.task import Task


@FUSED.inlined
def samples_of(task: Task, light: int, start: int, n: int) -> Samples:
    """The samples of n pixels of one light's plate."""
    channels = task.tone.shape[1]
    end = (start + n) * channels
    plate: Samples = carray(pointer(task.plates[light], task.like), end)
    return plate[start * channels : end]


@FUSED.inlined
def gather_one(task: Task, values: Floats, start: int, n: int) -> None:
    """Raw samples of one channel to measurements, a plane per light."""
    for light in range(task.lights):
        samples, plane = samples_of(task, light, start, n), values[light]
        gain, offset, ceiling, _ = task.tone[light, 0]
        for i in range(n):
            value = np.float32(samples[i]) * gain + offset
            plane[i] = value if (value < ceiling) & (value > ABSENT) else MISSING


@FUSED.inlined
def gather_three(task: Task, values: Floats, start: int, n: int) -> None:
    """Raw samples of three channels to measurements, a plane per light and channel; a light counts whole or not."""
    line = flattened(values)
    for light in range(task.lights):
        samples, v = samples_of(task, light, start, n), line[3 * BLOCK * light : 3 * BLOCK * (light + 1)]
        gain_r, offset_r, ceiling_r, _ = task.tone[light, 0]
        gain_g, offset_g, ceiling_g, _ = task.tone[light, 1]
        gain_b, offset_b, ceiling_b, _ = task.tone[light, 2]
        for i in range(n):
            r = np.float32(samples[3 * i]) * gain_r + offset_r
            g = np.float32(samples[3 * i + 1]) * gain_g + offset_g
            b = np.float32(samples[3 * i + 2]) * gain_b + offset_b
            here = (r < ceiling_r) & (g < ceiling_g) & (b < ceiling_b) & (min(r, min(g, b)) > ABSENT)
            v[i] = r if here else MISSING
            v[BLOCK + i] = g if here else MISSING
            v[2 * BLOCK + i] = b if here else MISSING


@FUSED.inlined
def mark_three(task: Task, values: Floats, n: int) -> None:
    """As ``gather_three``, where all samples lie in ``values`` without a mark, as ``colour_kernel`` leaves them."""
    line = flattened(values)
    for light in range(task.lights):
        v = line[3 * BLOCK * light : 3 * BLOCK * (light + 1)]
        ceiling_r, ceiling_g, ceiling_b = task.tone[light, 0, 2], task.tone[light, 1, 2], task.tone[light, 2, 2]
        for i in range(n):
            r, g, b = v[i], v[BLOCK + i], v[2 * BLOCK + i]
            here = (r < ceiling_r) & (g < ceiling_g) & (b < ceiling_b) & (min(r, min(g, b)) > ABSENT)
            v[i] = unmasked(r) if here else MISSING
            v[BLOCK + i] = unmasked(g) if here else MISSING
            v[2 * BLOCK + i] = unmasked(b) if here else MISSING


@FUSED.inlined
def is_clipped(task: Task, samples: Samples, light: int, place: int) -> bool:
    """Whether any channel of a pixel of ``samples_of`` is saturated, seen or not."""
    channels = task.tone.shape[1]
    over = False
    for channel in range(channels):
        gain, offset, ceiling, _ = task.tone[light, channel]
        over |= np.float32(samples[place * channels + channel]) * gain + offset >= ceiling
    return over


@FUSED.inlined
def is_seen(seen: Bytes, light: int, row: int, col: int) -> bool:
    """Whether a light was seen in a pixel; one entry may stand for the whole row."""
    return not seen.size or bool(seen[light, row, 0 if seen.shape[2] == 1 else col])


@FUSED.inlined
def combine(task: Task, w: Floats, values: Floats, m: Floats, n: int) -> None:
    """One measurement per light from three channels, each weighted by its own albedo and by how well lights show it.

    With lights of one colour that is the matched filter for noise alike in all channels: one in which the surface is
    black adds nothing, nor does one that lights do not send, of which nothing but noise is left once it is divided by
    them (``Illumination.shares``).
    """
    for plane in (XX, YY, ZZ):
        w[plane : plane + n] = ZERO
    for light in range(task.lights):
        red, green, blue = values[3 * light], values[3 * light + 1], values[3 * light + 2]
        for i in range(n):
            w[XX + i] += max(red[i], ZERO)
            w[YY + i] += max(green[i], ZERO)
            w[ZZ + i] += max(blue[i], ZERO)
    weigh_channels(task, w, n)
    for light in range(task.lights):
        red, green, blue = values[3 * light], values[3 * light + 1], values[3 * light + 2]
        for i in range(n):
            value = w[XX + i] * red[i] + w[YY + i] * green[i] + w[ZZ + i] * blue[i]
            m[light, i] = value if red[i] > ABSENT else MISSING


@FUSED.inlined
def weigh_channels(task: Task, w: Floats, n: int) -> None:
    """From three channels' light in the planes XX, YY, ZZ to their weights, which add up to 1 (0 in the dark).

    What hardly any light shows of a surface's colour is mostly noise: there the colour is in part that of the others.
    """
    share_red, share_green, share_blue = task.shares[0], task.shares[1], task.shares[2]
    own_red, own_green, own_blue = task.believed[0], task.believed[1], task.believed[2]
    other_red, other_green, other_blue = (ONE - own_red) / THREE, (ONE - own_green) / THREE, (ONE - own_blue) / THREE
    for i in range(n):
        red, green, blue = w[XX + i], w[YY + i], w[ZZ + i]
        light = share_red * red + share_green * green + share_blue * blue
        red = share_red * (own_red * red + other_red * light)
        green = share_green * (own_green * green + other_green * light)
        blue = share_blue * (own_blue * blue + other_blue * light)
        total = red + green + blue
        one = ONE / total if total > ZERO else ZERO
        w[XX + i], w[YY + i], w[ZZ + i] = red * one, green * one, blue * one


@FUSED.inlined
def all_seen(seen: Bytes, row: int, col: int, n: int) -> bool:
    """Whether every light was seen in n pixels; one entry may stand for the whole row."""
    if not seen.size:
        return True
    first, last = (0, 1) if seen.shape[2] == 1 else (col, col + n)
    every = np.uint8(1)
    for light in range(seen.shape[0]):
        for place in range(first, last):
            every = np.uint8(every & seen[light, row, place])
    return bool(every)


@FUSED.inlined
def any_asked(asked: Bytes, row: int, col: int, n: int) -> bool:
    """Whether anything is asked of n pixels. (Numba's own ``any`` would load its mathematics of arrays, and SciPy, with
    every kept loop that calls it.)"""
    found = np.uint8(0)
    for place in range(col, col + n):
        found = np.uint8(found | asked[row, place])
    return bool(found)


@FUSED.inlined
def hide_unseen(task: Task, values: Floats, row: int, col: int, n: int) -> None:
    """What was not seen becomes MISSING."""
    channels, seen = task.tone.shape[1], task.seen
    for plane in range(channels * seen.shape[0]):
        light = plane // channels
        if seen.shape[2] > 1:
            for i in range(n):
                value = unmasked(values[plane, i])
                values[plane, i] = value if seen[light, row, col + i] else MISSING
        elif not seen[light, row, 0]:
            values[plane, :n] = MISSING


@FUSED.inlined
def read_block(task: Task, values: Floats, row: int, col: int, n: int) -> None:
    """Place the lights and read a block's measurements, MISSING where saturated or unseen."""
    place_lights(task.matrix, task.per_strength, task.near, row, col, n)
    start = row * task.cols + col
    if task.tone.shape[1] == 1:
        gather_one(task, values, start, n)
    else:
        gather_three(task, values, start, n)
    hide_unseen(task, values, row, col, n)


@FUSED.called
def read_usable(
    task: Task, w: Floats, values: Floats, m: Floats, row: int, col: int, n: int, tried: bool
) -> None:  # fmt: skip
    """Read a block's measurements; what is saturated, unseen or in shadow is MISSING, and COUNT is what remains.

    tried: ``solve_colours`` has read them.
    """
    start, channels = row * task.cols + col, task.tone.shape[1]
    if channels == 1:
        gather_one(task, values, start, n)
    elif tried:
        mark_three(task, values, n)
    else:
        gather_three(task, values, start, n)
    hide_unseen(task, values, row, col, n)
    if channels > 1:
        combine(task, w, values, m, n)
    _hide_shadows(task, w, m, n)


@FUSED.inlined
def _hide_shadows(task: Task, w: Floats, m: Floats, n: int) -> None:
    """What is dark, or dark beside the pixel's own mean, becomes MISSING; COUNT is what remains, and all of that is
    brighter than LIMIT, relative to its light."""
    w[SUM : SUM + n], w[COUNT : COUNT + n], w[LIMIT : LIMIT + n] = ZERO, ZERO, -MISSING
    for light in range(task.lights):
        plane, per, dark = m[light], task.per_strength[light], task.dark[light]
        for i in range(n):
            w[LIMIT + i] = min(unmasked(w[LIMIT + i]), dark * at(per, i))
            w[SUM + i] += max(plane[i] * at(per, i), ZERO) if plane[i] > ABSENT else ZERO
            w[COUNT + i] += ONE if plane[i] > ABSENT else ZERO
    for i in range(n):
        w[LIMIT + i] = max(unmasked(w[LIMIT + i]), task.ratio * w[SUM + i] / (w[COUNT + i] + TINY))
        w[COUNT + i] = ZERO
    for light in range(task.lights):
        plane, per, dark = m[light], task.per_strength[light], task.dark[light]
        for i in range(n):
            lit = (plane[i] > dark) & (plane[i] * at(per, i) > w[LIMIT + i])
            plane[i] = unmasked(plane[i]) if lit else MISSING
            w[COUNT + i] += ONE if lit else ZERO
