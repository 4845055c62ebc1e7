"""The coarse search's loss, compiled: how badly brightnesses explain each row at each of a hundred thousand clocks.

Where flashes are square pulses and nothing flickers, as in nearly all searches, what a row saw of flashes is a short
list: of a dozen lights it sees one or two in a frame. Any other pulses go through ``kernel``, to the same losses.
"""

from typing import NamedTuple

import numpy as np

from psvideo.compute.compiled import EXACT
from psvideo.model.arrays import Doubles, Integers
from psvideo.sync.rowfit.kernel import factor, row_rest, solve_factored
from psvideo.sync.rowfit.row_model import Flashes, Rows, width

LARGE = 1e100
"""Logarithms are taken of products, which are kept below about this number."""
FASTER = 1.05
"""Clocks run faster than the plan's by less than this factor: a row sees no more flashes than it allows."""


class ListedFlashes(NamedTuple):
    """What one row saw of flashes: how many in each frame, ``many`` (frame,), and of each its brightness's number and
    which share was seen, ``unknown`` and ``share`` (frame, flash of the frame)."""

    many: Integers
    unknown: Integers
    share: Doubles


@EXACT.kept
def losses_by_row(
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
    size, most = width(rows, flashes), most_seen(rows, flashes)
    seen = ListedFlashes(np.empty(frames, np.int64), np.empty((frames, most), np.int64), np.empty((frames, most)))
    normal, right = np.empty((size, size)), np.empty(size)
    design, rest, value = np.empty((frames, size)), np.empty(frames), np.empty(frames)
    weight = np.ones((frames, height))
    square = flashes.rise_s == 0.0 and flashes.fall_s == 0.0 and flashes.blur_s == 0.0 and len(rows.beat_hz) == 0
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
            if square and rows.restless[row] == 0.0:
                value[:] = rows.value[:, row]
                list_seen(rows, row, moved, seen)
                for window in range(len(rows.bounds) - 1):
                    begin, end = rows.bounds[window], rows.bounds[window + 1]
                    _fit(value, seen, begin, end, normal, right)
                    total += _loss(value, seen, begin, end, right, steep)
            else:
                row_rest(rows, moved, weight, row, design, rest)
                for n in range(frames):
                    total += np.log1p(steep * rest[n] ** 2)
            found[clock, row] = total


@EXACT.inlined
def most_seen(rows: Rows, flashes: Flashes) -> int:
    """Return how many flashes a row may see in a frame at most."""
    closest_s, longest_s = np.inf, flashes.duration_s[0]
    for j in range(1, len(flashes.start_s)):
        closest_s = min(closest_s, flashes.start_s[j] - flashes.start_s[j - 1])
        longest_s = max(longest_s, flashes.duration_s[j])
    return int(FASTER * (rows.exposure_s + longest_s) / closest_s) + 2


@EXACT.inlined
def list_seen(rows: Rows, row: int, flashes: Flashes, seen: ListedFlashes) -> None:
    """List what a row saw of lit flashes in every frame."""
    start_s, duration_s, unknown = flashes.start_s, flashes.duration_s, flashes.unknown
    offset_s = rows.row_place[row] * rows.row_time_s
    count = len(start_s)
    k = 0
    for n in range(len(seen.many)):
        open_s = rows.frame_start_s[n] + offset_s
        close_s = open_s + rows.exposure_s
        while k < count and start_s[k] + duration_s[k] <= open_s:
            k += 1
        j, m = k, 0
        while j < count and start_s[j] < close_s:
            if unknown[j] > 0:
                since_s, until_s = max(open_s, start_s[j]), min(close_s, start_s[j] + duration_s[j])
                seen.unknown[n, m] = unknown[j]
                seen.share[n, m] = max(until_s - since_s, 0.0) / duration_s[j]
                m += 1
            j += 1
        seen.many[n] = m


@EXACT.inlined
def _fit(value: Doubles, seen: ListedFlashes, begin: int, end: int, normal: Doubles, right: Doubles) -> None:
    """Fit one row's brightnesses over some frames; they stand in ``right``, the room's light first."""
    normal[:] = 0.0
    right[:] = 0.0
    normal[0, 0] = end - begin
    for n in range(begin, end):
        right[0] += value[n]
        for p in range(seen.many[n]):
            i, share = seen.unknown[n, p], seen.share[n, p]
            right[i] += share * value[n]
            normal[i, 0] += share
            normal[i, i] += share * share
            for q in range(p):
                j, both = seen.unknown[n, q], share * seen.share[n, q]
                normal[max(i, j), min(i, j)] += both if i != j else 2.0 * both
    factor(normal, len(right))
    solve_factored(normal, right, len(right))


@EXACT.inlined
def _loss(value: Doubles, seen: ListedFlashes, begin: int, end: int, right: Doubles, steepness: float) -> float:
    """Return the sum of ``log(1 + steepness * rest^2)`` over some frames."""
    total, product = 0.0, 1.0
    for n in range(begin, end):
        rest = value[n] - right[0]
        for p in range(seen.many[n]):
            rest -= seen.share[n, p] * right[seen.unknown[n, p]]
        product *= 1.0 + steepness * rest * rest
        if product > LARGE:
            total += np.log(product)
            product = 1.0
    return float(total + np.log(product))
