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
                for col in range(cols):
                    at_col = min(max(col + step_col * across, 0), cols - 1)
                    if spreads[at_row, at_col] < best[row, col]:
                        best[row, col] = spreads[at_row, at_col]
                        level[row, col] = means[at_row, at_col]
