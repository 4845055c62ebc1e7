"""The coarse search's loss, compiled: how badly brightnesses explain each row at each of a hundred thousand clocks.

Where flashes are square pulses and nothing flickers, as in nearly all searches, many clocks are worked on at a time
(``seen_shares``), to the losses of one clock at a time, bit by bit. Rows that open together share what they see, and
the factor of its normal matrix. Any other pulses go through ``kernel``.
"""

import numpy as np

from psvideo.compute.compiled import EXACT
from psvideo.model.arrays import Doubles, Integers
from psvideo.sync.rowfit.coarse.seen_shares import (
    LANES,
    MovedFlashes,
    SeenShares,
    most_seen,
    move,
    room_for,
    see_shares,
)
from psvideo.sync.rowfit.kernel import RIDGE, row_rest
from psvideo.sync.rowfit.row_model import Flashes, Rows, width

LARGE = 1e100
"""Logarithms are taken of products, which are kept below about this number."""


@EXACT.kept
def losses_of_any(
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
    """Fill ``found`` (clock, row) with the robust loss of every clock in every row: the sum over frames of
    ``log(1 + steepness * (rest / spread)^2)``."""
    frames, height = rows.value.shape
    design, rest, weight = np.empty((frames, width(rows, flashes))), np.empty(frames), np.ones((frames, height))
    for clock in range(first, last):
        moved = Flashes(
            phase_s[clock] + rate[clock] * flashes.start_s,
            rate[clock] * flashes.duration_s,
            flashes.unknown,
            flashes.unknowns,
            flashes.rise_s,
            flashes.fall_s,
            flashes.blur_s,
            flashes.row_s,
        )
        for row in range(height):
            total, steep = 0.0, steepness / spread[row] ** 2
            row_rest(rows, moved, weight, row, design, rest)
            for n in range(frames):
                total += np.log1p(steep * rest[n] ** 2)
            found[clock, row] = total


@EXACT.kept
def losses_of_square(
    rows: Rows,
    flashes: Flashes,
    phase_s: Doubles,
    rate: Doubles,
    order: Integers,
    spread: Doubles,
    steepness: float,
    first: int,
    last: int,
    found: Doubles,
) -> None:
    """Fill ``found`` (clock, row) as ``losses_of_any`` does, where pulses are square, nothing flickers and no row is
    restless, for the clocks that stand in ``order`` (clock,) from the ``first`` to the ``last``."""
    height, size, count = rows.value.shape[1], flashes.unknowns, len(flashes.start_s)
    moved = MovedFlashes(
        np.empty((count, LANES)), np.empty((count, LANES)), np.empty((count, LANES)), np.empty(count), np.empty(count)
    )
    seen = room_for(len(rows.value), 1)
    normal, right = np.empty((size, size, LANES)), np.empty((size, LANES))
    rest, product, total = np.empty(LANES), np.empty(LANES), np.empty((height, LANES))
    for begin in range(first, last, LANES):
        move(rows, flashes, phase_s, rate, order[begin : min(begin + LANES, last)], moved)
        most = most_seen(rows, moved)
        if most > seen.unknown.shape[1]:
            seen = room_for(len(rows.value), most)
        total[:] = 0.0
        row = 0
        while row < height:
            below = row + 1
            while below < height and rows.row_time_s * (rows.row_place[below] - rows.row_place[row]) == 0.0:
                below += 1
            see_shares(rows, flashes, row, moved, seen)
            for window in range(len(rows.bounds) - 1):
                start, end = rows.bounds[window], rows.bounds[window + 1]
                _factor(seen, start, end, normal)
                for one in range(row, below):
                    steep = steepness / spread[one] ** 2
                    _fit(rows.value, one, seen, start, end, normal, right)
                    _add_loss(rows.value, one, seen, start, end, right, steep, rest, product, total[one])
            row = below
        for lane in range(min(LANES, last - begin)):
            for one in range(height):
                found[order[begin + lane], one] = total[one, lane]


@EXACT.inlined
def _factor(seen: SeenShares, begin: int, end: int, normal: Doubles) -> None:
    """Make the normal matrices (unknown, unknown, lane) of some frames and factor them as ``kernel.factor`` does."""
    normal[:] = 0.0
    normal[0, 0] = end - begin
    for n in range(begin, end):
        for p in range(seen.many[n]):
            i = seen.unknown[n, p]
            for lane in range(LANES):
                normal[i, 0, lane] += seen.share[n, p, lane]
                normal[i, i, lane] += seen.share[n, p, lane] * seen.share[n, p, lane]
            for q in range(p):
                j = seen.unknown[n, q]
                low, high, times = min(i, j), max(i, j), 1.0 if i != j else 2.0
                for lane in range(LANES):
                    normal[high, low, lane] += times * (seen.share[n, p, lane] * seen.share[n, q, lane])
    for i in range(len(normal)):
        for lane in range(LANES):
            normal[i, i, lane] += RIDGE * normal[i, i, lane] + 1e-30
    for i in range(len(normal) - 1, -1, -1):
        for lane in range(LANES):
            normal[i, i, lane] = np.sqrt(max(normal[i, i, lane], 1e-30))
        for j in range(i):
            for lane in range(LANES):
                normal[i, j, lane] = np.true_divide(normal[i, j, lane], normal[i, i, lane])
        for j in range(i):
            for m in range(j + 1):
                for lane in range(LANES):
                    normal[j, m, lane] -= normal[i, j, lane] * normal[i, m, lane]


@EXACT.inlined
def _fit(value: Doubles, row: int, seen: SeenShares, begin: int, end: int, normal: Doubles, right: Doubles) -> None:
    """Fit one row's brightnesses over some frames; they stand in ``right`` (unknown, lane), the room's light first."""
    size = len(right)
    right[:] = 0.0
    for n in range(begin, end):
        for lane in range(LANES):
            right[0, lane] += value[n, row]
        for p in range(seen.many[n]):
            i = seen.unknown[n, p]
            for lane in range(LANES):
                right[i, lane] += seen.share[n, p, lane] * value[n, row]
    for i in range(size - 1, -1, -1):
        for lane in range(LANES):
            right[i, lane] = np.true_divide(right[i, lane], normal[i, i, lane])
        for m in range(i):
            for lane in range(LANES):
                right[m, lane] -= normal[i, m, lane] * right[i, lane]
    for i in range(size):
        for m in range(i):
            for lane in range(LANES):
                right[i, lane] -= normal[i, m, lane] * right[m, lane]
        for lane in range(LANES):
            right[i, lane] = np.true_divide(right[i, lane], normal[i, i, lane])


@EXACT.inlined
def _add_loss(
    value: Doubles,
    row: int,
    seen: SeenShares,
    begin: int,
    end: int,
    right: Doubles,
    steep: float,
    rest: Doubles,
    product: Doubles,
    total: Doubles,
) -> None:
    """Add to ``total`` (lane,) the sums of ``log(1 + steep * rest^2)`` over some frames."""
    window = np.zeros(LANES)
    product[:] = 1.0
    for n in range(begin, end):
        for lane in range(LANES):
            rest[lane] = value[n, row] - right[0, lane]
        for p in range(seen.many[n]):
            i = seen.unknown[n, p]
            for lane in range(LANES):
                rest[lane] -= seen.share[n, p, lane] * right[i, lane]
        large = 0
        for lane in range(LANES):
            product[lane] *= 1.0 + steep * rest[lane] * rest[lane]
            large += product[lane] > LARGE
        if large > 0:
            for lane in range(LANES):
                if product[lane] > LARGE:
                    window[lane] += np.log(product[lane])
                    product[lane] = 1.0
    for lane in range(LANES):
        total[lane] += window[lane] + np.log(product[lane])
