"""The coarse search where the readout is unknown, compiled: every row at one place, and sums along every readout.

All rows are scored as if they opened together. So what they saw of flashes is listed, and its normal matrix factored,
once for all of them; and the loops over rows have nothing to decide, so that several rows are worked on at a time. Sums
keep their order: losses are those of ``search_kernel``, to the bit.
"""

import numpy as np

from psvideo.compute.compiled import EXACT
from psvideo.model.arrays import Doubles, Integers
from psvideo.sync.rowfit.coarse.search_kernel import LARGE, ListedFlashes, list_seen, most_seen
from psvideo.sync.rowfit.kernel import factor
from psvideo.sync.rowfit.row_model import Flashes, Rows, width


@EXACT.kept
def losses_together(
    rows: Rows,
    flashes: Flashes,
    phase_s: Doubles,
    rate: Doubles,
    spread: Doubles,
    steepness: float,
    first: int,
    last: int,
    found: Doubles,
) -> None:
    """Fill ``found`` (clock, row) as ``losses_by_row`` does, of rows that all open with the first, calm ones that see
    square pulses."""
    frames, height = rows.value.shape
    size, most = width(rows, flashes), most_seen(rows, flashes)
    seen = ListedFlashes(np.empty(frames, np.int64), np.empty((frames, most), np.int64), np.empty((frames, most)))
    normal, right = np.empty((size, size)), np.empty((size, height))
    rest, product, steep = np.empty(height), np.empty(height), steepness / spread**2
    for clock in range(first, last):
        moved = Flashes(
            phase_s[clock] + rate[clock] * flashes.start_s,
            rate[clock] * flashes.duration_s,
            flashes.unknown,
            flashes.unknowns,
        )
        list_seen(rows, 0, moved, seen)
        found[clock] = 0.0
        for window in range(len(rows.bounds) - 1):
            begin, end = rows.bounds[window], rows.bounds[window + 1]
            _fit(rows.value, seen, begin, end, normal, right)
            _add_loss(rows.value, seen, begin, end, right, steep, rest, product, found[clock])


@EXACT.inlined
def _fit(value: Doubles, seen: ListedFlashes, begin: int, end: int, normal: Doubles, right: Doubles) -> None:
    """Fit all rows' brightnesses over some frames; they stand in ``right`` (unknown, row), the room's light first."""
    normal[:] = 0.0
    right[:] = 0.0
    normal[0, 0] = end - begin
    height = right.shape[1]
    for n in range(begin, end):
        for row in range(height):
            right[0, row] += value[n, row]
        for p in range(seen.many[n]):
            i, share = seen.unknown[n, p], seen.share[n, p]
            for row in range(height):
                right[i, row] += share * value[n, row]
            normal[i, 0] += share
            normal[i, i] += share * share
            for q in range(p):
                j, both = seen.unknown[n, q], share * seen.share[n, q]
                normal[max(i, j), min(i, j)] += both if i != j else 2.0 * both
    factor(normal, len(right))
    _solve_factored(normal, right)


@EXACT.inlined
def _solve_factored(normal: Doubles, right: Doubles) -> None:
    """Solve with the factor for every row, as ``kernel.solve_factored`` does for one."""
    size, height = right.shape
    for i in range(size - 1, -1, -1):
        for row in range(height):
            right[i, row] /= normal[i, i]
        for m in range(i):
            if normal[i, m] != 0.0:
                for row in range(height):
                    right[m, row] -= normal[i, m] * right[i, row]
    for i in range(size):
        for m in range(i):
            if normal[i, m] != 0.0:
                for row in range(height):
                    right[i, row] -= normal[i, m] * right[m, row]
        for row in range(height):
            right[i, row] /= normal[i, i]


@EXACT.inlined
def _add_loss(
    value: Doubles,
    seen: ListedFlashes,
    begin: int,
    end: int,
    right: Doubles,
    steep: Doubles,
    rest: Doubles,
    product: Doubles,
    total: Doubles,
) -> None:
    """Add to ``total`` (row,) the sums of ``log(1 + steep * rest^2)`` over some frames."""
    height = len(rest)
    window = np.zeros(height)
    product[:] = 1.0
    for n in range(begin, end):
        for row in range(height):
            rest[row] = value[n, row] - right[0, row]
        for p in range(seen.many[n]):
            i, share = seen.unknown[n, p], seen.share[n, p]
            for row in range(height):
                rest[row] -= share * right[i, row]
        largest = 0.0
        for row in range(height):
            product[row] *= 1.0 + steep[row] * rest[row] * rest[row]
            largest = max(largest, product[row])
        if largest > LARGE:
            for row in range(height):
                if product[row] > LARGE:
                    window[row] += np.log(product[row])
                    product[row] = 1.0
    for row in range(height):
        total[row] += window[row] + np.log(product[row])


@EXACT.kept
def least_over_readouts(
    loss: Doubles,
    below: Integers,
    part: Doubles,
    first: int,
    last: int,
    least: Doubles,
    readout: Integers,
    at: Integers,
) -> None:
    """Fill ``least`` (phase,), from the ``first`` to the ``last``, with the lowest mean over the rows that any readout
    and any clock ratio gives, and which two do: the first ones of several.

    ``loss`` (row, ratio, phase) goes around the cycle twice. A readout opens a row ``below`` (readout, row) whole steps
    in phase later than the first, and a ``part`` of one.
    """
    height, ratios, phases = loss.shape[0], loss.shape[1], loss.shape[2] // 2
    total = np.empty(last - first)
    least[first:last] = np.inf
    for r in range(len(below)):
        for a in range(ratios):
            total[:] = 0.0
            for row in range(height):
                low = phases - below[r, row] % phases + first
                here, more = 1.0 - part[r, row], part[r, row]
                line = loss[row, a, low - 1 : low + len(total)]
                for b in range(len(total)):
                    total[b] += here * line[b + 1] + more * line[b]
            for b in range(len(total)):
                mean = total[b] / height
                if mean < least[first + b]:
                    least[first + b], readout[first + b], at[first + b] = mean, r, a
