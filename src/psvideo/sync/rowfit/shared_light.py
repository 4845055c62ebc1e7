"""What frames that share a flash, and rows in dark slots, say of the strobe's place, whatever brightness does.

Two frames that share a flash saw the same light of the same moment, each the part that its opening says; and what
shines in a dark slot was never flashed. Both hold row by row and flash by flash.
"""

from dataclasses import dataclass, replace

import numpy as np

from psvideo.model.arrays import Doubles, Integers, Mask
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat, train_between
from psvideo.sync.rowfit.profiles import Profiles

TURNS = 6
"""A place is sharpened in so many turns."""
SHIFT, MOST_STEP = 0.01, 25
"""Slopes are taken over the first of the shortest flash, and no step is longer than so many of those."""
LEAST_DARK = 3
"""Of so many dark slots a row's ambient light is known."""
SPLIT, UNSEEN = 0.15, 1e-3
"""Each of two frames must have seen the first of a flash for what they say together; a row that saw less than the
second of any is dark."""


@dataclass(frozen=True, kw_only=True)
class _Asked:
    """What rows show (frame, row), with the number of the ``flash`` that each saw and the share of it that was ``seen``
    (frame, row); ``dark``: no light should be there; ``shared`` (frame - 1, row): the next frame saw the same flash."""

    value: Doubles
    flash: Integers
    seen: Doubles
    dark: Mask
    shared: Mask

    @property
    def apart(self) -> Doubles:
        """By how much two frames contradict each other on a flash that they share, 0 elsewhere, (frame - 1, row)."""
        one, other = self.seen[:-1], self.seen[1:]
        size = np.sqrt(np.maximum(one**2 + other**2, SPLIT**2))
        return np.where(self.shared, (self.value[:-1] * other - self.value[1:] * one) / size, 0.0)


def left_of(plan: Plan, rows: Profiles, beat: Beat) -> float:
    """Return which share of their light split flashes and dark slots contradict: 0 where all agree, about 1 where none
    do. In ``rows`` 0 is no flash."""
    asked = _asked(plan, rows, beat)
    usual = rows.value**2
    usual[1:-1] = (usual[:-2] + usual[1:-1] + usual[2:]) / 3  # beside a dark slot the same row is lit
    light = float(usual[asked.dark].sum() + 0.5 * (usual[1:] + usual[:-1])[asked.shared].sum())
    return float((rows.value[asked.dark] ** 2).sum() + (asked.apart**2).sum()) / max(light, 1e-30)


def _asked(plan: Plan, rows: Profiles, beat: Beat) -> _Asked:
    until_s = float(rows.frame_start_s[-1] + rows.period_s + beat.exposure_s)
    train = train_between(plan, beat.clock, float(rows.frame_start_s[0]), until_s)
    ends_s, lit = train.start_s + train.duration_s, np.isin(train.slot, plan.lit_slots)
    opens_s = rows.frame_start_s[:, None] + rows.place * beat.row_time_s
    flash = np.minimum(np.searchsorted(ends_s, opens_s, side="right"), len(ends_s) - 1)
    seen_s = np.minimum(opens_s + beat.exposure_s, ends_s[flash]) - np.maximum(opens_s, train.start_s[flash])
    seen = np.maximum(seen_s, 0.0) / train.duration_s[flash]
    both = (flash[1:] == flash[:-1]) & lit[flash[1:]] & (np.minimum(seen[1:], seen[:-1]) > SPLIT)
    return _Asked(value=rows.value, flash=flash, seen=seen, dark=~lit[flash] | (seen < UNSEEN), shared=both)


def sharpened(plan: Plan, rows: Profiles, beat: Beat) -> tuple[Beat, float]:
    """Return a beat whose split flashes agree best (Gauss-Newton), with the error of its times: what is wrong of a
    flash is wrong of all its rows, so each is left out as one (the jackknife: Bell and McCaffrey 2002)."""
    flash_s, start_s = plan.shortest_flash_s, rows.frame_start_s
    pivot_s, half_s = float(start_s.mean()), max(0.5 * float(np.ptp(start_s)), rows.period_s)
    turn_ppm = 1e6 * SHIFT * flash_s / half_s  # moves the clip's ends by as much as the other step moves all of it
    held, moves = turn_ppm / (0.5 * plan.clock_range_ppm), np.zeros((0, 2))
    for _ in range(TURNS):
        rows = _without_ambient(plan, rows, beat)
        asked = _asked(plan, rows, beat)
        apart = asked.apart
        moved = (
            replace(beat, clock=beat.clock.shifted(SHIFT * flash_s, 0.0, pivot_s=pivot_s)),
            replace(beat, clock=beat.clock.shifted(0.0, turn_ppm, pivot_s=pivot_s)),
        )
        kept = [replace(_asked(plan, rows, one), shared=asked.shared).apart[asked.shared] for one in moved]
        slopes, rest = np.stack([one - apart[asked.shared] for one in kept]), apart[asked.shared]
        known = np.diag([0.0, float(np.mean(rest**2)) * held**2 if len(rest) else 1.0])
        whole = slopes @ slopes.T + known
        step = -np.linalg.pinv(whole) @ (slopes @ rest + known @ [0.0, beat.clock.offset_ppm / turn_ppm])
        step = np.clip(step, -MOST_STEP, MOST_STEP)
        clock = beat.clock.shifted(float(step[0]) * SHIFT * flash_s, float(step[1]) * turn_ppm, pivot_s=pivot_s)
        beat = replace(beat, clock=clock)
        moves = np.array([_without(whole, slopes[:, one], rest[one]) for one in _by_flash(asked)])
    error = np.sqrt((moves**2).sum(axis=0) @ [1.0, 1 / 3]) if len(moves) > 1 else np.inf
    return beat, SHIFT * flash_s * float(error)


def _by_flash(asked: _Asked) -> list[Mask]:
    """Return which of the shared samples belong to each flash."""
    flash = asked.flash[1:][asked.shared]
    return [flash == one for one in np.unique(flash)]


def _without(whole: Doubles, slopes: Doubles, rest: Doubles) -> Doubles:
    """Return by how much a fit moves that leaves one flash out."""
    moved: Doubles = np.linalg.pinv(whole - slopes @ slopes.T) @ (slopes @ rest)
    return moved


def _without_ambient(plan: Plan, rows: Profiles, beat: Beat) -> Profiles:
    """Return rows less what each shows in dark slots on an average, or all do where few frames show that."""
    dark = _asked(plan, rows, beat).dark
    count = dark.sum(axis=0)
    usual = float(rows.value[dark].mean()) if dark.any() else 0.0
    level = np.where(dark, rows.value, 0.0).sum(axis=0) / np.maximum(count, 1)
    return replace(rows, value=rows.value - np.where(count >= LEAST_DARK, level, usual))
