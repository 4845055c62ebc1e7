"""The board's clock against the host's: ``host time = gain * ticks + offset``, fitted to clock queries.

The host asks at ``asked_s`` and has the answer at ``answered_s``; the board took its time somewhere in between. So
every query bounds the line, and two queries far apart bound its gain hard, however slow the cable was in between.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from psvideo.model.arrays import Doubles

MOST_READINGS = 256
"""More are thinned: of those in one stretch of time the one with the shortest round trip is kept."""


@dataclass(frozen=True, kw_only=True)
class ClockQuery:
    """One clock query: the board's ticks, and between which two moments of the host's clock they were taken."""

    ticks: int
    asked_s: float
    answered_s: float


@dataclass(frozen=True, kw_only=True)
class ClockFit:
    """The fitted line. ``gain_error_ppm`` is a bound, not a standard deviation, as long as the clocks were steady.

    A strobe second lasts ``1 + offset_ppm * 1e-6`` host seconds, as in conventions.md.
    """

    s_per_tick: float
    offset_s: float
    offset_ppm: float
    gain_error_ppm: float
    readings: int

    def host_s(self, ticks: int) -> float:
        """Return when the board's clock showed a number of ticks, on the host's clock."""
        return self.s_per_tick * ticks + self.offset_s


def fit_clock(readings: Sequence[ClockQuery], *, tick_ps: int) -> ClockFit | None:
    """Return the line through clock queries, weighted by their round trips; None for fewer than two moments.

    A board that starts again counts from 0: what it says from there on is left out.
    """
    readings = _until_restart(readings)
    kept = _thinned(readings)
    if len(kept) < 2:
        return None
    ticks = np.array([reading.ticks - kept[0].ticks for reading in kept], np.float64)
    asked_s = np.array([reading.asked_s for reading in kept])
    answered_s = np.array([reading.answered_s for reading in kept])
    begin_s = asked_s[0]
    middle_s = 0.5 * (asked_s + answered_s) - begin_s
    width_s = np.maximum(answered_s - asked_s, 1e-6)
    gain, low, high = _gain(ticks, asked_s, answered_s, float(np.polyfit(ticks, middle_s, 1, w=1 / width_s)[0]))
    weight = width_s**-2
    offset_s = begin_s + float(np.sum(weight * (middle_s - gain * ticks)) / np.sum(weight))
    nominal_s = tick_ps * 1e-12
    return ClockFit(
        s_per_tick=gain,
        offset_s=offset_s - gain * kept[0].ticks,
        offset_ppm=(gain / nominal_s - 1) * 1e6,
        gain_error_ppm=max(abs(gain - low), abs(high - gain)) / nominal_s * 1e6,
        readings=len(readings),
    )


def _gain(ticks: Doubles, asked_s: Doubles, answered_s: Doubles, best: float) -> tuple[float, float, float]:
    """Return the gain within its bounds, and the bounds: what the queries, two by two, allow."""
    first, second = np.triu_indices(len(ticks), 1)
    apart = ticks[second] - ticks[first]
    low = float(((asked_s[second] - answered_s[first]) / apart).max())
    high = float(((answered_s[second] - asked_s[first]) / apart).min())
    return min(max(best, min(low, high)), max(low, high)), low, high


def _until_restart(readings: Sequence[ClockQuery]) -> Sequence[ClockQuery]:
    fell = (n for n, (before, now) in enumerate(pairwise(readings), 1) if now.ticks < before.ticks)
    return readings[: next(fell, len(readings))]


def _thinned(readings: Sequence[ClockQuery]) -> list[ClockQuery]:
    """Keep the best query of each stretch of time, and one of several at the same tick."""
    if not readings:
        return []
    first, last = readings[0].ticks, readings[-1].ticks
    best: dict[int, ClockQuery] = {}
    for reading in readings:
        stretch = (reading.ticks - first) * (MOST_READINGS - 1) // max(last - first, 1)
        held = best.get(stretch)
        if held is None or reading.answered_s - reading.asked_s < held.answered_s - held.asked_s:
            best[stretch] = reading
    return [best[stretch] for stretch in sorted(best)]
