"""Whitening, compiled: residuals of frames that share a flash err together where the subject moves (``restless``).

A row's covariance over the frames is ``1 + restless * sum_k w_k w_k'``, w_k being the shares of flash k that the frames
saw. Flashes touch neighbouring frames only, so that its Cholesky factor has a diagonal and one line below it.
"""

from psvideo.compute.compiled import EXACT
from psvideo.model.arrays import Doubles
from psvideo.model.rows.shutter import REACH
from psvideo.sync.rowfit.row_model import Flashes, Rows, lent_flashes, lent_rows, seen_of


@EXACT.kept
def factors(rows: Rows, flashes: Flashes, row: int, diagonal: Doubles, below: Doubles) -> None:
    """Fill a row's Cholesky factor, ``diagonal`` and ``below`` it, (frame,) each; windows are independent."""
    rows, flashes = lent_rows(rows), lent_flashes(flashes)
    tail_s = REACH * flashes.fall_s
    k = window = 0
    for n in range(len(rows.value)):
        if window < len(rows.bounds) - 1 and n == rows.bounds[window]:
            window += 1
            fresh = True
        else:
            fresh = False
        open_s = rows.frame_start_s[n] + rows.row_place[row] * rows.row_time_s
        while k < len(flashes.start_s) and flashes.start_s[k] + flashes.duration_s[k] + tail_s <= open_s:
            k += 1
        own, shared = 1.0, 0.0
        j = k
        while j < len(flashes.start_s) and flashes.start_s[j] < open_s + rows.exposure_s:
            seen = seen_of(rows, flashes, n, row, j)
            own += rows.restless[row] * seen**2
            if not fresh:
                shared += rows.restless[row] * seen * seen_of(rows, flashes, n - 1, row, j)
            j += 1
        below[n] = 0.0 if fresh else shared / diagonal[n - 1]
        diagonal[n] = max(own - below[n] ** 2, 1.0) ** 0.5


@EXACT.kept
def whiten(column: Doubles, diagonal: Doubles, below: Doubles) -> None:
    """Whiten one value for every frame, in place."""
    column[0] /= diagonal[0]
    for n in range(1, len(column)):
        column[n] = (column[n] - below[n] * column[n - 1]) / diagonal[n]


@EXACT.kept
def whiten_all(columns: Doubles, diagonal: Doubles, below: Doubles, first: int, last: int) -> None:
    """Whiten the frames ``first`` to ``last`` of several values (frame, value), in place; a window begins there."""
    for n in range(first, last):
        for i in range(columns.shape[1]):
            before = columns[n - 1, i] if n > first else 0.0
            columns[n, i] = (columns[n, i] - below[n] * before) / diagonal[n]
