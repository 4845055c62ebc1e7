"""Compiled parts of following motion: how unlike plates are along velocities, where flow leads, what is blended."""

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import lent

Codes = NDArray[np.uint8]
Floats = NDArray[np.float32]
Flags = NDArray[np.bool_]
AT_REST, BEFORE, AFTER, BOTH, NOWHERE = range(5)
"""What a pixel is taken from: the nearer plate as it is, one plate moved along the motion, both, or none."""
ZERO, ONE, HALF = np.float32(0), np.float32(1), np.float32(0.5)
UNLIKE_SQUARE = np.float32(4.0**2)
"""Two codes that differ by 4 are half unlike: noise makes 1 to 2."""
STEPS = 4
"""How often the start of a way is looked for."""


@FUSED.inlined
def _between(picture: Codes, row: np.float32, col: np.float32) -> np.float32:
    """A code between pixels; beyond the border it is the border's."""
    row = min(max(row, ZERO), np.float32(picture.shape[0] - 1))
    col = min(max(col, ZERO), np.float32(picture.shape[1] - 1))
    top, left = int(row), int(col)
    below, right = min(top + 1, picture.shape[0] - 1), min(left + 1, picture.shape[1] - 1)
    down, across = row - np.float32(top), col - np.float32(left)
    upper = np.float32(picture[top, left]) * (ONE - across) + np.float32(picture[top, right]) * across
    lower = np.float32(picture[below, left]) * (ONE - across) + np.float32(picture[below, right]) * across
    return upper * (ONE - down) + lower * down


@FUSED.inlined
def _steps(shape: tuple[int, int], coarse: tuple[int, int]) -> tuple[np.float32, np.float32]:
    """How many rows and columns of a picture lie between those of a coarser one."""
    return np.float32(shape[0]) / np.float32(coarse[0]), np.float32(shape[1]) / np.float32(coarse[1])


@FUSED.kept
def unlike_rows(
    befores: Codes, afters: Codes, spans_s: Floats, velocity: Floats, first: int, last: int, out: Floats
) -> None:
    """Fill rows of ``out`` (row, col): how unlike the lights' plates before and after are at the ends of the way.

    ``befores`` and ``afters`` are (light, row, col), of as many pixels as ``out`` or more, ``spans_s`` (light, 2) the
    times since and until them, and ``velocity`` (2, row, col) in pixels of ``out`` per second. Every light counts from
    0 to 1, by Geman and McClure's function of the difference: a shadow that passes under one light does not outvote the
    others.
    """
    before, after, span, way, made = lent(befores), lent(afters), lent(spans_s), lent(velocity), lent(out)
    high, wide = _steps(before.shape[1:], made.shape)
    for row in range(first, last):
        down = (np.float32(row) + HALF) * high - HALF
        for col in range(made.shape[1]):
            x, y = way[0, row, col] * wide, way[1, row, col] * high
            across = (np.float32(col) + HALF) * wide - HALF
            total = ZERO
            for light in range(before.shape[0]):
                since, until = span[light, 0], span[light, 1]
                one = _between(before[light], down - y * since, across - x * since)
                other = _between(after[light], down + y * until, across + x * until)
                square = (other - one) * (other - one)
                total += square / (square + UNLIKE_SQUARE)
            made[row, col] = total


@FUSED.kept
def moved_rows(
    picture: Codes, since_s: np.float32, velocity: Floats, stride: int, first: int, last: int, out: Floats
) -> None:
    """Fill rows of ``out`` (row, col) with what a picture of so many seconds ago, below 0 of so many ahead, shows along
    velocities, (2, row, col) in their own pixels per second; ``out`` takes every ``stride``-th of them. The picture has
    as many pixels as there are velocities or more."""
    given, way, made = lent(picture), lent(velocity), lent(out)
    high, wide = _steps(given.shape, way.shape[1:])
    for row in range(first, last):
        own_row = row * stride
        down = (np.float32(own_row) + HALF) * high - HALF
        for col in range(made.shape[1]):
            own_col = col * stride
            across = (np.float32(own_col) + HALF) * wide - HALF
            x, y = way[0, own_row, own_col] * wide, way[1, own_row, own_col] * high
            made[row, col] = _between(given, down - y * since_s, across - x * since_s)


@FUSED.kept
def arriving_rows(flow: Floats, share: np.float32, per_s: np.float32, first: int, last: int, out: Floats) -> None:
    """Fill rows of velocities, ``out`` (2, row, col), of what arrives at every pixel after a share of its flow.

    ``flow`` (row, col, 2), of as many pixels as ``out`` or more, is known where things start, and asked for where they
    arrive: the start is looked for step by step. It times ``per_s`` is the velocity, in pixels of ``out``.
    """
    given, made = lent(flow), lent(out)
    rows, cols = given.shape[0], given.shape[1]
    high, wide = _steps(given.shape[:2], made.shape[1:])
    for row in range(first, last):
        down = (np.float32(row) + HALF) * high - HALF
        for col in range(made.shape[2]):
            across = (np.float32(col) + HALF) * wide - HALF
            x, y = given[int(down), int(across), 0], given[int(down), int(across), 1]
            for _ in range(STEPS):
                at_row = int(min(max(down - share * y + HALF, ZERO), np.float32(rows - 1)))
                at_col = int(min(max(across - share * x + HALF, ZERO), np.float32(cols - 1)))
                x, y = given[at_row, at_col, 0], given[at_row, at_col, 1]
            made[0, row, col], made[1, row, col] = x * per_s / wide, y * per_s / high


