"""Where the strobe is by what holds however fast a subject moves: no brightness is asked to stay.

Two frames that share a flash saw the same light of the same moment, each the part that its opening says; and what
shines in a dark slot was never flashed. Both hold row by row and flash by flash, so they find the place in the cycle,
and how sure it is, where a subject that crosses the picture in a tenth of a second leaves nothing for a light's
brightness to be fitted to. It takes a dark slot, since split rows look alike under all lights, and clocks that cannot
part by much within the clip.
"""

from dataclasses import dataclass, replace

import numpy as np

from psvideo.model.arrays import Doubles, Integers, Mask
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat, train_between
from psvideo.sync.rowfit.coarse.retime import stood_in
from psvideo.sync.rowfit.coarse.seed import Seed, first_guess, renumbered
from psvideo.sync.rowfit.compiled_profiles import unexplained
from psvideo.sync.rowfit.fit import ClipFit
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import Fit, explained
from psvideo.sync.rowfit.tracking.course import window_frames
from psvideo.sync.rowfit.tracking.track import FrameTrack
from psvideo.sync.rowfit.unknowns.jitter import STEADY
from psvideo.sync.rowfit.unlit import unlit, with_unlit

ROWS, ROWS_EACH = 60, 4
"""Places are searched with so many rows, or with as many as leave the shortest flash the second;"""
FINE_EACH = 24
"""they are sharpened with as many as leave it this many."""
MOST_FRAMES = 120
"""So many frames in a row are searched, those with the most light."""
STEPS, TURNS = 4, 6
"""Places are tried this many to the shortest flash; the best is sharpened in so many turns."""
SHIFT, MOST_STEP = 0.01, 25
"""Slopes are taken over the first of the shortest flash, and no step is longer than so many of those."""
LEAST_DARK = 3
"""Of so many dark slots a row's ambient light is known."""
SPLIT, UNSEEN = 0.15, 1e-3
"""Each of two frames must have seen the first of a flash for what they say together; a row that saw less than the
second of any is dark."""
CLOCK = 0.25
"""The cycle is known throughout where the clocks' tolerance moves flashes by less than this share of the shortest."""
LEFT, CLEARLY = 2e-3, 0.25
"""A place is sure that leaves less than the first of the light that is asked, and less than the second of what the best
place elsewhere leaves. (Balls that cross 60 clips of half a second in 0.1 to 0.4 s: below 1e-4 at the true place, from
0.05 on at the best of all others. A strobe that jumps a little, or flashes of twice the length: 0.005 to 0.011.)"""
AGREES, LEAST = 10.0, 1e-4
"""A fit contradicts it that leaves this many times as much, and more than the second. (Of the same kind of clips fits
that were right left 0.8 to 1.6 times as much as the place, those that were 2 to 200 rows off 100 times and more.)"""
OTHER_LENGTHS, LENGTHS_DIFFER = (0.5, 0.7, 1.4, 2.0), 0.7
"""Flashes of these lengths, in the plan's, are likelier where they leave less than the last of what the plan's do."""


@dataclass(frozen=True, kw_only=True)
class SurePlace:
    """A ``beat`` at the only place in the cycle that split flashes and dark slots allow, with the standard error of its
    times; ``left``: the share of their light that it does not explain, by the frames and rows that were searched."""

    beat: Beat
    error_s: float
    left: float


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


def sure_place(plan: Plan, rows: Profiles) -> SurePlace | None:
    """Return the place that split flashes and dark slots show; None where they show none, or cannot. ``rows`` are laid
    out from the picture's top row."""
    if not _can_tell(plan, rows):
        return None
    guess, few, flash_s = first_guess(plan), _searched(plan, rows), plan.shortest_flash_s
    phases = np.arange(0.0, plan.cycle_s, flash_s / STEPS)
    left = np.array([left_of(plan, few, guess.with_phase(one)) for one in phases.tolist()])
    best_s = float(phases[left.argmin()])
    away_s = np.abs((phases - best_s + 0.5 * plan.cycle_s) % plan.cycle_s - 0.5 * plan.cycle_s)
    beat, error_s = _sharpened(plan, _floored(plan, rows, FINE_EACH), guess.with_phase(best_s))
    least = max(left_of(plan, few, beat), left_of(plan, _floored(plan, rows, ROWS_EACH), beat))
    elsewhere = float(left[away_s > flash_s].min(initial=np.inf))
    if least > min(LEFT, CLEARLY * elsewhere) or not error_s < flash_s or _lengths_differ(plan, few, beat):
        return None
    return SurePlace(beat=beat, error_s=error_s, left=least)


def contradicts(plan: Plan, found: ClipFit, place: SurePlace) -> bool:
    """Return whether a fit leaves more of split flashes and dark slots than the place that they show."""
    beat, few = found.fit.beat, found.rows.binned(_rows_for(plan, found.rows, ROWS_EACH))
    sharp = beat.with_phase(beat.clock.phase_s + 0.5 * (beat.rise_s + beat.fall_s))  # edges as the place takes them
    return left_of(plan, _without_floor(few), sharp) > max(AGREES * place.left, LEAST)


