"""Grids of heights tied to their neighbours, laid out as a chess board: what one colour needs lies in the other's rows.

A pixel (row, col) has the colour (row + col) % 2 and stands at ``[colour, row + 1, col // 2 + 1]`` of an array of shape
(2, rows + 2, ceil(cols / 2) + 2); the margin is 0. Relaxing a colour then reads and writes whole rows, eight numbers at
a time. ``ties[0]`` is a pixel's weight with its right neighbour, ``ties[1]`` with its lower one; 0 cuts them apart.
``inverse`` is 1 / (the sum of a pixel's weights), 0 where there are none. ``pins`` hold pixels to 0 (or to what the
right side says), and are read only where ``pinned``. Sweeps over the rows follow each other at a distance of one row,
so that a grid larger than the cache is read once for all of them.
"""

from typing import Any

import numpy as np

from psvideo.compute.compiled import REORDERED
from psvideo.compute.spilled import room_apart
from psvideo.model.arrays import Floats

ZERO, HALF, ONE = np.float32(0), np.float32(0.5), np.float32(1)


def empty_board(rows: int, cols: int) -> Floats:
    """Return a board of zeros for a grid of that size."""
    return room_apart((2, rows + 2, (cols + 1) // 2 + 2), np.float32)


@REORDERED.inlined
def ties_about(ties: Any, colour: int, row: int, k: int) -> Any:
    """A pixel's weights with its neighbours to the west, east, north and south."""
    west = k if (row - 1 + colour) % 2 == 1 else k - 1
    other = 1 - colour
    return ties[0, other, row, west], ties[0, colour, row, k], ties[1, other, row - 1, k], ties[1, colour, row, k]


@REORDERED.called
def _relax(ties: Any, inverse: Any, right: Any, height: Any, line: Any, colour: int, row: int) -> None:
    """Give every pixel of a row and colour the height that solves its own equation."""
    other, last = 1 - colour, height.shape[2] - 1
    east, west = ties[0, colour, row], ties[0, other, row]
    south, north = ties[1, colour, row], ties[1, other, row - 1]
    beside, above, below = height[other, row], height[other, row - 1], height[other, row + 1]
    wanted, per, out = right[colour, row], inverse[colour, row], height[colour, row]
    for k in range(1, last):
        line[k] = wanted[k] + south[k] * below[k] + north[k] * above[k]
    if (row - 1 + colour) % 2 == 1:
        for k in range(1, last):
            out[k] = (line[k] + east[k] * beside[k + 1] + west[k] * beside[k]) * per[k]
    else:
        for k in range(1, last):
            out[k] = (line[k] + east[k] * beside[k] + west[k - 1] * beside[k - 1]) * per[k]


@REORDERED.inlined
def _relax_behind(ties: Any, inverse: Any, right: Any, height: Any, line: Any, step: int) -> None:
    """Relax colours 1, 0 and 1 behind the row ``step``, each a row behind the one before."""
    for behind in range(1, 4):
        if 1 <= step - behind < height.shape[1] - 1:
            _relax(ties, inverse, right, height, line, behind % 2, step - behind)


@REORDERED.called
def pull(ties: Any, height: Any, line: Any, colour: int, row: int) -> None:
    """Fill a line with what a row's neighbours pull it up by: the sum of weight times (neighbour - pixel)."""
    other, last = 1 - colour, height.shape[2] - 1
    east, west = ties[0, colour, row], ties[0, other, row]
    south, north = ties[1, colour, row], ties[1, other, row - 1]
    beside, above, below, own = height[other, row], height[other, row - 1], height[other, row + 1], height[colour, row]
    for k in range(1, last):
        line[k] = south[k] * (below[k] - own[k]) + north[k] * (above[k] - own[k])
    if (row - 1 + colour) % 2 == 1:
        for k in range(1, last):
            line[k] += east[k] * (beside[k + 1] - own[k]) + west[k] * (beside[k] - own[k])
    else:
        for k in range(1, last):
            line[k] += east[k] * (beside[k] - own[k]) + west[k - 1] * (beside[k - 1] - own[k])


@REORDERED.called
def _start(inverse: Any, right: Any, height: Any, row: int) -> None:
    """Relax a row of colour 0 while all other heights are 0."""
    wanted, per, out = right[0, row], inverse[0, row], height[0, row]
    for k in range(1, height.shape[2] - 1):
        out[k] = wanted[k] * per[k]


@REORDERED.called
def _add_lack(right: Any, height: Any, pins: Any, pinned: bool, line: Any, sums: Any, row: int) -> None:
    """Add to ``sums`` what row ``row``'s equations of colour 0 lack, ``line`` being what its neighbours pull."""
    wanted, own = right[0, row], height[0, row]
    first = row % 2 == 1
    for k in range(1, height.shape[2] - 1):
        sums[k] = wanted[k] + line[k] + (ZERO if first else sums[k])
    if pinned:
        pin = pins[0, row]
        for k in range(1, height.shape[2] - 1):
            sums[k] -= pin[k] * own[k]


@REORDERED.called
def _write_blocks(sums: Any, coarse: Any, block_row: int, count: int) -> None:
    """Write a line of blocks onto a coarser board."""
    even, odd = coarse[block_row % 2, block_row + 1], coarse[1 - block_row % 2, block_row + 1]
    for k in range((count + 1) // 2):
        even[k + 1] = sums[1 + 2 * k]
    for k in range(count // 2):
        odd[k + 1] = sums[2 + 2 * k]


@REORDERED.kept
def descend(
    ties: Any, inverse: Any, pins: Any, pinned: bool, right: Any, height: Any, coarse: Any, line: Any, sums: Any
) -> None:
    """Sweep twice from height 0, colours 0 and 1 in turn, and fill ``coarse`` with what blocks of 2 x 2 still lack.

    After colour 1, only the equations of colour 0 lack anything.
    """
    rows, count = height.shape[1] - 2, height.shape[2] - 2
    for step in range(1, rows + 5):
        if step <= rows:
            _start(inverse, right, height, step)
        _relax_behind(ties, inverse, right, height, line, step)
        row = step - 4
        if row >= 1:
            pull(ties, height, line, 0, row)
            _add_lack(right, height, pins, pinned, line, sums, row)
            if row % 2 == 0 or row == rows:
                _write_blocks(sums, coarse, (row - 1) // 2, count)


@REORDERED.called
def _add_blocks(coarse: Any, height: Any, line: Any, row: int) -> None:
    """Add to a row the correction of its blocks."""
    last = height.shape[2] - 1
    block_row = (row - 1) // 2
    even, odd = coarse[block_row % 2, block_row + 1], coarse[1 - block_row % 2, block_row + 1]
    for k in range(last // 2):
        line[1 + 2 * k] = even[k + 1]
    for k in range((last - 1) // 2):
        line[2 + 2 * k] = odd[k + 1]
    first, second = height[0, row], height[1, row]
    for k in range(1, last):
        first[k] += line[k]
    for k in range(1, last):
        second[k] += line[k]


@REORDERED.kept
def ascend(ties: Any, inverse: Any, right: Any, height: Any, coarse: Any, line: Any) -> None:
    """Add the blocks' corrections, and sweep twice, colours 1 and 0 in turn: ``descend`` in a mirror."""
    rows = height.shape[1] - 2
    for step in range(1, rows + 5):
        if step <= rows:
            _add_blocks(coarse, height, line, step)
        _relax_behind(ties, inverse, right, height, line, step)
        if step - 4 >= 1:
            _relax(ties, inverse, right, height, line, 0, step - 4)


@REORDERED.kept
def settle(ties: Any, inverse: Any, right: Any, height: Any, line: Any, sweeps: int) -> None:
    """Sweep a small board from its height so often that it is solved, there and back."""
    for count in range(2 * sweeps):
        for turn in range(2):
            colour = turn if count < sweeps else 1 - turn
            for row in range(1, height.shape[1] - 1):
                _relax(ties, inverse, right, height, line, colour, row)


@REORDERED.kept
def invert(ties: Any, pins: Any, pinned: bool, inverse: Any) -> None:
    """Fill 1 / (the sum of every pixel's weights and its pin), 0 where it has no neighbour."""
    for colour in range(2):
        for row in range(1, inverse.shape[1] - 1):
            for k in range(1, inverse.shape[2] - 1):
                west, east, north, south = ties_about(ties, colour, row, k)
                total = west + east + north + south
                if pinned and total > ZERO:
                    total += pins[colour, row, k]
                inverse[colour, row, k] = ONE / total if total > ZERO else ZERO
