"""Compiled parts of following motion: how unlike plates are along velocities, where flow leads, what moves there."""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.compute.eight_lanes import EIGHT
from psvideo.compute.linear_eight import LEAST_COLS, linear_of_eight
from psvideo.compute.memory import lent
from psvideo.model.arrays import Codes8, Floats

AT_REST, BEFORE, AFTER, BOTH, NOWHERE = range(5)
"""What a pixel is taken from: the nearer plate as it is, one plate moved along the motion, both, or none."""
ZERO, ONE, HALF = np.float32(0), np.float32(1), np.float32(0.5)
UNLIKE_SQUARE = np.float32(4.0**2)
"""Two codes that differ by 4 are half unlike: noise makes 1 to 2."""
STEPS = 4
"""How often the start of a way is looked for."""


@FUSED.inlined
def _between(picture: Codes8, row: np.float32, col: np.float32) -> np.float32:
    """A code between pixels; beyond the border it is the border's."""
    row = min(max(row, ZERO), np.float32(picture.shape[0] - 1))
    col = min(max(col, ZERO), np.float32(picture.shape[1] - 1))
    whole_row, whole_col = int(row), int(col)
    top, left = np.uintp(whole_row), np.uintp(whole_col)  # unsigned: no place is counted from the end
    below = min(top + np.uintp(1), np.uintp(picture.shape[0] - 1))
    right = min(left + np.uintp(1), np.uintp(picture.shape[1] - 1))
    down, across = row - np.float32(whole_row), col - np.float32(whole_col)
    upper = np.float32(picture[top, left]) * (ONE - across) + np.float32(picture[top, right]) * across
    lower = np.float32(picture[below, left]) * (ONE - across) + np.float32(picture[below, right]) * across
    return upper * (ONE - down) + lower * down


@FUSED.inlined
def _steps(shape: tuple[int, int], coarse: tuple[int, int]) -> tuple[np.float32, np.float32]:
    """How many rows and columns of a picture lie between those of a coarser one."""
    return np.float32(shape[0]) / np.float32(coarse[0]), np.float32(shape[1]) / np.float32(coarse[1])


@FUSED.called
def _codes_at(picture: Codes8, x: Floats, y: Floats, codes: Floats) -> None:
    """Fill ``codes`` with what a picture shows at places; all are as long, a number of times EIGHT."""
    rows, cols = picture.shape
    if cols < LEAST_COLS:
        for place in range(codes.shape[0]):
            codes[place] = _between(picture, y[place], x[place])
        return
    for place in range(0, 4 * codes.shape[0], 4 * EIGHT):
        linear_of_eight(
            picture.ctypes.data, (rows, cols), x.ctypes.data + place, y.ctypes.data + place, codes.ctypes.data + place
        )


@FUSED.inlined
def _places(way: Floats, row: int, shape: tuple[int, int], span: np.float32, x: Floats, y: Floats) -> None:
    """Fill ``x`` and ``y`` with the places of a row's pixels in a picture of a ``shape``, so long ago."""
    high, wide = _steps(shape, way.shape[1:])
    down, across, own = (np.float32(row) + HALF) * high - HALF, way[0, row], way[1, row]
    for col in range(across.shape[0]):
        x[col] = (np.float32(np.int32(col)) + HALF) * wide - HALF - across[col] * wide * span
    for col in range(across.shape[0]):
        y[col] = down - own[col] * high * span


@FUSED.kept
def unlike_rows(
    befores: Codes8, afters: Codes8, spans_s: Floats, velocity: Floats, first: int, last: int, room: Floats,
    out: Floats,
) -> None:  # fmt: skip
    """Fill rows of ``out`` (row, col): how unlike the lights' plates before and after are at the ends of the way.

    ``befores`` and ``afters`` are (light, row, col), of as many pixels as ``out`` or more, ``spans_s`` (light, 2, row)
    the times since and until them, and ``velocity`` (2, row, col) in pixels of ``out`` per second; ``room`` (4, col) is
    to work in, whose columns are a number of times EIGHT. Every light counts from 0 to 1, by Geman and McClure's
    function of the difference: a shadow that passes under one light does not outvote the others.
    """
    before, after, span, way, made = lent(befores), lent(afters), lent(spans_s), lent(velocity), lent(out)
    x, y, ones, others = lent(room)[0], lent(room)[1], lent(room)[2], lent(room)[3]
    for row in range(first, last):
        total = made[row]
        total[:] = ZERO
        for light in range(before.shape[0]):
            _places(way, row, before.shape[1:], span[light, 0, row], x, y)
            _codes_at(before[light], x, y, ones)
            _places(way, row, before.shape[1:], -span[light, 1, row], x, y)
            _codes_at(after[light], x, y, others)
            for col in range(total.shape[0]):
                square = (others[col] - ones[col]) * (others[col] - ones[col])
                total[col] += square / (square + UNLIKE_SQUARE)


@FUSED.kept
def moved_rows(
    picture: Codes8, since_s: Floats, velocity: Floats, stride: int, first: int, last: int, out: Floats
) -> None:
    """Fill rows of ``out`` (row, col) with what a picture of so many seconds ago, below 0 of so many ahead, shows along
    velocities, (2, row, col) in their own pixels per second; ``since_s`` (row,) is of each row of these, of which
    ``out`` takes every ``stride``-th. The picture has as many pixels as there are velocities or more."""
    given, way, made, ago = lent(picture), lent(velocity), lent(out), lent(since_s)
    high, wide = _steps(given.shape, way.shape[1:])
    for row in range(first, last):
        own_row = row * stride
        down = (np.float32(own_row) + HALF) * high - HALF
        for col in range(made.shape[1]):
            own_col = col * stride
            across = (np.float32(own_col) + HALF) * wide - HALF
            x, y = way[0, own_row, own_col] * wide, way[1, own_row, own_col] * high
            made[row, col] = _between(given, down - y * ago[own_row], across - x * ago[own_row])


@FUSED.kept
def arriving_rows(flow: Floats, shares: Floats, per_s: Floats, first: int, last: int, out: Floats) -> None:
    """Fill rows of velocities, ``out`` (2, row, col), of what arrives at every pixel after a share of its flow (row,).

    ``flow`` (row, col, 2), of as many pixels as ``out`` or more, is known where things start, and asked for where they
    arrive: the start is looked for step by step. It times ``per_s`` (row,) is the velocity, in pixels of ``out``.
    """
    given, made, part, rate = lent(flow), lent(out), lent(shares), lent(per_s)
    rows, cols = given.shape[0], given.shape[1]
    high, wide = _steps(given.shape[:2], made.shape[1:])
    for row in range(first, last):
        down, share = (np.float32(row) + HALF) * high - HALF, part[row]
        for col in range(made.shape[2]):
            across = (np.float32(col) + HALF) * wide - HALF
            x, y = given[int(down), int(across), 0], given[int(down), int(across), 1]
            for _ in range(STEPS):
                at_row = int(min(max(down - share * y + HALF, ZERO), np.float32(rows - 1)))
                at_col = int(min(max(across - share * x + HALF, ZERO), np.float32(cols - 1)))
                x, y = given[at_row, at_col, 0], given[at_row, at_col, 1]
            made[0, row, col], made[1, row, col] = x * rate[row] / wide, y * rate[row] / high
