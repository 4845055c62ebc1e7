"""The compiled loops of ambient light: a dark slot is measured, and averaged with those before it, row by row.

A row stays in a core's first cache meanwhile; no picture is held except the average.
"""

from typing import NamedTuple

import numpy as np

from psvideo.compute.compiled import FUSED, REORDERED
from psvideo.compute.memory import lent
from psvideo.model.arrays import Codes16, Doubles, Flags, Floats, Indices
from psvideo.plates.ambient.ambient_level import pack_row, unpack_row
from psvideo.plates.mixing.mixing_kernel import mix_row
from psvideo.plates.mixing.mixture_arrays import MixtureArrays, lent_mix

ONE, HALF = np.float32(1), np.float32(0.5)


class AveragedDarks(NamedTuple):
    """The average of dark slots: an AmbientLevel's planes, and how many slots it spans, ``slots`` (row, block)."""

    codes: Codes16
    least: Floats
    step: Floats
    narrow: Floats
    slots: Floats


class OneMore(NamedTuple):
    """What is known of one more dark slot beside its picture: its rows' ``factor`` (row,), which of them are ``seen``
    (row,), where the average begins again, ``restarts`` (row, block), and by how much the light has changed since,
    ``gain`` (row, col and channel) of blocks, steadily between their middles."""

    factor: Floats
    seen: Flags
    restarts: Flags
    gain: Floats


@FUSED.kept
def measure_rows(
    mix: MixtureArrays, block: int, first: int, last: int, means: Doubles, clipped: Flags, coarse: Floats
) -> None:
    """Fill of some rows of a picture, whole rows of blocks, the ``means`` (row,) and whether any sample is ``clipped``
    (row,), and the means over blocks of this many pixels a side, ``coarse`` (row, col, channel) of blocks."""
    given, found = lent_mix(mix), lent(coarse)
    line, total = np.empty(given.samples, np.float32), np.zeros(given.samples, np.float32)
    sums = np.empty(given.samples, np.float32)
    for row in range(first, last):
        mix_row(given, row, line)
        means[row] = _sum(line) / given.samples
        clipped[row] = _any_clipped(line)
        _into_blocks(line, total, sums, row, block, len(means), found)


@FUSED.kept
def average_rows(
    mix: MixtureArrays, block: int, longest: float, one: OneMore, old: AveragedDarks, first: int, last: int,
    new: AveragedDarks, coarse: Floats,
) -> None:  # fmt: skip
    """Average some rows of the light before, ``old``, brought to a new level, with one more picture, ``mix`` times its
    factor; keep what was where nothing is seen.

    The average spans ``longest`` pictures at most. Filled are ``new`` like the old one, and ``coarse`` (row, col,
    channel) with the means over blocks.
    """
    given, levels, found = lent_mix(mix), lent(one.gain), lent(coarse)
    factor, seen, restarts, old_slots, slots = one.factor, one.seen, one.restarts, old.slots, new.slots
    codes, least, step, narrow = lent(new.codes), lent(new.least), lent(new.step), lent(new.narrow)
    samples, channels = given.samples, found.shape[2]
    cols = samples // channels
    line, total, then = np.empty(samples, np.float32), np.zeros(samples, np.float32), np.empty(samples, np.float32)
    share, shares = np.empty(slots.shape[1], np.float32), np.empty(samples, np.float32)
    above, below, level = np.empty(samples, np.float32), np.empty(samples, np.float32), np.empty(samples, np.float32)
    left, right, way = np.empty(samples, np.uint32), np.empty(samples, np.uint32), np.empty(samples, np.float32)
    _place_middles(slots.shape[1], block, channels, left, right, way)
    held = -2
    for row in range(first, last):
        if seen[row]:
            for place in range(len(share)):
                spanned = min(old_slots[row, place] + ONE, np.float32(longest))
                slots[row, place] = ONE if restarts[row, place] else spanned
                share[place] = ONE / max(slots[row, place], ONE)
            alike = _over_pixels(share, block, cols, channels, shares)
            upper, part = _between(row, block, levels.shape[0])
            if upper != held:
                if upper == held + 1:
                    for sample in range(samples):  # numba's copies of slices load texts, to say what does not fit
                        above[sample] = below[sample]
                else:
                    _across(levels[upper], left, right, way, above)
                _across(levels[min(upper + 1, levels.shape[0] - 1)], left, right, way, below)
                held = upper
            mix_row(given, row, line)
            packed = lent(old.codes[row]), old.least[row], old.step[row]
            _blend(packed, above, below, part, line, factor[row], share[0], shares, alike, then)
        else:
            unpack_row(old.codes[row], old.least[row], old.step[row], then)
            for place in range(len(share)):
                slots[row, place] = old_slots[row, place]
        pack_row(then, codes[row], least, step, narrow[row], row, channels)
        _into_blocks(then, total, level, row, block, len(seen), found)


@REORDERED.inlined
def _sum(line: Floats) -> float:
    total = 0.0
    for sample in range(line.shape[0]):
        total += np.float64(line[sample])
    return total


