"""What a row saw of flashes under many clocks at a time, compiled: the shares that the coarse search's loss is made of.

Clocks are worked on together under which flashes come at nearly the same times, so that a row sees the same few under
all of them. A flash that it sees under some of them alone counts as a share of 0 under the others: no sum changes.
"""

from typing import NamedTuple

import numpy as np

from psvideo.compute.compiled import EXACT
from psvideo.model.arrays import Doubles, Integers
from psvideo.sync.rowfit.row_model import Flashes, Rows

LANES = 64
"""Clocks at a time. Of fewer the compiler makes no vectors of numbers: 16 took more than twice as long."""


class MovedFlashes(NamedTuple):
    """Flashes under several clocks: when each begins, ends, and for how long it is lit (flash, lane), and from when
    until when it may be lit under any (flash,)."""

    start_s: Doubles
    end_s: Doubles
    lit_s: Doubles
    earliest_s: Doubles
    latest_s: Doubles


class SeenShares(NamedTuple):
    """What a row saw of flashes: how many in each frame, ``many`` (frame,), and of each its brightness's number,
    ``unknown`` (frame, flash of the frame), and which ``share`` was seen (frame, flash of the frame, lane)."""

    many: Integers
    unknown: Integers
    share: Doubles


@EXACT.inlined
def room_for(frames: int, most: int) -> SeenShares:
    """Return room for so many frames, and as many flashes in each at most."""
    return SeenShares(np.empty(frames, np.int64), np.empty((frames, most), np.int64), np.empty((frames, most, LANES)))


@EXACT.inlined
def move(rows: Rows, flashes: Flashes, phase_s: Doubles, rate: Doubles, clocks: Integers, moved: MovedFlashes) -> None:
    """Move the flashes by some clocks, up to ``LANES``; the last stands for those that are left over. Those that no row
    sees are left out."""
    low_s = high_s = phase_s[clocks[0]]
    slow = fast = rate[clocks[0]]
    for clock in clocks:
        low_s, high_s = min(low_s, phase_s[clock]), max(high_s, phase_s[clock])
        slow, fast = min(slow, rate[clock]), max(fast, rate[clock])
    opens_s = rows.frame_start_s[0]
    closes_s = rows.frame_start_s[-1] + rows.row_time_s * max(rows.row_place[0], rows.row_place[-1]) + rows.exposure_s
    for j in range(len(flashes.start_s)):
        start_s, lit_s = flashes.start_s[j], flashes.duration_s[j]
        moved.earliest_s[j] = low_s + min(slow * start_s, fast * start_s)
        moved.latest_s[j] = high_s + max(slow * start_s, fast * start_s) + fast * lit_s
        if moved.latest_s[j] > opens_s and moved.earliest_s[j] < closes_s:
            for lane in range(LANES):
                clock = clocks[min(lane, len(clocks) - 1)]
                moved.start_s[j, lane] = phase_s[clock] + rate[clock] * start_s
                moved.lit_s[j, lane] = rate[clock] * lit_s
                moved.end_s[j, lane] = moved.start_s[j, lane] + moved.lit_s[j, lane]


@EXACT.inlined
def most_seen(rows: Rows, moved: MovedFlashes) -> int:
    """Return how many flashes a row may see in a frame at most, under any of the clocks."""
    most, j = 1, 0
    for k in range(len(moved.latest_s)):
        while j < len(moved.latest_s) and moved.earliest_s[j] < moved.latest_s[k] + rows.exposure_s:
            j += 1
        most = max(most, j - k)
    return most


@EXACT.inlined
def see_shares(rows: Rows, flashes: Flashes, row: int, moved: MovedFlashes, seen: SeenShares) -> None:
    """List what a row saw of lit flashes in every frame."""
    offset_s = rows.row_place[row] * rows.row_time_s
    count = len(moved.latest_s)
    k = 0
    for n in range(len(seen.many)):
        open_s = rows.frame_start_s[n] + offset_s
        close_s = open_s + rows.exposure_s
        while k < count and moved.latest_s[k] <= open_s:
            k += 1
        j, m = k, 0
        while j < count and moved.earliest_s[j] < close_s:
            if flashes.unknown[j] > 0:
                seen.unknown[n, m] = flashes.unknown[j]
                for lane in range(LANES):
                    light_s = min(close_s, moved.end_s[j, lane]) - max(open_s, moved.start_s[j, lane])
                    seen.share[n, m, lane] = np.true_divide(max(light_s, 0.0), moved.lit_s[j, lane])
                m += 1
            j += 1
        seen.many[n] = m
