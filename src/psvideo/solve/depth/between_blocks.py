"""From pixels to blocks and back: ties between blocks, what their equations lack, and corrections of moved pixels.

Which block a pixel belongs to is said by ``torn_blocks``, whose names for pixels and places hold here, too.
"""

from typing import Any

from psvideo.compute.compiled import REORDERED
from psvideo.solve.depth.checkerboard import HALF, ONE, ZERO, ties_about
from psvideo.solve.depth.torn_blocks import OWN, TORN, block_of


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
        here = block_of(belongs, colour, row, k)
        for side in range(4):
            to_row = row + (side == 3) - (side == 2)
            to_k = k + (odd if side == 1 else 0) - (1 - odd if side == 0 else 0)
            if side % 2 == 0 and belongs[other, to_row, to_k] != OWN:
                continue  # a tie between two moved pixels is counted from its west or north end
            tie = coarse_tie(four[side], inverse[colour, row, k], inverse[other, to_row, to_k])
            there = block_of(belongs, other, to_row, to_k)
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
        block_row, block_col = block_of(belongs, 0, row, k)
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
        block_row, block_col = block_of(belongs, colour, row, k)
        if block_row >= 0:
            value += coarse[(block_row + block_col) % 2, block_row + 1, block_col // 2 + 1]
        height[colour, row, k] += value
