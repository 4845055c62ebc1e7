"""The compiled loop that makes a light's plate at an instant of two: moved along the motion, and blended."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.compiled import FUSED
from psvideo.compute.eight_lanes import EIGHT
from psvideo.compute.memory import lent
from psvideo.model.arrays import Codes8, Flags, Floats
from psvideo.plates.align.side_kernel import (
    ONE,
    ZERO,
    Pixel,
    SideArrays,
    adds_eight,
    lent_side,
    light_at,
    pixel_of,
    sees,
)
from psvideo.plates.align.velocity.moving_kernel import AFTER, AT_REST, BEFORE, BOTH, NOWHERE

Columns = NDArray[np.uintp]
HALF = np.float32(0.5)
ROOM = 13
"""Lines that a row is made with: of two velocities' two planes two coarse rows each, of places two for each plate, and
a line of zeros."""
FIRST_PLACES, NOTHING = 8, 12


@FUSED.called
def _stretch(line: Floats, lefts: Columns, beyond: Floats, wide: Floats) -> None:
    """Fill ``wide`` with a line of coarse columns, stretched to all."""
    last = np.uintp(line.shape[0] - 1)
    for col in range(wide.shape[0]):
        begin, share = lefts[col], beyond[col]
        wide[col] = line[begin] * (ONE - share) + line[min(begin + np.uintp(1), last)] * share


@FUSED.called
def _places(
    above: Floats, below: Floats, down: np.float32, scale: np.float32, start: np.float32, each: np.float32,
    span: np.float32, out: Floats,
) -> None:  # fmt: skip
    """Fill ``out`` with the places of pixels a time ago, of which the first is at ``start`` and each so much farther:
    ``scale`` times the velocity lies between two lines."""
    for col in range(out.shape[0]):
        go = (above[col] * (ONE - down) + below[col] * down) * scale
        out[col] = start + np.float32(np.int32(col)) * each - span * go


@FUSED.inlined
def _alike(source: Codes8, guess: Codes8, row: Any, first: Any, last: Any) -> int:
    """What coarse pixels of a row are taken from, and show, up to the last one; NOWHERE where they differ."""
    what = guess[row, first]
    alike = True
    for col in range(first, last + np.uintp(1)):
        alike &= guess[row, col] == what and source[row, col] == what
    return what if alike else NOWHERE


@FUSED.inlined
def _clips(light: Pixel, full: np.float32) -> bool:
    """Whether any channel of a pixel is clipped."""
    return bool(light[0] >= full or light[1] >= full or light[2] >= full)


@FUSED.inlined
def _blended(
    one: SideArrays, two: SideArrays, early: bool, late: bool, full: np.float32, ways: Floats, col: int
) -> Pixel:
    """A pixel of the plates that show it, one of them at least."""
    from_early, from_late = (ZERO, ZERO, ZERO), (ZERO, ZERO, ZERO)
    if early:
        from_early = light_at(one, ways[0, col], ways[1, col])
    if late:
        from_late = light_at(two, ways[2, col], ways[3, col])
    share, other = (ONE, ZERO) if early else (ZERO, ONE)
    if early and late:
        share, other = one.counts, two.counts
    if one.marks.size > 1 or two.marks.size > 1:
        clips = early and _clips(from_early, one.full), late and _clips(from_late, two.full)
        if early and late and clips[0] != clips[1]:
            share, other = (ONE, ZERO) if share >= other else (ZERO, ONE)
        if (share > ZERO and clips[0]) or (other > ZERO and clips[1]):
            return full, full, full
    return (
        share * from_early[0] + other * from_late[0],
        share * from_early[1] + other * from_late[1],
        share * from_early[2] + other * from_late[2],
    )


@FUSED.inlined
def _blends_eight(one: SideArrays, two: SideArrays, what: int, at: int, stride: int, zeros: int, into: int) -> bool:
    """Make eight pixels of one plate or both, whose places lie ``stride`` bytes apart from the address ``at`` on;
    return whether that could be."""
    onto = zeros
    if what != AFTER:
        if not adds_eight(one, at, at + stride, one.counts if what == BOTH else ONE, onto, into):
            return False
        onto = into
    return what == BEFORE or adds_eight(
        two, at + 2 * stride, at + 3 * stride, two.counts if what == BOTH else ONE, onto, into
    )


@FUSED.kept
def blend_rows(
    source: Codes8, guess: Codes8, since: Floats, until: Floats, shape: tuple[int, int], first: int, left: int,
    right: int, columns: Columns, shares: Floats, room: Floats, before: SideArrays, after: SideArrays, full: np.float32,
    rows_seen: Flags, stays: Floats, image: Floats, seen: Flags,
) -> None:  # fmt: skip
    """Fill ``image`` (row, col, channel), the rows of a picture of a ``shape`` (row, col) from its row ``first`` on,
    with a plate between the plates ``before`` and ``after``, of which those rows are given that move there.

    ``source`` and ``guess``, of coarse pixels, say what is taken and what is shown: AT_REST (as in ``stays``, rows as
    those of the image), BEFORE, AFTER, BOTH or NOWHERE; outside the columns ``left`` to ``right`` nothing moves.
    ``since`` and ``until`` (2, row, col) are the mean velocities of coarse pixels from the plate before
    and to the one after, per second. ``columns`` (2, col) and ``shares`` (col,) are the
    picture's columns among the coarse ones, as ``columns_in`` has them; ``room`` (ROOM, col) is to work in.

    Clipped light becomes ``full``: where one of two plates is clipped, the one that counts more is taken alone; what
    both count is 1. ``rows_seen`` (row,) says where anything may be known of what is moved, and ``seen`` (row, col)
    becomes False where nothing is; there the image stays.
    """
    own, other, made, known = lent(source), lent(guess), lent(image), lent(seen)
    came, goes = lent(since), lent(until)
    one, two, kept, rows_known, lines = lent_side(before), lent_side(after), lent(stays), lent(rows_seen), lent(room)
    high, wide = np.float32(shape[0]) / np.float32(own.shape[0]), np.float32(shape[1]) / np.float32(own.shape[1])
    lefts, owns, beyond = lent(columns)[0, left:right], lent(columns)[1], lent(shares)[left:right]
    cols, channels, even, odd = made.shape[1], made.shape[2], -1, -1
    stride, ways = 4 * lines.shape[1], lines[FIRST_PLACES:]
    at_ways, zeros = room.ctypes.data + FIRST_PLACES * stride, room.ctypes.data + NOTHING * stride
    for some in range(made.shape[0]):
        row, y = np.uintp(some), np.float32(first + some)
        coarse_y = (y + HALF) / high
        small_row = np.uintp(min(int(coarse_y), own.shape[0] - 1))
        between = min(max(coarse_y - HALF, ZERO), np.float32(own.shape[0] - 1))
        top = int(between)
        below, down = min(top + 1, own.shape[0] - 1), between - np.float32(top)
        for coarse in (top, below):
            if coarse != (odd if coarse & 1 else even):
                for plane in range(2):
                    line = 2 * plane + (coarse & 1)
                    _stretch(came[plane, coarse], lefts, beyond, lines[line, left:right])
                    _stretch(goes[plane, coarse], lefts, beyond, lines[4 + line, left:right])
                even, odd = (even, coarse) if coarse & 1 else (coarse, odd)
        for plane in range(2):
            start, each, scale = (np.float32(left), ONE, wide) if plane == 0 else (y, ZERO, high)
            early_at, late_at = (one.right, two.right) if plane == 0 else (one.down, two.down)
            above, under = lines[2 * plane + (top & 1), left:right], lines[2 * plane + (below & 1), left:right]
            _places(above, under, down, scale, start + early_at, each, one.span_s, ways[plane, left:right])
            above, under = lines[4 + 2 * plane + (top & 1), left:right], lines[4 + 2 * plane + (below & 1), left:right]
            _places(above, under, down, scale, start + late_at, each, two.span_s, ways[2 + plane, left:right])
        for begin in range(left, right, EIGHT):
            end = min(begin + EIGHT, right)
            what = _alike(own, other, small_row, owns[begin], owns[end - 1])
            if what == AT_REST:
                made[row, begin:end] = kept[row, begin:end]
                continue
            if what != NOWHERE and rows_known[row] and end - begin == EIGHT:
                into = image.ctypes.data + 4 * channels * (some * cols + begin)
                if _blends_eight(one, two, what, at_ways + 4 * begin, stride, zeros, into):
                    for place in range(EIGHT):
                        known[row, begin + place] = True
                    continue
            for col in range(begin, end):
                what = other[small_row, owns[col]]
                early, late = False, False
                if what != AT_REST and what != NOWHERE and rows_known[row]:
                    early = what != AFTER and sees(one, ways[0, col], ways[1, col])
                    late = what != BEFORE and sees(two, ways[2, col], ways[3, col])
                shown, stays_known = early or late, known[row, col] and what == AT_REST
                known[row, col] = (shown or stays_known) and own[small_row, owns[col]] != NOWHERE
                light = pixel_of(kept, row, col)
                if shown:
                    light = _blended(one, two, early, late, full, ways, col)
                for channel in range(channels):
                    made[row, col, channel] = light[channel]