@FUSED.inlined
def _any_clipped(line: Floats) -> bool:
    clipped = np.int32(0)
    for sample in range(line.shape[0]):
        clipped = np.int32(clipped | (line[sample] >= ONE))
    return bool(clipped > 0)


@FUSED.inlined
def _into_blocks(
    line: Floats, total: Floats, sums: Floats, row: int, block: int, rows: int, coarse: Floats
) -> None:  # fmt: skip
    """Add a row to its blocks' sums, and store their means after the last row of theirs; ``sums`` is room for a row."""
    for sample in range(line.shape[0]):
        total[sample] += line[sample]
    down, across, channels = coarse.shape
    own = min(row // block, down - 1)
    if row + 1 < (rows if own == down - 1 else (own + 1) * block):
        return
    begin, cols = (across - 1) * block, line.shape[0] // channels
    high = row + 1 - own * block
    _add_beside(total, block, begin, channels, sums)
    scale = ONE / np.float32(high * block)
    for place in range(across - 1):
        for channel in range(channels):
            coarse[own, place, channel] = sums[place * block * channels + channel] * scale
    scale = ONE / np.float32(high * (cols - begin))
    for channel in range(channels):
        mean = np.float32(0)
        for col in range(begin, cols):
            mean += total[col * channels + channel]
        coarse[own, across - 1, channel] = mean * scale
    total[:] = np.float32(0)


@FUSED.inlined
def _add_beside(total: Floats, block: int, end: int, channels: int, sums: Floats) -> None:
    """Fill ``sums`` before the column ``end`` with what ``block`` pixels from there on are together: of every pixel,
    though one of so many is wanted, since loops over neighbours become vectors."""
    count = end * channels
    for sample in range(count):
        sums[sample] = total[sample]
    for beside in range(1, block):
        ahead = total[beside * channels : beside * channels + count]
        for sample in range(count):
            sums[sample] += ahead[sample]


@FUSED.inlined
def _blend(
    packed: tuple[Codes16, np.float32, np.float32], above: Floats, below: Floats, part: np.float32, line: Floats,
    own: np.float32, share: np.float32, shares: Floats, alike: bool, then: Floats,
) -> None:  # fmt: skip
    """Fill ``then`` with a packed row of the light before, brought to its new level, and a share of the row ``line``:
    one of every sample, or one of all of them."""
    codes, least, step = packed
    if alike:
        for sample in range(then.shape[0]):
            level = above[sample] + part * (below[sample] - above[sample])
            there = (least + step * np.float32(codes[sample])) * level
            then[sample] = there + (line[sample] * own - there) * share
        return
    for sample in range(then.shape[0]):
        level = above[sample] + part * (below[sample] - above[sample])
        there = (least + step * np.float32(codes[sample])) * level
        then[sample] = there + (line[sample] * own - there) * shares[sample]


@FUSED.inlined
def _over_pixels(each: Floats, block: int, cols: int, channels: int, line: Floats) -> bool:
    """Repeat what is known of blocks for every sample of their row, unless all are alike, which is returned."""
    other = np.int32(0)
    for place in range(each.shape[0]):
        other = np.int32(other | (each[place] != each[0]))
    if not other:  # as usual
        return True
    for place in range(each.shape[0]):
        end = (place + 1) * block if place < each.shape[0] - 1 else cols
        line[place * block * channels : end * channels] = each[place]
    return False


@FUSED.inlined
def _between(row: int, block: int, down: int) -> tuple[int, np.float32]:
    """Return the block whose middle lies above a row, and how far the row is on the way to the middle of the next."""
    place = min(max((np.float32(row) + HALF) / np.float32(block) - HALF, np.float32(0)), np.float32(down - 1))
    upper = min(int(place), max(down - 2, 0))
    return upper, place - np.float32(upper)


@FUSED.inlined
def _place_middles(across: int, block: int, channels: int, left: Indices, right: Indices, way: Floats) -> None:
    """Fill for every sample of a row where, in a row of blocks, those lie whose middles are on its ``left`` and
    ``right``, one and the same beyond the outer middles, and how far it is on its ``way``."""
    for sample in range(left.shape[0]):
        col, channel = sample // channels, sample % channels
        beyond = col - block // 2
        place = min(max(beyond // block, 0), across - 1)
        between = beyond >= 0 and place < across - 1
        left[sample] = place * channels + channel
        right[sample] = left[sample] + channels if between else left[sample]
        part = (np.float32(beyond - place * block) + HALF) * (ONE / np.float32(block))
        way[sample] = part if between and block > 1 else np.float32(0)


@FUSED.inlined
def _across(gain: Floats, left: Indices, right: Indices, way: Floats, line: Floats) -> None:
    """Fill a row with what is known of a row of blocks, ``gain`` (block and channel), which changes steadily between
    their middles."""
    for sample in range(line.shape[0]):
        one = gain[left[sample]]
        line[sample] = one + way[sample] * (gain[right[sample]] - one)
