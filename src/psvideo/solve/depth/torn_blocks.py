"""Blocks of 2 x 2 pixels, of which a jump may cut a piece off: it goes with the block that it hangs together with.

A coarser grid whose pixels lie on both sides of a jump would tie the sides together, and every cycle of a multigrid
would undo what the one before did there. So pixels that do not hang together with most of their block are *moved*: each
to the block beside it on whose pixel it depends most. What hangs together with nothing near is left out of the
coarser grid; sweeps bring it along. Moved pixels are few, and are listed as (colour, row, k), see ``checkerboard.py``.
``between_blocks`` makes the coarser grid of that.

The four pixels of a block, where ``row`` is odd and the block is at ((row - 1) // 2, k - 1) among the blocks:

    a = [0, row, k]        b = [1, row, k]
    c = [1, row + 1, k]    d = [0, row + 1, k]

West of a is b of the block with k - 1, and north of it c of the block above. A block's own place on the coarser board
is [(block_row + block_col) % 2, block_row + 1, block_col // 2 + 1].
"""

from typing import Any

import numpy as np

from psvideo.compute.compiled import REORDERED
from psvideo.solve.depth.checkerboard import ZERO, ties_about

TORN = np.float32(0.05)
"""A tie weaker than this share of all ties of either pixel does not hold them together."""
OWN, WEST, EAST, NORTH, SOUTH, NOWHERE, LOOSE = 0, 1, 2, 3, 4, 5, 9
"""Where a pixel belongs: its own block, one beside it, none; not decided yet."""


@REORDERED.inlined
def _holds(tie: Any, one: Any, other: Any) -> bool:
    """Whether a tie holds two pixels together, of which the inverse sums of ties are given."""
    return bool(tie * max(one, other) >= TORN)


@REORDERED.inlined
def _torn(one: Any, other: Any, held: bool) -> bool:
    """Whether two valid pixels do not hold together."""
    return one > ZERO and other > ZERO and not held


@REORDERED.called
def _loosen(ties: Any, inverse: Any, belongs: Any, row: int, k: int) -> int:
    """Mark the pixels of one block that do not hang together with most of it; return their count."""
    low = row + 1
    a, b, c, d = inverse[0, row, k], inverse[1, row, k], inverse[1, low, k], inverse[0, low, k]
    ab, cd = _holds(ties[0, 0, row, k], a, b), _holds(ties[0, 1, low, k], c, d)
    ac, bd = _holds(ties[1, 0, row, k], a, c), _holds(ties[1, 1, row, k], b, d)
    if _torn(a, b, ab) + _torn(c, d, cd) + _torn(a, c, ac) + _torn(b, d, bd) < 2:
        return 0
    # with at most two ties, pieces are named by their first pixel: a = 0, b = 1, c = 2, d = 3
    of_b = 0 if ab else 1
    of_c = 0 if ac else 2
    of_d = of_b if bd else (of_c if cd else 3)
    if bd and cd:  # b, c and d hang together, and a does not
        of_c = of_b
    best, most = -1, 0
    for piece in range(4):
        size = (piece == 0 and a > ZERO) + (of_b == piece and b > ZERO)
        size += (of_c == piece and c > ZERO) + (of_d == piece and d > ZERO)
        if size > most:
            best, most = piece, size
    count = 0
    if best != 0 and a > ZERO:
        belongs[0, row, k], count = LOOSE, count + 1
    if of_b != best and b > ZERO:
        belongs[1, row, k], count = LOOSE, count + 1
    if of_c != best and c > ZERO:
        belongs[1, low, k], count = LOOSE, count + 1
    if of_d != best and d > ZERO:
        belongs[0, low, k], count = LOOSE, count + 1
    return count


@REORDERED.kept
def part(ties: Any, inverse: Any, belongs: Any, moved: Any) -> int:
    """Fill where every pixel belongs (OWN before), and list those that are moved; return their count."""
    rows, last = inverse.shape[1] - 2, inverse.shape[2] - 1
    count = 0
    for row in range(1, rows + 1, 2):
        for k in range(1, last):
            count += _loosen(ties, inverse, belongs, row, k)
    if count == 0:
        return 0
    listed = 0
    for row in range(1, rows + 1):
        for colour in range(2):
            for k in range(1, last):
                if belongs[colour, row, k] == LOOSE:
                    if listed < len(moved):
                        moved[listed, 0], moved[listed, 1], moved[listed, 2] = colour, row, k
                        listed += 1
                    else:
                        belongs[colour, row, k] = OWN
    for n in range(listed):
        _move_out(ties, inverse, belongs, moved[n, 0], moved[n, 1], moved[n, 2])
    for n in range(listed):
        _follow(ties, inverse, belongs, moved[n, 0], moved[n, 1], moved[n, 2])
    for n in range(listed):
        if belongs[moved[n, 0], moved[n, 1], moved[n, 2]] == LOOSE:
            belongs[moved[n, 0], moved[n, 1], moved[n, 2]] = NOWHERE
    return listed


@REORDERED.called
def _move_out(ties: Any, inverse: Any, belongs: Any, colour: int, row: int, k: int) -> None:
    """Move a loose pixel to the block across its border, if it hangs together with a pixel there that stays."""
    west, east, north, south = ties_about(ties, colour, row, k)
    right, top, other = (row - 1 + colour) % 2 == 1, row % 2 == 1, 1 - colour
    across, along = (east if right else west), (north if top else south)
    beside, over = (k + 1 if right else k - 1), (row - 1 if top else row + 1)
    own = inverse[colour, row, k]
    sideways = belongs[other, row, beside] == OWN and across * own >= TORN
    upright = belongs[other, over, k] == OWN and along * own >= TORN
    if sideways and (across >= along or not upright):
        belongs[colour, row, k] = EAST if right else WEST
    elif upright:
        belongs[colour, row, k] = NORTH if top else SOUTH


@REORDERED.called
def _follow(ties: Any, inverse: Any, belongs: Any, colour: int, row: int, k: int) -> None:
    """Move a pixel that is still loose along with a pixel of its block that it hangs together with."""
    if belongs[colour, row, k] != LOOSE:
        return
    west, east, north, south = ties_about(ties, colour, row, k)
    right, top, other = (row - 1 + colour) % 2 == 1, row % 2 == 1, 1 - colour
    over = row + 1 if top else row - 1
    own = inverse[colour, row, k]
    mate, stacked = belongs[other, row, k], belongs[other, over, k]
    if WEST <= mate <= SOUTH and (west if right else east) * own >= TORN:
        belongs[colour, row, k] = mate
    elif WEST <= stacked <= SOUTH and (south if top else north) * own >= TORN:
        belongs[colour, row, k] = stacked


@REORDERED.called
def block_of(belongs: Any, colour: int, row: int, k: int) -> Any:
    """Row and column, among the blocks, of the one that a pixel belongs to; row -9 where to none."""
    block_row, block_col, where = (row - 1) // 2, k - 1, belongs[colour, row, k]
    if where == WEST:
        block_col -= 1
    elif where == EAST:
        block_col += 1
    elif where == NORTH:
        block_row -= 1
    elif where == SOUTH:
        block_row += 1
    elif where != OWN:
        block_row = -9
    return block_row, block_col
