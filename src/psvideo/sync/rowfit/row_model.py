"""The row model, compiled: what each row of a frame saw of the flashes.

A row's mean in frame n is ``ambient + sum_k (F(close - s_k) - F(open - s_k)) * brightness[slot of k]``, F being the
share of its light that a flash has given off (``given_off``). The flashes' weights equal ``shutter.row_weights`` where
there are no tails; a test holds the two together. How a row changes with the unknown times is ``row_slopes``.
"""

from typing import NamedTuple

import numpy as np

from psvideo.compute.compiled import EXACT
from psvideo.compute.memory import lent
from psvideo.model.arrays import Doubles, Integers
from psvideo.model.rows.shutter import REACH
from psvideo.sync.rowfit.given_off import OVER, given_off, reach_s, share_between

PARTS = 8
PLACES = 2 * PARTS + 1
"""Parts of a flash in which a row may open, then those in which it may close; 0: it does neither."""


class Rows(NamedTuple):
    """Profiles as compiled code takes them. ``row_place`` counts rows from the first that opens."""

    value: Doubles
    frame_start_s: Doubles
    row_place: Doubles
    row_time_s: float
    exposure_s: float
    bounds: Integers
    ends_s: Doubles
    """Where each window begins and the last one ends, on the camera's clock: the shift is linear in between."""
    beat_hz: Doubles
    """Frequencies at which ambient light may flicker."""
    restless: Doubles
    """By how much a light's flashes differ in each row (row,), as variance over the noise's; 0 where all are alike."""


class Flashes(NamedTuple):
    """A train of flashes. ``unknown`` numbers each flash's brightness from 1, 0 for a dark slot."""

    start_s: Doubles
    duration_s: Doubles
    unknown: Integers
    unknowns: int
    rise_s: float = 0.0
    fall_s: float = 0.0
    blur_s: float = 0.0
    """The standard deviation by which rows are blurred, as a time;"""
    row_s: float = 0.0
    """and the time from one row to the next."""


@EXACT.inlined
def lent_rows(rows: Rows) -> Rows:
    """The same without reference counts, which every call for a sample would count up and down."""
    return Rows(
        lent(rows.value), lent(rows.frame_start_s), lent(rows.row_place), rows.row_time_s, rows.exposure_s,
        lent(rows.bounds), lent(rows.ends_s), lent(rows.beat_hz), lent(rows.restless),
    )  # fmt: skip


@EXACT.inlined
def lent_flashes(flashes: Flashes) -> Flashes:
    """The same without reference counts."""
    return Flashes(
        lent(flashes.start_s), lent(flashes.duration_s), lent(flashes.unknown), flashes.unknowns, flashes.rise_s,
        flashes.fall_s, flashes.blur_s, flashes.row_s,
    )  # fmt: skip


@EXACT.kept
def width(rows: Rows, flashes: Flashes) -> int:
    """Return how many numbers a row has in a window: brightnesses, and flicker's two phases."""
    return flashes.unknowns + 2 * len(rows.beat_hz)


@EXACT.kept
def see(rows: Rows, flashes: Flashes, frame: int, row: int, k: int, design: Doubles) -> int:
    """Fill ``design`` (unknown,) with what a row saw in a frame; return the first flash that may matter to the next."""
    design[:] = 0.0
    design[0] = 1.0
    open_s = rows.frame_start_s[frame] + rows.row_place[row] * rows.row_time_s
    close_s = open_s + rows.exposure_s
    near_s = reach_s(flashes.blur_s, flashes.row_s)
    tail_s = REACH * flashes.fall_s + near_s
    over_s = OVER * flashes.fall_s + near_s
    while k < len(flashes.start_s) and flashes.start_s[k] + flashes.duration_s[k] + tail_s <= open_s:
        k += 1
    j = k
    while j < len(flashes.start_s) and flashes.start_s[j] - near_s < close_s:
        u = flashes.unknown[j]
        if u > 0:
            start_s, duration_s = flashes.start_s[j], flashes.duration_s[j]
            if flashes.rise_s == 0.0 and flashes.fall_s == 0.0 and flashes.blur_s == 0.0:
                design[u] += max(min(close_s, start_s + duration_s) - max(open_s, start_s), 0.0) / duration_s
            elif open_s <= start_s - near_s and close_s >= start_s + duration_s + over_s:
                design[u] += 1.0
            else:
                after, _ = given_off(
                    close_s - start_s, duration_s, flashes.rise_s, flashes.fall_s, flashes.blur_s, flashes.row_s
                )
                before, _ = given_off(
                    open_s - start_s, duration_s, flashes.rise_s, flashes.fall_s, flashes.blur_s, flashes.row_s
                )
                design[u] += after - before
        j += 1
    for b in range(len(rows.beat_hz)):
        turn = 2 * np.pi * rows.beat_hz[b] * (open_s + 0.5 * rows.exposure_s)
        design[flashes.unknowns + 2 * b] = np.cos(turn)
        design[flashes.unknowns + 2 * b + 1] = np.sin(turn)
    return k


