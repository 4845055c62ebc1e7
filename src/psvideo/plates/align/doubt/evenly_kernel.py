"""The compiled loop that finds, of the windows that hold a pixel, the one that changed most evenly."""

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import lent
from psvideo.model.arrays import Floats


@FUSED.kept
def evenest_rows(mean: Floats, spread: Floats, down: int, across: int, shading: Floats, left: Floats) -> None:
    """Put into ``shading`` and ``left`` (row, col) the ``mean`` and the ``spread`` of the window, of those around nine
    places this many rows and columns away, whose spread is least, where that is less than what is ``left`` there."""
    means, spreads, level, best = lent(mean), lent(spread), lent(shading), lent(left)
    rows, cols = means.shape[0], means.shape[1]
    for row in range(rows):
        for step_row in range(-1, 2):
            at_row = min(max(row + step_row * down, 0), rows - 1)
            for step_col in range(-1, 2):
                begin, end = max(-step_col * across, 0), cols - max(step_col * across, 0)
                begin, end = min(begin, cols), max(end, 0)
                if begin < end:
                    some = slice(begin + step_col * across, end + step_col * across)
                    _take_less(means[at_row, some], spreads[at_row, some], level[row, begin:end], best[row, begin:end])
                for col in range(0, begin):  # beyond the border it is the border's
                    _take_one(means[at_row, 0], spreads[at_row, 0], level, best, row, col)
                for col in range(max(end, begin), cols):
                    _take_one(means[at_row, cols - 1], spreads[at_row, cols - 1], level, best, row, col)


@FUSED.inlined
def _take_less(mean: Floats, spread: Floats, level: Floats, best: Floats) -> None:
    for col in range(best.shape[0]):
        less = spread[col] < best[col]
        level[col] = mean[col] if less else level[col]
        best[col] = spread[col] if less else best[col]


@FUSED.inlined
def _take_one(mean: float, spread: float, level: Floats, best: Floats, row: int, col: int) -> None:
    if spread < best[row, col]:
        level[row, col], best[row, col] = mean, spread
