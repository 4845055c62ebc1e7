"""The compiled loop that reads what the lights say in pixels without a solution: the brightest, and the colour."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import lent
from psvideo.model.arrays import Bytes, Floats
from psvideo.solve.normals.loops.blocks import ABSENT, BLOCK, ONE, ZERO
from psvideo.solve.normals.loops.measuring import any_asked, is_clipped, is_seen, read_block, samples_of
from psvideo.solve.normals.loops.near_kernel import at, lent_task, of_light
from psvideo.solve.normals.task import Task, Work

MOST_COUNTED, KEPT = 2, 3
"""Lights that a filled normal is made from, and those that one is from which was solved with more."""


class Said(NamedTuple):
    """What the lights say of every pixel that is to be filled (pixel, ...), in units of albedo.

    reached: how many lights reach it, counted up to two, and up to three where any is left out. bright: (pixel, 3),
    what the brightest show, 0 where there is none. towards: (pixel, 3, 3), the unit directions to those. (Two of each
    where no light is left out anywhere.) colour: (pixel, 3), the sum over the lights that reach it, alike in all three
    where the picture is grey. noise: of a colour's sum, as a standard deviation.
    """

    reached: Bytes
    bright: Floats
    towards: Floats
    colour: Floats
    noise: np.float32


def said_for(pixels: int, noise: float, *, kept: int) -> Said:
    """Return memory for what so many lights say of this many pixels."""
    return Said(
        reached=np.zeros(pixels, np.uint8),
        bright=np.zeros((pixels, kept), np.float32),
        towards=np.zeros((pixels, kept, 3), np.float32),
        colour=np.zeros((pixels, 3), np.float32),
        noise=np.float32(noise),
    )


@FUSED.kept
def mark_lit_rows(task: Task, work: Work, wanted: Bytes, lit: Bytes, first: int, last: int) -> None:
    """Set ``lit`` (row, col) to 1 at every ``wanted`` pixel of the rows that any light reaches; a light whose plate is
    saturated there reaches it too."""
    t = lent_task(task, work.matrix, work.per_strength)
    asked, found, values = lent(wanted), lent(lit), lent(work.values)
    channels = t.tone.shape[1]
    share = ONE / np.float32(channels)
    for row in range(first, last):
        for col in range(0, t.cols, BLOCK):
            n = min(BLOCK, t.cols - col)
            if not any_asked(asked, row, col, n):
                continue
            read_block(t, values, row, col, n)
            for light in range(t.lights):
                samples, dark = samples_of(t, light, row * t.cols + col, n), t.dark[light]
                for i in range(n):
                    if not asked[row, col + i]:
                        continue
                    bright = ZERO
                    for channel in range(channels):
                        bright += values[light * channels + channel, i] * t.shares[channel]
                    over = is_clipped(t, samples, light, i) and is_seen(t.seen, light, row, col + i)
                    if over or bright * share > dark:
                        found[row, col + i] = 1


@FUSED.kept
def look_rows(
    task: Task, work: Work, wanted: Bytes, begins: NDArray[np.int64], said: Said, first: int, last: int
) -> None:
    """Read the rows' pixels that are ``wanted`` (row, col): 1, and 2 to the power of a light's number and one for each
    that is left out; those of a row lie in ``said`` one after another from its place in ``begins`` (row,) on."""
    t = lent_task(task, work.matrix, work.per_strength)
    asked, values, places = lent(wanted), lent(work.values), lent(begins)
    count, bright, towards, colour = lent(said.reached), lent(said.bright), lent(said.towards), lent(said.colour)
    channels, kept = t.tone.shape[1], bright.shape[1]
    scale, share = t.albedo_scale, ONE / np.float32(channels)
    for row in range(first, last):
        begin = places[row]
        for col in range(0, t.cols, BLOCK):
            n = min(BLOCK, t.cols - col)
            if not any_asked(asked, row, col, n):
                continue
            read_block(t, values, row, col, n)
            place = begin
            for light in range(t.lights):
                lamp, per, dark = of_light(t.matrix, light), t.per_strength[light], t.dark[light]
                place = begin - 1
                for i in range(n):
                    if not asked[row, col + i]:
                        continue
                    place += 1
                    if asked[row, col + i] & (2 << light) or not values[light * channels, i] > ABSENT:
                        continue
                    level, shows = ZERO, ZERO
                    for channel in range(channels):
                        level += values[light * channels + channel, i] * share
                        shows += values[light * channels + channel, i] * share * t.shares[channel]
                    if not shows > dark:
                        continue
                    one = at(per, i)
                    level *= one * scale
                    if count[place] < (KEPT if asked[row, col + i] > 1 else MOST_COUNTED):
                        count[place] += 1
                    for channel in range(3):
                        source = min(channel, channels - 1)
                        colour[place, channel] += max(values[light * channels + source, i], ZERO)
                    x, y, z = at(lamp, i)
                    rank = kept
                    while rank > 0 and level > bright[place, rank - 1]:
                        rank -= 1
                    if rank < kept:
                        _make_room(bright, towards, place, rank)
                        _note(bright, towards, place, rank, level, x * one, y * one, z * one)
            begin = place + 1


@FUSED.inlined
def _make_room(bright: Floats, towards: Floats, place: int, rank: int) -> None:
    for later in range(bright.shape[1] - 1, rank, -1):
        bright[place, later] = bright[place, later - 1]
        for axis in range(3):
            towards[place, later, axis] = towards[place, later - 1, axis]


@FUSED.inlined
def _note(
    bright: Floats, towards: Floats, place: int, rank: int, level: np.float32,
    x: np.float32, y: np.float32, z: np.float32,
) -> None:  # fmt: skip
    bright[place, rank] = level
    towards[place, rank, 0], towards[place, rank, 1], towards[place, rank, 2] = x, y, z
