"""Compiled parts of blending: what one of two plates shows at places of its own, of one pixel or of eight beside each
other."""

from typing import Any, NamedTuple

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.compute.cubic import cubic_of_one, cubic_of_three, cubic_weights
from psvideo.compute.cubic_eight import (
    add_one,
    add_one_of_five,
    add_three,
    add_three_of_five,
    begin_of_eight,
)
from psvideo.compute.eight_lanes import EIGHT
from psvideo.compute.memory import lent
from psvideo.model.arrays import Codes8, Flags, Floats

Pixel = tuple[np.float32, np.float32, np.float32]
ZERO, ONE = np.float32(0), np.float32(1)
JUST_BELOW = np.float32(1 - 1e-4)
"""What is interpolated stays below this share of the level that counts as clipped, also after rounding to 16 bits."""
BESIDE, CLIPPED = 1, 2
"""What a sample may be marked as: beside a clipped one, or clipped itself."""


class SideArrays(NamedTuple):
    """One of the two plates, in plain arrays: some of its rows, and what is known of them."""

    light: Floats  # (row, col, channel), of its rows
    first: int  # from this one on
    marks: Codes8  # (row, col) of the same, or one 0 where nothing clips
    seen: Flags  # (row, col) of the whole plate, (row, 1), (1, col), or one where it is everything or nothing
    span_s: np.float32  # how long ago it flashed, below 0: in so long
    counts: np.float32  # what it counts where both are taken
    full: np.float32  # from which value on it is clipped
    right: np.float32 = ZERO  # how far its picture lies to the right of where it is to be
    down: np.float32 = ZERO  # the same downwards


@FUSED.inlined
def lent_side(side: SideArrays) -> SideArrays:
    """The same without reference counts."""
    light, marks, seen = lent(side.light), lent(side.marks), lent(side.seen)
    return SideArrays(light, side.first, marks, seen, side.span_s, side.counts, side.full, side.right, side.down)


@FUSED.inlined
def sees(side: SideArrays, x: np.float32, y: np.float32) -> bool:
    """Whether the plate was seen at a place."""
    there = side.seen
    if there.size == 1:
        return bool(there[0, 0])
    return bool(there[_nearest(y, there.shape[0]), _nearest(x, there.shape[1])])


@FUSED.inlined
def light_at(side: SideArrays, x: np.float32, y: np.float32) -> Pixel:
    """A plate's light at a place, of one channel thrice the same.

    What clips is what does at the nearest sample: beside clipped ones that is taken as it is, for it cannot be told how
    bright they are, and what is between is not clipped for it.
    """
    light, marks, full, own_y = side.light, side.marks, side.full, y - np.float32(side.first)
    if marks.size > 1:
        row, col = _nearest(own_y, light.shape[0]), _nearest(x, light.shape[1])
        if marks[row, col] == CLIPPED:
            return full, full, full
        if marks[row, col] == BESIDE:
            return pixel_of(light, row, col)
    one, two, three = _between(light, x, own_y)
    most = full * JUST_BELOW
    return min(one, most), min(two, most), min(three, most)


@FUSED.inlined
def adds_eight(side: SideArrays, x_at: int, y_at: int, counts: np.float32, onto: int, into: int) -> bool:
    """Add eight pixels beside each other to those at the address ``onto``, times what the plate ``counts``, and put
    them into the address ``into``; their places lie at two addresses.

    Return whether that could be: where the places are not beside each other, or nearly, where any lies outside or is
    not seen, and where anything around is clipped, every pixel is for itself.
    """
    light, most = side.light, side.full * JUST_BELOW
    rows, cols, channels = light.shape
    col, row, more_cols, more_rows = begin_of_eight(x_at, y_at)
    more = max(more_cols, more_rows)
    if more > 1 or not 1 <= col < cols - EIGHT - 1 - more:
        return False
    own_row, last_row = row - side.first, row + 1 + more
    if not 1 <= own_row < rows - 2 - more:
        return False
    if side.marks.size > 1 and _any_marked(side.marks, own_row, last_row - side.first, col):
        return False
    if side.seen.size > 1 and not _all_seen(side.seen, row, last_row, col):
        return False
    stride = 4 * channels * cols
    picture, begin, places = (light.ctypes.data - side.first * stride, stride), (col, row), (x_at, y_at)
    if channels == 3 and more:
        add_three_of_five(picture, begin, places, onto, into, (counts, most))
    elif channels == 3:
        add_three(picture, begin, places, onto, into, (counts, most))
    elif more:
        add_one_of_five(picture, begin, places, onto, into, (counts, most))
    else:
        add_one(picture, begin, places, onto, into, (counts, most))
    return True


@FUSED.inlined
def _any_marked(marks: Codes8, first: int, last: int, col: int) -> bool:
    """Whether anything is marked of the rows and columns that are nearest to eight places."""
    found = np.uint8(0)
    for row in range(first, last + 1):
        for place in range(col, col + EIGHT + 2):
            found |= marks[row, place]
    return bool(found > 0)


@FUSED.inlined
def _all_seen(seen: Flags, first: int, last: int, col: int) -> bool:
    """The same: whether all of them were seen."""
    begin, end = (0, 1) if seen.shape[1] == 1 else (col, col + EIGHT + 2)
    if seen.shape[0] == 1:
        first, last = 0, 0
    hidden = 0
    for row in range(first, last + 1):
        for place in range(begin, end):
            hidden += int(not seen[row, place])
    return not hidden


@FUSED.inlined
def _nearest(place: np.float32, count: int) -> Any:
    return np.uintp(min(max(np.rint(place), ZERO), np.float32(count - 1)))


@FUSED.called
def _beside_border(light: Floats, row: int, col: int, down: np.float32, across: np.float32, channel: int) -> np.float32:
    """What lies between samples of which some are beyond the border: the border's are taken for them."""
    rows, cols = light.shape[0], light.shape[1]
    over, beside, total = cubic_weights(down), cubic_weights(across), ZERO
    for down_by in range(4):
        at_row, line = min(max(row + down_by - 1, 0), rows - 1), ZERO
        for across_by in range(4):
            at_col = min(max(col + across_by - 1, 0), cols - 1)
            line += beside[across_by] * light[at_row, at_col, channel]
        total += over[down_by] * line
    return total


@FUSED.inlined
def pixel_of(light: Floats, row: Any, col: Any) -> Pixel:
    """The light of a pixel."""
    second, third = (1, 2) if light.shape[2] == 3 else (0, 0)
    return light[row, col, 0], light[row, col, second], light[row, col, third]


@FUSED.inlined
def _between(light: Floats, x: np.float32, y: np.float32) -> Pixel:
    """The light at a place between pixels."""
    rows, cols, channels = light.shape
    if ONE <= y < np.float32(rows - 2) and ONE <= x < np.float32(cols - 2):
        row, col = int(y), int(x)
        stride = 4 * channels * cols
        begin = light.ctypes.data + (row - 1) * stride + 4 * channels * (col - 1)
        down, across = y - np.float32(row), x - np.float32(col)
        if channels == 3:
            one, two, three = cubic_of_three(begin, stride, across, down)
            return one, two, three
        grey = cubic_of_one(begin, stride, across, down)
        return grey, grey, grey
    row, col = int(np.floor(y)), int(np.floor(x))
    down, across = y - np.float32(row), x - np.float32(col)
    if channels == 3:
        return (
            _beside_border(light, row, col, down, across, 0),
            _beside_border(light, row, col, down, across, 1),
            _beside_border(light, row, col, down, across, 2),
        )
    grey = _beside_border(light, row, col, down, across, 0)
    return grey, grey, grey
