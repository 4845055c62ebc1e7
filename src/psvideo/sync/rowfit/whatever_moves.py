"""Where the strobe is by what holds however fast a subject moves: no brightness is asked to stay.

Frames that share a flash, and rows in dark slots (``shared_light``), show the place in the cycle and how sure it is,
where a subject that crosses the picture in a tenth of a second leaves nothing to fit a light's brightness to. It takes
a dark slot, since split rows look alike under all lights, and clocks that cannot part by much within the clip.
"""

from dataclasses import dataclass, replace

import numpy as np

from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.coarse.retime import stood_in
from psvideo.sync.rowfit.coarse.seed import Seed, first_guess, renumbered
from psvideo.sync.rowfit.compiled_profiles import unexplained
from psvideo.sync.rowfit.fit import ClipFit
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import Fit, explained
from psvideo.sync.rowfit.shared_light import left_of, sharpened
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
STEPS = 4
"""Places are tried this many to the shortest flash."""
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
    beat, error_s = sharpened(plan, _floored(plan, rows, FINE_EACH), guess.with_phase(best_s))
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