@EXACT.kept
def places(rows: Rows, flashes: Flashes, found: Integers) -> None:
    """Fill ``found`` (frame, row) with the part of a flash in which each row opens or closes, below ``PLACES``.

    A flash lasts here until its tail has fallen to 1/e; where a row opens in one and closes in another, it opens.
    """
    frames, height = found.shape
    for row in range(height):
        k = 0
        for n in range(frames):
            open_s = rows.frame_start_s[n] + rows.row_place[row] * rows.row_time_s
            close_s = open_s + rows.exposure_s
            found[n, row] = 0
            while k < len(flashes.start_s) and flashes.start_s[k] + flashes.duration_s[k] + flashes.fall_s <= open_s:
                k += 1
            j = k
            while found[n, row] == 0 and j < len(flashes.start_s) and flashes.start_s[j] < close_s:
                lasts_s = flashes.duration_s[j] + flashes.fall_s
                opens, closes = (open_s - flashes.start_s[j]) / lasts_s, (close_s - flashes.start_s[j]) / lasts_s
                if flashes.unknown[j] > 0 and 0.0 <= opens < 1.0:
                    found[n, row] = 1 + int(PARTS * opens)
                elif flashes.unknown[j] > 0 and 0.0 <= closes < 1.0:
                    found[n, row] = 1 + PARTS + int(PARTS * closes)
                j += 1


@EXACT.called
def see_all(rows: Rows, flashes: Flashes, row: int, design: Doubles) -> None:
    """Fill ``design`` (frame, unknown) with what a row saw in every frame, as ``see`` does frame by frame."""
    if flashes.rise_s == 0.0 and flashes.fall_s == 0.0 and flashes.blur_s == 0.0 and len(rows.beat_hz) == 0:
        _see_sharp(rows.frame_start_s, rows.row_place[row] * rows.row_time_s, rows.exposure_s, flashes, design)
        return
    rows, flashes, design = lent_rows(rows), lent_flashes(flashes), lent(design)
    k = 0
    for n in range(len(design)):
        k = see(rows, flashes, n, row, k, design[n])


@EXACT.called
def _see_sharp(frame_start_s: Doubles, offset_s: float, exposure_s: float, flashes: Flashes, design: Doubles) -> None:
    """Fill ``design`` where flashes are square pulses and nothing flickers, which most searches try."""
    start_s, duration_s, unknown = flashes.start_s, flashes.duration_s, flashes.unknown
    count, size = len(start_s), design.shape[1]
    k = 0
    for n in range(len(design)):
        design[n, 0] = 1.0
        for u in range(1, size):
            design[n, u] = 0.0
        open_s = frame_start_s[n] + offset_s
        close_s = open_s + exposure_s
        while k < count and start_s[k] + duration_s[k] <= open_s:
            k += 1
        j = k
        while j < count and start_s[j] < close_s:
            if unknown[j] > 0:
                since_s, until_s = max(open_s, start_s[j]), min(close_s, start_s[j] + duration_s[j])
                design[n, unknown[j]] += max(until_s - since_s, 0.0) / duration_s[j]
            j += 1


@EXACT.kept
def seen_of(rows: Rows, flashes: Flashes, frame: int, row: int, j: int) -> float:
    """Return the share of flash ``j`` that a row saw in a frame, 0 for a dark slot."""
    if flashes.unknown[j] == 0:
        return 0.0
    open_s = rows.frame_start_s[frame] + rows.row_place[row] * rows.row_time_s - flashes.start_s[j]
    close_s = open_s + rows.exposure_s
    return share_between(
        open_s, close_s, flashes.duration_s[j], flashes.rise_s, flashes.fall_s, flashes.blur_s, flashes.row_s
    )


@EXACT.kept
def predictions(rows: Rows, flashes: Flashes, brightness: Doubles, first: int, last: int, found: Doubles) -> None:
    """Fill ``found`` (frame, row) with what known brightnesses (row, unknown) give."""
    frames, size = len(rows.value), width(rows, flashes)
    design = np.empty((frames, size))
    for row in range(first, last):
        see_all(rows, flashes, row, design)
        for n in range(frames):
            total = 0.0
            for i in range(size):
                total += design[n, i] * brightness[row, i]
            found[n, row] = total
