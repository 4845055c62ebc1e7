"""Blocks of 2 x 2 pixels, of which a jump may cut a piece off: it goes with the block that it hangs together with.

A coarser grid whose pixels lie on both sides of a jump would tie the sides together, and every cycle of a multigrid
would undo what the one before did there. So pixels that do not hang together with most of their block are *moved*: each
to the block beside it on whose pixel it depends most. What hangs together with nothing near is left out of the
coarser grid; sweeps bring it along. Moved pixels are few, and are listed as (colour, row, k), see ``checkerboard.py``.

The four pixels of a block, where ``row`` is odd and the block is at ((row - 1) // 2, k - 1) among the blocks:

    a = [0, row, k]        b = [1, row, k]
    c = [1, row + 1, k]    d = [0, row + 1, k]

West of a is b of the block with k - 1, and north of it c of the block above. A block's own place on the coarser board
is [(block_row + block_col) % 2, block_row + 1, block_col // 2 + 1].
"""

from typing import Any

import numpy as np

from psvideo.compute.compiled import REORDERED
from psvideo.solve.depth.checkerboard import HALF, ONE, ZERO, ties_about

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


@REORDERED.inlined
def coarse_tie(tie: Any, one: Any, other: Any) -> Any:
    """What a tie between two blocks' pixels is worth between the blocks.

    Half where it holds them together: blocks move as steps and not as slopes do (D. Braess 1995), and half is what the
    same equation sampled twice as coarsely would have. All of it where it does not: then they do move as steps.
    """
    return tie * (HALF if tie * max(one, other) >= TORN else ONE)


@REORDERED.kept
def coarsen(ties: Any, inverse: Any, belongs: Any, coarse: Any) -> None:
    """Fill the weights between blocks with those of the ties that cross their borders, of pixels that stay."""
    rows, count = ties.shape[2] - 2, ties.shape[3] - 2
    for block_row in range(coarse.shape[2] - 2):
        top, low = 2 * block_row + 1, 2 * block_row + 2
        for k in range(1, count + 1):
            east, south = ZERO, ZERO
            if belongs[1, top, k] == OWN and belongs[0, top, k + 1] == OWN:
                east += coarse_tie(ties[0, 1, top, k], inverse[1, top, k], inverse[0, top, k + 1])
            if low <= rows:
                if belongs[0, low, k] == OWN and belongs[1, low, k + 1] == OWN:
                    east += coarse_tie(ties[0, 0, low, k], inverse[0, low, k], inverse[1, low, k + 1])
                if belongs[0, low, k] == OWN and belongs[1, low + 1, k] == OWN:
                    south += coarse_tie(ties[1, 0, low, k], inverse[0, low, k], inverse[1, low + 1, k])
                if belongs[1, low, k] == OWN and belongs[0, low + 1, k] == OWN:
                    south += coarse_tie(ties[1, 1, low, k], inverse[1, low, k], inverse[0, low + 1, k])
            colour, at = (block_row + k - 1) % 2, (k - 1) // 2 + 1
            coarse[0, colour, block_row + 1, at] = east
            coarse[1, colour, block_row + 1, at] = south


@REORDERED.kept
def coarsen_pins(pins: Any, coarse: Any) -> None:
    """Fill the pins of blocks (0 before) with the sums of their pixels'."""
    for row in range(1, pins.shape[1] - 1):
        block_row = (row - 1) // 2
        for k in range(1, pins.shape[2] - 1):
            both = pins[0, row, k] + pins[1, row, k]
            coarse[(block_row + k - 1) % 2, block_row + 1, (k - 1) // 2 + 1] += both


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
def _block(belongs: Any, colour: int, row: int, k: int) -> Any:
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


@REORDERED.called
def _add_tie(coarse: Any, one_row: int, one_col: int, row: int, col: int, tie: Any) -> None:
    """Add to the weight between two blocks; between blocks that touch in a corner there is none."""
    if min(one_row, row) < 0:
        return
    if one_row == row and abs(one_col - col) == 1:
        left = min(one_col, col)
        coarse[0, (row + left) % 2, row + 1, left // 2 + 1] += tie
    elif one_col == col and abs(one_row - row) == 1:
        top = min(one_row, row)
        coarse[1, (top + col) % 2, top + 1, col // 2 + 1] += tie


@REORDERED.kept
def mend(ties: Any, inverse: Any, belongs: Any, moved: Any, coarse: Any) -> None:
    """Add the ties of moved pixels to those between the blocks where they belong, after ``coarsen``."""
    for n in range(len(moved)):
        colour, row, k = moved[n, 0], moved[n, 1], moved[n, 2]
        other, odd = 1 - colour, (row - 1 + colour) % 2
        four = ties_about(ties, colour, row, k)
        here = _block(belongs, colour, row, k)
        for side in range(4):
            to_row = row + (side == 3) - (side == 2)
            to_k = k + (odd if side == 1 else 0) - (1 - odd if side == 0 else 0)
            if side % 2 == 0 and belongs[other, to_row, to_k] != OWN:
                continue  # a tie between two moved pixels is counted from its west or north end
            tie = coarse_tie(four[side], inverse[colour, row, k], inverse[other, to_row, to_k])
            there = _block(belongs, other, to_row, to_k)
            _add_tie(coarse, here[0], here[1], there[0], there[1], tie)


@REORDERED.kept
def restrict_moved(
    ties: Any, pins: Any, pinned: bool, right: Any, height: Any, belongs: Any, moved: Any, coarse: Any
) -> None:
    """Give what moved pixels' equations lack to the blocks where they belong (after ``descend``: colour 0 only)."""
    for n in range(len(moved)):
        colour, row, k = moved[n, 0], moved[n, 1], moved[n, 2]
        if colour == 1:
            continue
        west, east, north, south = ties_about(ties, 0, row, k)
        odd = (row - 1) % 2
        own = height[0, row, k]
        lack = right[0, row, k] + west * (height[1, row, k - 1 + odd] - own) + east * (height[1, row, k + odd] - own)
        lack += north * (height[1, row - 1, k] - own) + south * (height[1, row + 1, k] - own)
        if pinned:
            lack -= pins[0, row, k] * own
        _add(coarse, (row - 1) // 2, k - 1, -lack)
        block_row, block_col = _block(belongs, 0, row, k)
        _add(coarse, block_row, block_col, lack)


@REORDERED.called
def _add(coarse: Any, block_row: int, block_col: int, value: Any) -> None:
    if block_row >= 0:
        coarse[(block_row + block_col) % 2, block_row + 1, block_col // 2 + 1] += value


@REORDERED.kept
def prolong_moved(height: Any, belongs: Any, moved: Any, coarse: Any) -> None:
    """Correct moved pixels as the blocks are where they belong; ``ascend`` will add their own block's correction."""
    for n in range(len(moved)):
        colour, row, k = moved[n, 0], moved[n, 1], moved[n, 2]
        block_row, block_col = (row - 1) // 2, k - 1
        value = -coarse[(block_row + block_col) % 2, block_row + 1, block_col // 2 + 1]
        block_row, block_col = _block(belongs, colour, row, k)
        if block_row >= 0:
            value += coarse[(block_row + block_col) % 2, block_row + 1, block_col // 2 + 1]
        height[colour, row, k] += value