@FUSED.kept
def ways_rows(
    source: Codes, guess: Codes, velocity: Floats, spans_s: Floats, shape: tuple[int, int], first: int, left: int,
    given: Codes, taken: Codes, ways: Floats,
) -> None:  # fmt: skip
    """Fill ``given`` and ``taken``, a part of a picture of a ``shape`` (row, col) from its row ``first`` and its column
    ``left`` on, with what coarse ``source`` and ``guess`` say; and ``ways`` (2, 2, row, col), the column and row in the
    plates before and after that pixels came from and will go to, this many seconds ``spans_s`` (2,) since or, below 0,
    until then. ``velocity`` (2, row, col) is of the coarse pixels, per second.
    """
    own, other, flow, out = lent(source), lent(guess), lent(velocity), lent(ways)
    known, shown = lent(given), lent(taken)
    high, wide = _steps(shape, own.shape)
    last_row, last_col = own.shape[0] - 1, own.shape[1] - 1
    since, until = spans_s[0], spans_s[1]
    for row in range(known.shape[0]):
        y = np.float32(first + row)
        coarse_y = (y + HALF) / high
        small_row = min(int(coarse_y), last_row)
        at_row = min(max(coarse_y - HALF, ZERO), np.float32(last_row))
        top = int(at_row)
        below, down = min(top + 1, last_row), at_row - np.float32(top)
        for col in range(known.shape[1]):
            x = np.float32(left + col)
            coarse_x = (x + HALF) / wide
            small_col = min(int(coarse_x), last_col)
            known[row, col], shown[row, col] = own[small_row, small_col], other[small_row, small_col]
            at_col = min(max(coarse_x - HALF, ZERO), np.float32(last_col))
            before = int(at_col)
            behind, across = min(before + 1, last_col), at_col - np.float32(before)
            go_x = _level(flow[0], top, below, before, behind, down, across) * wide
            go_y = _level(flow[1], top, below, before, behind, down, across) * high
            out[0, 0, row, col], out[0, 1, row, col] = x - since * go_x, y - since * go_y
            out[1, 0, row, col], out[1, 1, row, col] = x - until * go_x, y - until * go_y


@FUSED.inlined
def _level(
    plane: Floats, top: int, below: int, left: int, right: int, down: np.float32, across: np.float32
) -> np.float32:
    """A value between four."""
    upper = plane[top, left] * (ONE - across) + plane[top, right] * across
    lower = plane[below, left] * (ONE - across) + plane[below, right] * across
    return np.float32(upper * (ONE - down) + lower * down)


@FUSED.kept
def blend_rows(
    taken: Codes, weights: Floats, before: Floats, after: Floats, full: Floats, rows_seen: Flags, left: int,
    image: Floats, seen: Flags,
) -> None:  # fmt: skip
    """Fill ``image`` (row, col, channel) from its column ``left`` on with what is taken of plates before and after, as
    they were moved there.

    ``taken`` (row, col) is AT_REST (image stays), BEFORE, AFTER, BOTH or NOWHERE; ``weights`` (2, row, col), or one
    each for all, what either counts where both are taken, 0 where it is not known; ``full`` the values from which on
    either is clipped, and what clipped light becomes: where one of two is clipped, the one that counts more is taken
    alone. ``rows_seen`` (row,) says where anything may be known of what is moved, and ``seen`` (row, col) becomes False
    where nothing is; there the image stays.
    """
    code, weight, one, other = lent(taken), lent(weights), lent(before), lent(after)
    made, known = lent(image), lent(seen)
    everywhere = weight.shape[1] < code.shape[0] or weight.shape[2] < code.shape[1]
    for row in range(code.shape[0]):
        for place in range(code.shape[1]):
            what, col = code[row, place], left + place
            if what == AT_REST:
                continue
            at = (0, 0) if everywhere else (row, place)
            early = weight[0, at[0], at[1]] if what != AFTER else ZERO
            late = weight[1, at[0], at[1]] if what != BEFORE else ZERO
            total = early + late
            if what == NOWHERE or not (rows_seen[row] and total > ZERO):
                known[row, col] = False
                continue
            if early > ZERO and late > ZERO:
                clips = _clips(one[row, place], full[0]), _clips(other[row, place], full[1])
                if clips[0] != clips[1]:
                    early, late = (early, ZERO) if early >= late else (ZERO, late)
                    total = early + late
            early, late = early / total, late / total
            clipped = False
            for channel in range(made.shape[2]):
                first, second = one[row, place, channel], other[row, place, channel]
                if (early > ZERO and first >= full[0]) or (late > ZERO and second >= full[1]):
                    clipped = True
                made[row, col, channel] = early * first + late * second
            if clipped:
                for channel in range(made.shape[2]):
                    made[row, col, channel] = full[2]


@FUSED.inlined
def _clips(light: Floats, full: np.float32) -> bool:
    """Whether any channel of a pixel is clipped."""
    clipped = False
    for channel in range(light.shape[0]):
        clipped = clipped or light[channel] >= full
    return clipped