def placed_fit(plan: Plan, rows: Profiles, place: SurePlace) -> ClipFit:
    """Return a place as the fit of a clip whose frames follow one another as their numbers say."""
    dark = unlit(plan, rows)
    lit = renumbered(rows, stood_in(rows, dark)) if dark.any() else rows
    lit = (lit.turned() if place.beat.upward else lit).windowed(window_frames(plan))
    rest = unexplained(plan, lit, place.beat)
    fit = Fit(
        beat=place.beat,
        rest=rest,
        weight=np.ones_like(rest),
        shift_error_s=place.error_s,
        errors_s={},
        explained=explained(lit, rest),
    )
    every = slice(0, len(lit.value))
    return ClipFit(
        fit=fit,
        seed=Seed(beat=place.beat, frames=every, numbering=stood_in(rows, dark), share=fit.explained),
        rows=lit,
        track=FrameTrack(
            index=with_unlit(rows, lit.index, dark), beat=place.beat, at_s=lit.frame_start_s[:1], late_s=np.zeros(1)
        ),
        unlit=dark,
        jitter=STEADY,
        steps=0,
        strayed=0,
        trusted=(int(lit.index[0]), int(lit.index[-1])),
        unsure=np.zeros(0, np.int64),
    )


def left_of(plan: Plan, rows: Profiles, beat: Beat) -> float:
    """Return which share of their light split flashes and dark slots contradict: 0 where all agree, about 1 where none
    do. In ``rows`` 0 is no flash."""
    asked = _asked(plan, rows, beat)
    usual = rows.value**2
    usual[1:-1] = (usual[:-2] + usual[1:-1] + usual[2:]) / 3  # beside a dark slot the same row is lit
    light = float(usual[asked.dark].sum() + 0.5 * (usual[1:] + usual[:-1])[asked.shared].sum())
    return float((rows.value[asked.dark] ** 2).sum() + (asked.apart**2).sum()) / max(light, 1e-30)


def _lengths_differ(plan: Plan, rows: Profiles, beat: Beat) -> bool:
    """Return whether flashes much longer or shorter than the plan's, in the same places, contradict far less."""
    least = left_of(plan, rows, beat)
    for factor in OTHER_LENGTHS:
        longer_s = (factor - 1) * plan.shortest_flash_s
        flashes = tuple(replace(flash, duration_s=flash.duration_s + longer_s) for flash in plan.flashes)
        if plan.dark_s > longer_s:
            other = replace(plan, flashes=flashes, dark_s=plan.dark_s - longer_s)
            moved = beat.with_phase(beat.clock.phase_s - 0.5 * longer_s)
            if left_of(other, rows, moved) < LENGTHS_DIFFER * least:
                return True
    return False


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


def _sharpened(plan: Plan, rows: Profiles, beat: Beat) -> tuple[Beat, float]:
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


def _can_tell(plan: Plan, rows: Profiles) -> bool:
    """Return whether a row sees one flash at most, some see no light in their turn, rows open one after another, edges
    are sharp, and the cycle is known throughout wherever it is known at all."""
    readout_s, flash_s = plan.camera.readout_s, plan.shortest_flash_s
    soft, coded = max(plan.rise_s, plan.fall_s) > 0, plan.dark_code > 0
    if plan.mode != "rolling" or readout_s is None or abs(readout_s) < flash_s or soft or coded:
        return False
    marked = len(plan.lit_slots) < len(plan.flashes) < len(rows.value)
    half_s = 0.5 * float(np.ptp(rows.frame_start_s))
    return marked and plan.clock_range_ppm * 1e-6 * half_s < CLOCK * flash_s and bool((np.diff(rows.index) > 0).all())


def _searched(plan: Plan, rows: Profiles) -> Profiles:
    """Return the frames with the most light, in few rows."""
    few = _floored(plan, rows, ROWS_EACH)
    light = np.concatenate([[0.0], np.cumsum((few.value**2).sum(axis=1))])
    count = min(MOST_FRAMES, len(few.value))
    first = int(np.argmax(light[count:] - light[:-count]))
    return few.take(slice(first, first + count))


def _floored(plan: Plan, rows: Profiles, each: int) -> Profiles:
    """Return rows as they open, without what shines all the time, so many of them for the shortest flash."""
    rows = rows.turned() if first_guess(plan).upward else rows
    return _without_floor(rows.binned(_rows_for(plan, rows, each)))


def _rows_for(plan: Plan, rows: Profiles, each: int) -> int:
    """Return to how many rows a clip is averaged so that so many see the shortest flash begin or end."""
    row_time_s = abs(plan.camera.readout_s or 0.0) / plan.camera.height_px
    return max(ROWS, int(np.ceil(each * row_time_s * len(rows.place) / plan.shortest_flash_s)))


def _without_floor(rows: Profiles) -> Profiles:
    value = rows.value - np.sort(rows.value, axis=0)[1]  # the darkest may be a frame that was lost
    return replace(rows.one_window(), value=value, doubt=None, restless=None)
