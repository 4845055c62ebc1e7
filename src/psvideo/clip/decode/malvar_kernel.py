"""The compiled loop of demosaicing, row by row; all filters share the sums of a row."""

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import lent
from psvideo.model.arrays import Floats

BORDER = 2
EIGHTH, HALF, ONE_AND_A_HALF = np.float32(1 / 8), np.float32(1 / 2), np.float32(3 / 2)
TWO, FOUR, FIVE, SIX = np.float32(2), np.float32(4), np.float32(5), np.float32(6)


@FUSED.kept
def demosaic_rows(mosaic: Floats, filters: NDArray[np.intp], first: int, last: int, colour: Floats) -> None:
    """Fill some rows of ``colour`` (row, col, 3) from a mosaic (row, col); ``filters`` (2, 2) are the channels that its
    top left pixels show."""
    given, out = lent(mosaic), lent(colour)
    rows, cols = given.shape
    wide = cols + 2 * BORDER
    own, near, far = np.empty(wide, np.float32), np.empty(wide, np.float32), np.empty(wide, np.float32)
    green, beside = np.empty(cols, np.float32), np.empty(cols, np.float32)
    above, across = np.empty(cols, np.float32), np.empty(cols, np.float32)
    for row in range(first, last):
        up, down = given[_within(row - 1, rows)], given[_within(row + 1, rows)]
        top, bottom = given[_within(row - 2, rows)], given[_within(row + 2, rows)]
        for col in range(cols):
            own[col + BORDER] = given[row, col]
            near[col + BORDER] = up[col] + down[col]
            far[col + BORDER] = top[col] + bottom[col]
        for line in (own, near):
            for step in range(1, BORDER + 1):
                line[BORDER - step] = line[BORDER + _within(-step, cols)]
                line[BORDER + cols - 1 + step] = line[BORDER + _within(cols - 1 + step, cols)]
        for col in range(cols):
            at = col + BORDER
            here, sides, ends = own[at], own[at - 1] + own[at + 1], own[at - 2] + own[at + 2]
            corners = near[at - 1] + near[at + 1]
            green[col] = (FOUR * here + TWO * (near[at] + sides) - (far[at] + ends)) * EIGHTH
            beside[col] = (FIVE * here + FOUR * sides - ends - corners + HALF * far[at]) * EIGHTH
            above[col] = (FIVE * here + FOUR * near[at] - far[at] - corners + HALF * ends) * EIGHTH
            across[col] = (SIX * here + TWO * corners - ONE_AND_A_HALF * (far[at] + ends)) * EIGHTH
        for begin in range(2):
            channel, beside_it = filters[row % 2, begin], filters[row % 2, 1 - begin]
            line = out[row]
            if channel == 1:
                for col in range(begin, cols, 2):
                    line[col, 1] = given[row, col]
                    line[col, beside_it] = beside[col]
                    line[col, 2 - beside_it] = above[col]
            else:
                for col in range(begin, cols, 2):
                    line[col, channel] = given[row, col]
                    line[col, 1] = green[col]
                    line[col, 2 - channel] = across[col]


@FUSED.inlined
def _within(place: int, count: int) -> int:
    """The place to which the border mirrors one beyond it, about the outermost."""
    if count == 1:
        return 0
    while place < 0 or place >= count:
        place = -place if place < 0 else 2 * (count - 1) - place
    return place
