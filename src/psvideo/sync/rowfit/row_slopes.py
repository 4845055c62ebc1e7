"""How what a row sees changes with the unknown times, compiled: the clock's shift, exposure, row time, and tails."""

from psvideo.compute.compiled import EXACT
from psvideo.model.arrays import Doubles
from psvideo.model.rows.shutter import REACH
from psvideo.sync.rowfit.given_off import OVER, SPREAD, given_off, reach_s, share_between
from psvideo.sync.rowfit.row_model import Flashes, Rows

LEFT, RIGHT, EXPOSURE, ROW_TIME, RISE, FALL, BLUR = range(7)
"""The signals of a step: the shift at a window's left and right end, exposure, row time, rise and fall time, blur."""
SIGNALS = 7


@EXACT.called
def _add_tail_slopes(
    flashes: Flashes, d: float, open_s: float, close_s: float, seen: float, light: float, probe_s: float,
    signals: Doubles,
) -> None:  # fmt: skip
    """Add how a flash's light changes with its tails: the difference to tails that are ``probe_s`` longer."""
    rise_s, fall_s, blur_s, row_s = flashes.rise_s, flashes.fall_s, flashes.blur_s, flashes.row_s
    signals[RISE] += (
        light * (share_between(open_s, close_s, d, rise_s + probe_s, fall_s, blur_s, row_s) - seen) / probe_s
    )
    signals[FALL] += (
        light * (share_between(open_s, close_s, d, rise_s, fall_s + probe_s, blur_s, row_s) - seen) / probe_s
    )
    if blur_s > 0.0:
        signals[BLUR] += (
            light * (share_between(open_s, close_s, d, rise_s, fall_s, blur_s + probe_s, row_s) - seen) / probe_s
        )


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
