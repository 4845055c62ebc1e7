"""The row model, compiled: what each row of a frame saw of the flashes, and how that changes with the times.

A row's mean in frame n is ``ambient + sum_k (F(close - s_k) - F(open - s_k)) * brightness[slot of k]``, F being the
share of its light that a flash has given off (an exponential rise and fall, 1/e times, round a square pulse). The
flashes' weights equal ``shutter.row_weights`` where there are no tails; a test holds the two together. Compression and
scaling blur rows as if every flash were spread out evenly to either side, which is a time as well.
"""

from typing import NamedTuple

import numpy as np

from psvideo.compute.compiled import EXACT
from psvideo.compute.memory import lent
from psvideo.model.arrays import Doubles, Integers
from psvideo.model.rows.shutter import REACH

OVER = 40.0
"""After this many, double precision cannot tell that it is not."""
LEFT, RIGHT, EXPOSURE, ROW_TIME, RISE, FALL, BLUR = range(7)
"""The signals of a step: the shift at a window's left and right end, exposure, row time, rise and fall time, blur."""
SIGNALS = 7
SPREAD = 3.0**0.5
"""Three points, at these standard deviations with weights 1, 4 and 1, blur as a Gaussian (Gauss-Hermite quadrature).
No row takes light from nearer than the next one: where a blur is less than that, the outer points are there, and weigh
less."""

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
def reach_s(blur_s: float, row_s: float) -> float:
    """Return how far a blur takes light from, 0 where there is none."""
    return max(SPREAD * blur_s, row_s) if blur_s > 0.0 else 0.0


@EXACT.kept
def given_off(
    since_s: float, duration_s: float, rise_s: float, fall_s: float, blur_s: float, row_s: float
) -> tuple[float, float]:
    """Return the share of its light that a flash has given off, and the rate at which it does so now."""
    share, rate = _sharp(since_s, duration_s, rise_s, fall_s)
    if blur_s <= 0.0:
        return share, rate
    apart_s = reach_s(blur_s, row_s)
    outer = 0.5 * (blur_s / apart_s) ** 2
    before, rate_before = _sharp(since_s - apart_s, duration_s, rise_s, fall_s)
    after, rate_after = _sharp(since_s + apart_s, duration_s, rise_s, fall_s)
    inner = 1.0 - 2.0 * outer
    return inner * share + outer * (before + after), inner * rate + outer * (rate_before + rate_after)


@EXACT.kept
def _sharp(since_s: float, duration_s: float, rise_s: float, fall_s: float) -> tuple[float, float]:
    """Return the share and the rate where nothing is blurred."""
    if since_s <= 0.0:
        return 0.0, 0.0
    reached, whole = 1.0, duration_s
    if rise_s > 0.0:
        reached = 1.0 - np.exp(-duration_s / rise_s)
        whole -= rise_s * reached
    whole += reached * fall_s
    if since_s < duration_s:
        if rise_s > 0.0:
            lit = 1.0 - np.exp(-since_s / rise_s)
            return (since_s - rise_s * lit) / whole, lit / whole
        return since_s / whole, 1.0 / whole
    if fall_s <= 0.0:
        return 1.0, 0.0
    left = reached * np.exp(-(since_s - duration_s) / fall_s)
    return 1.0 - fall_s * left / whole, left / whole


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


@EXACT.called
def _share(
    open_s: float, close_s: float, duration_s: float, rise_s: float, fall_s: float, blur_s: float, row_s: float
) -> float:
    """Return the share of a flash that is given off between two times since its start."""
    after, _ = given_off(close_s, duration_s, rise_s, fall_s, blur_s, row_s)
    before, _ = given_off(open_s, duration_s, rise_s, fall_s, blur_s, row_s)
    return after - before


@EXACT.called
def _add_tail_slopes(
    flashes: Flashes, d: float, open_s: float, close_s: float, seen: float, light: float, probe_s: float,
    signals: Doubles,
) -> None:  # fmt: skip
    """Add how a flash's light changes with its tails: the difference to tails that are ``probe_s`` longer."""
    rise_s, fall_s, blur_s, row_s = flashes.rise_s, flashes.fall_s, flashes.blur_s, flashes.row_s
    signals[RISE] += light * (_share(open_s, close_s, d, rise_s + probe_s, fall_s, blur_s, row_s) - seen) / probe_s
    signals[FALL] += light * (_share(open_s, close_s, d, rise_s, fall_s + probe_s, blur_s, row_s) - seen) / probe_s
    if blur_s > 0.0:
        signals[BLUR] += light * (_share(open_s, close_s, d, rise_s, fall_s, blur_s + probe_s, row_s) - seen) / probe_s


@EXACT.kept
def slopes(
    rows: Rows, flashes: Flashes, frame: int, row: int, k: int, brightness: Doubles, tails: bool, signals: Doubles
) -> float:
    """Fill ``signals`` (SIGNALS,) with how the model's value changes with each unknown time."""
    open_s = rows.frame_start_s[frame] + rows.row_place[row] * rows.row_time_s
    close_s = open_s + rows.exposure_s
    rise_s, fall_s, blur_s, row_s = flashes.rise_s, flashes.fall_s, flashes.blur_s, flashes.row_s
    probe_s = 0.01 * flashes.duration_s[0]
    near_s = reach_s(blur_s, row_s)
    tail_s = REACH * fall_s + near_s
    before_s = near_s + (SPREAD * probe_s if tails else 0.0)
    over_s = OVER * (fall_s + (probe_s if tails else 0.0)) + before_s
    signals[:] = 0.0
    j = k
    while j > 0 and flashes.start_s[j - 1] + flashes.duration_s[j - 1] + tail_s + REACH * probe_s > open_s:
        j -= 1
    closing = opening = 0.0
    while j < len(flashes.start_s) and flashes.start_s[j] - near_s < close_s:
        u, d = flashes.unknown[j], flashes.duration_s[j]
        since_close_s, since_open_s = close_s - flashes.start_s[j], open_s - flashes.start_s[j]
        is_whole = since_open_s <= -before_s and since_close_s >= d + over_s  # however it is moved a little
        if u > 0 and not is_whole:
            after, after_rate = given_off(since_close_s, d, rise_s, fall_s, blur_s, row_s)
            before, before_rate = given_off(since_open_s, d, rise_s, fall_s, blur_s, row_s)
            closing += brightness[u] * after_rate
            opening += brightness[u] * before_rate
            if tails:
                _add_tail_slopes(
                    flashes, d, since_open_s, since_close_s, after - before, brightness[u], probe_s, signals
                )
        j += 1
    signals[EXPOSURE] = closing
    signals[ROW_TIME] = (closing - opening) * rows.row_place[row]
    return opening - closing


@EXACT.kept
def seen_of(rows: Rows, flashes: Flashes, frame: int, row: int, j: int) -> float:
    """Return the share of flash ``j`` that a row saw in a frame, 0 for a dark slot."""
    if flashes.unknown[j] == 0:
        return 0.0
    open_s = rows.frame_start_s[frame] + rows.row_place[row] * rows.row_time_s - flashes.start_s[j]
    close_s = open_s + rows.exposure_s
    return _share(open_s, close_s, flashes.duration_s[j], flashes.rise_s, flashes.fall_s, flashes.blur_s, flashes.row_s)


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
