"""The times that a fit looks for: the strobe's clock on the camera's, the shutter, and how the LEDs answer."""

from dataclasses import dataclass, replace

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.model.plan import FlashTrain, Plan

UNBENT_STEPS = 5
"""Of bends by 2 % of the time, the most that a board can be trimmed by, they leave nothing of an hour."""


@dataclass(frozen=True, kw_only=True)
class FoundClock:
    """The strobe's clock on the camera's: flash 0 of a cycle starts at ``phase_s``; ``offset_ppm`` as in files.

    Where the clock drifts, ``bend_s`` (knot,) is by how much flashes come later than that at the times ``knot_s``
    (knot,), linear in between and beyond.
    """

    phase_s: float
    offset_ppm: float
    knot_s: tuple[float, ...] = ()
    bend_s: tuple[float, ...] = ()

    @property
    def rate(self) -> float:
        """Camera seconds per strobe second, bends left aside."""
        return 1.0 + self.offset_ppm * 1e-6

    def shifted(self, shift_s: float, ppm: float, *, pivot_s: float) -> "FoundClock":
        """Return this clock moved by ``shift_s`` and its periods made longer by ``ppm``, turning about
        ``pivot_s``, a time on the unbent clock."""
        phase_s = self.phase_s + shift_s + (self.phase_s - pivot_s) * ppm * 1e-6
        offset_ppm = self.offset_ppm + ppm * self.rate
        return FoundClock(phase_s=phase_s, offset_ppm=offset_ppm, knot_s=self.knot_s, bend_s=self.bend_s)

    def bent(self, knot_s: Doubles, shift_s: Doubles) -> "FoundClock":
        """Return this clock with ``shift_s`` (knot,) added to its bends at the given knots."""
        before_s = self.bend(knot_s)
        return replace(self, knot_s=tuple(float(t) for t in knot_s), bend_s=tuple(float(t) for t in before_s + shift_s))

    def bend(self, time_s: Doubles) -> Doubles:
        """Return the bend at times on the unbent clock, same shape; straight on beyond the last knots."""
        if not self.knot_s:
            return np.zeros_like(time_s)
        knot_s, bend_s = np.array(self.knot_s), np.array(self.bend_s)
        inside: Doubles = np.interp(time_s, knot_s, bend_s)
        if len(knot_s) > 1:
            slope = np.diff(bend_s) / np.diff(knot_s)
            inside = inside + slope[0] * np.minimum(time_s - knot_s[0], 0.0)
            inside = inside + slope[-1] * np.maximum(time_s - knot_s[-1], 0.0)
        return inside

    def unbent_s(self, at_s: float) -> float:
        """Return the time on the unbent clock of what comes at a time on this one: ``bend`` reversed.

        However far a clock is bent by hours of a strobe that follows the camera, it is bent by a small share of each
        second, and every step leaves that share of the error.
        """
        unbent_s = at_s
        for _ in range(UNBENT_STEPS if self.knot_s else 0):
            unbent_s = at_s - float(self.bend(np.array([unbent_s]))[0])
        return unbent_s

    def mean_offset_ppm(self) -> float:
        """Return the offset that fits the whole clip best, bends included."""
        if len(self.knot_s) < 2:
            return self.offset_ppm
        return self.offset_ppm + 1e6 * self.rate * float(np.polyfit(self.knot_s, self.bend_s, 1)[0])


@dataclass(frozen=True, kw_only=True)
class Beat:
    """All the times of a clip. ``row_time_s`` is never negative: ``upward``: the bottom row comes first.

    ``beat_hz`` are the frequencies at which ambient light flickers, ``blur_s`` the standard deviation by which rows are
    blurred, as a time.
    """

    clock: FoundClock
    row_time_s: float
    exposure_s: float
    upward: bool = False
    rise_s: float = 0.0
    fall_s: float = 0.0
    beat_hz: tuple[float, ...] = ()
    blur_s: float = 0.0

    def with_phase(self, phase_s: float) -> "Beat":
        """Return the same beat with its cycle beginning elsewhere."""
        return replace(self, clock=replace(self.clock, phase_s=phase_s))


def train_between(plan: Plan, clock: FoundClock, from_s: float, until_s: float) -> FlashTrain:
    """Return the flashes between two times, and at least a cycle more at either end, on the camera's clock."""
    cycle = len(plan.cycle_slots)
    cycle_s = plan.cycle_s * clock.rate
    begin = int(np.floor((clock.unbent_s(from_s) - clock.phase_s) / cycle_s)) - 1
    end = int(np.ceil((clock.unbent_s(until_s) - clock.phase_s) / cycle_s)) + 1
    train = plan.train(begin * cycle, (end - begin) * cycle)
    straight_s = clock.phase_s + train.start_s * clock.rate
    ends_s = straight_s + train.duration_s * clock.rate
    start_s = straight_s + clock.bend(straight_s)
    return FlashTrain(slot=train.slot, start_s=start_s, duration_s=ends_s + clock.bend(ends_s) - start_s)
