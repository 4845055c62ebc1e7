"""The compiled loop that makes a light's plate at an instant of two: moved along the motion, and blended."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.compiled import FUSED
from psvideo.compute.cubic import cubic_of_one, cubic_of_three, cubic_weights
from psvideo.compute.memory import lent
from psvideo.model.arrays import Codes8, Flags, Floats, Places
from psvideo.plates.align.velocity.moving_kernel import AFTER, AT_REST, BEFORE, NOWHERE

Columns = NDArray[np.uintp]
ZERO, ONE, HALF = np.float32(0), np.float32(1), np.float32(0.5)
JUST_BELOW = np.float32(1 - 1e-4)
"""What is interpolated stays below this share of the level that counts as clipped, also after rounding to 16 bits."""
BESIDE, CLIPPED = 1, 2
"""What a sample may be marked as: beside a clipped one, or clipped itself."""


@FUSED.called
def _line(plane: Floats, place: np.float32, scale: np.float32, line: Floats) -> None:
    """Fill ``line`` with what lies between two rows of a plane, times ``scale``; its last element twice."""
    rows, cols = plane.shape
    at = min(max(place - HALF, ZERO), np.float32(rows - 1))
    top = int(at)
    below, down = min(top + 1, rows - 1), at - np.float32(top)
    for col in range(cols):
        line[col] = (plane[top, col] * (ONE - down) + plane[below, col] * down) * scale
    line[cols] = line[cols - 1]


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
def _pixel(light: Floats, row: int, col: int) -> tuple[np.float32, np.float32, np.float32]:
    """The light of a pixel; of one channel, thrice the same."""
    second, third = (1, 2) if light.shape[2] == 3 else (0, 0)
    return light[row, col, 0], light[row, col, second], light[row, col, third]


@FUSED.inlined
def _between(light: Floats, address: int, x: np.float32, y: np.float32) -> tuple[np.float32, np.float32, np.float32]:
    """The light at a place between pixels, of one channel thrice the same."""
    rows, cols, channels = light.shape
    if ONE <= y < np.float32(rows - 2) and ONE <= x < np.float32(cols - 2):
        row, col = int(y), int(x)
        stride = 4 * channels * cols
        begin = address + (row - 1) * stride + 4 * channels * (col - 1)
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


@FUSED.inlined
def _moved(
    light: Floats, address: int, marks: Codes8, full: np.float32, x: np.float32, y: np.float32
) -> tuple[np.float32, np.float32, np.float32]:
    """A plate's light at a place of its own.

    What clips is what does at the nearest sample: beside clipped ones that is taken as it is, for it cannot be told how
    bright they are, and what is between is not clipped for it. ``marks`` is one 0 where nothing clips.
    """
    if marks.size > 1:
        row, col = _nearest(y, light.shape[0]), _nearest(x, light.shape[1])
        if marks[row, col] == CLIPPED:
            return full, full, full
        if marks[row, col] == BESIDE:
            return _pixel(light, row, col)
    one, two, three = _between(light, address, x, y)
    most = full * JUST_BELOW
    return min(one, most), min(two, most), min(three, most)


@FUSED.inlined
def _clips(light: tuple[np.float32, np.float32, np.float32], full: np.float32) -> bool:
    """Whether any channel of a pixel is clipped."""
    return bool(light[0] >= full or light[1] >= full or light[2] >= full)


@FUSED.kept
def blend_rows(
    source: Codes8, guess: Codes8, velocity: Floats, spans_s: Floats, shape: tuple[int, int], first: int, left: int,
    right: int, places: Columns, shares: Floats, lines: Floats, before: Floats, after: Floats, firsts: Places,
    marks_before: Codes8, marks_after: Codes8, seen_before: Flags, seen_after: Flags, counts: Floats, full: Floats,
    rows_seen: Flags, stays: Floats, image: Floats, seen: Flags,
) -> None:  # fmt: skip
    """Fill ``image`` (row, col, channel), the rows of a picture of a ``shape`` (row, col) from its row ``first`` on,
    with a plate between the plates ``before`` and ``after``.

    ``source`` and ``guess``, of coarse pixels, say what is taken and what is shown: AT_REST (as in ``stays``, rows as
    those of the image), BEFORE, AFTER, BOTH or NOWHERE; outside the columns ``left`` to ``right`` nothing moves.
    ``velocity`` (2, row, col) is that of coarse pixels, per second, ``spans_s`` (2,) how long ago the plates flashed,
    below 0: in so long. ``places`` (2, col) and ``shares`` (col,) are the picture's columns among the coarse ones, as
    ``columns_in`` has them, and ``lines`` (2, col + 1), of coarse columns, is room to work in. Of the plates those rows
    are given that move there, each from its row in ``firsts`` on, what is clipped (``marks``, as in ``_moved``), and
    where they were seen, by pixel, by row or at all. ``counts`` is what each counts where both are taken. ``full`` are
    the values from which on each is clipped, and what clipped light becomes: where one of two is clipped, the one that
    counts more is taken alone. ``rows_seen`` (row,) says where anything may be known of what is moved, and ``seen``
    (row, col) becomes False where nothing is; there the image stays.
    """
    own, other, flow, made, known = lent(source), lent(guess), lent(velocity), lent(image), lent(seen)
    one, two, kept = lent(before), lent(after), lent(stays)
    marked, marked_late, there, there_late = lent(marks_before), lent(marks_after), lent(seen_before), lent(seen_after)
    spans, count, limit, rows_known = lent(spans_s), lent(counts), lent(full), lent(rows_seen)
    high, wide = np.float32(shape[0]) / np.float32(own.shape[0]), np.float32(shape[1]) / np.float32(own.shape[1])
    three, lefts, owns, beyond = made.shape[2] == 3, lent(places)[0], lent(places)[1], lent(shares)
    line_x, line_y = lent(lines)[0], lent(lines)[1]
    addresses = before.ctypes.data, after.ctypes.data
    all_early, all_late = there.size == 1 and there[0, 0], there_late.size == 1 and there_late[0, 0]
    clipping, total = marked.size > 1 or marked_late.size > 1, count[0] + count[1]
    both = count[0] / total, count[1] / total
    first_before, first_after = np.float32(firsts[0]), np.float32(firsts[1])
    for some in range(made.shape[0]):
        row, y = np.uintp(some), np.float32(first + some)
        coarse_y = (y + HALF) / high
        small_row = np.uintp(min(int(coarse_y), own.shape[0] - 1))
        _line(flow[0], coarse_y, wide, line_x)
        _line(flow[1], coarse_y, high, line_y)
        for at in range(left, right):
            col, x = np.uintp(at), np.float32(at)
            small_col = owns[col]
            what = other[small_row, small_col]
            flowing = what != AT_REST and what != NOWHERE
            known[row, col] = (flowing or known[row, col]) and own[small_row, small_col] != NOWHERE
            early, late = ZERO, ZERO
            if flowing and rows_known[row]:
                begin, share = lefts[col], beyond[col]
                behind = begin + np.uintp(1)
                go_x = line_x[begin] * (ONE - share) + line_x[behind] * share
                go_y = line_y[begin] * (ONE - share) + line_y[behind] * share
                early_x, early_y = x - spans[0] * go_x, y - spans[0] * go_y
                late_x, late_y = x - spans[1] * go_x, y - spans[1] * go_y
                if what != AFTER and (
                    all_early or there[_nearest(early_y, there.shape[0]), _nearest(early_x, there.shape[1])]
                ):
                    early = count[0]
                if what != BEFORE and (
                    all_late or there_late[_nearest(late_y, there_late.shape[0]), _nearest(late_x, there_late.shape[1])]
                ):
                    late = count[1]
            if not early + late > ZERO:
                known[row, col] = known[row, col] and what == AT_REST
                made[row, col, 0] = kept[row, col, 0]
                if three:
                    made[row, col, 1], made[row, col, 2] = kept[row, col, 1], kept[row, col, 2]
                continue
            from_early, from_late = (ZERO, ZERO, ZERO), (ZERO, ZERO, ZERO)
            if early > ZERO:
                from_early = _moved(one, addresses[0], marked, limit[0], early_x, early_y - first_before)
            if late > ZERO:
                from_late = _moved(two, addresses[1], marked_late, limit[1], late_x, late_y - first_after)
            if early > ZERO and late > ZERO:
                early, late = both[0], both[1]
            else:
                early, late = (ONE, ZERO) if early > ZERO else (ZERO, ONE)
            if clipping:
                clips = early > ZERO and _clips(from_early, limit[0]), late > ZERO and _clips(from_late, limit[1])
                if early > ZERO and late > ZERO and clips[0] != clips[1]:
                    early, late = (ONE, ZERO) if early >= late else (ZERO, ONE)
                if (early > ZERO and clips[0]) or (late > ZERO and clips[1]):
                    early, late, from_early = ONE, ZERO, (limit[2], limit[2], limit[2])
            made[row, col, 0] = early * from_early[0] + late * from_late[0]
            if three:
                made[row, col, 1] = early * from_early[1] + late * from_late[1]
                made[row, col, 2] = early * from_early[2] + late * from_late[2]
