"""Flashes at clearly other times that explain a clip as well, where all rows open at nearly the same time.

A rolling shutter shows in which direction a flash moves through the frame. Where the readout is hardly longer than a
flash, all rows see the same: a flash that the exposure's end cuts more and more looks like one that its beginning cuts
less and less, under a clock that is off the other way, and a strobe that keeps step with the frames looks the same at
many places. Then the clock must tell, and where several are as likely, nothing does.

Whatever the readout, a clock that is farther off than the plan says is believed only where none within the plan's
tolerance explains the clip as well: a subject that moves past flashes that no row splits feigns any. So is a strobe
that nearly keeps step with the frames: few pictures come again and again, and what changes slowly in them may be
flashes that move, light that ripples or a subject that does. Of 11 such clips of three lights 6 were 0.9 to 2.2 ms off.
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat, FoundClock, train_between
from psvideo.sync.rowfit.coarse.search import search
from psvideo.sync.rowfit.coarse.seed import first_guess
from psvideo.sync.rowfit.compiled_profiles import unexplained
from psvideo.sync.rowfit.fit import ClipFit
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import refined_beat, robust_loss
from psvideo.sync.verdict.few_kinds import shows_few

SHORT = 3.0
"""Rows open at nearly the same time where the readout is no longer than this many of the shortest flash."""
ROWS, FRAMES = 12, 240
"""Rows, and frames in a row, among which other places are looked for; they are then fitted to all frames."""
ROLLING_ROWS, ROWS_EACH = 36, 4
"""Rows where they open one after another; of a strobe nearly in step as many as leave the shortest flash the second."""
TRIED = 12
"""The best places of each search that are fitted."""
NEAR, TURNS = (-0.6, -0.4, -0.25, 0.25, 0.4, 0.6), 21
"""Moves of all flashes that are tried beside those places, in shortest flashes, and clocks for each, which move those
at the clip's ends by up to a flash more."""
MISNAMED_PPM = 1000.0
"""A frame rate that is misnamed by 1.001 puts the clock so far off."""
ALIKE, LITTLE = 1.2, 30.0
"""Other times explain a clip as well that leave no more than this many times the robust loss, and this much,"""
APART, ERRORS = 0.1, 5.0
"""and are other times where they differ by this share of the shortest flash, and by as many standard errors."""
FAR = 0.5
"""By this share of it where rows open one after another and the clock is likely: an edge that moves shows the place, if
not exactly."""
SLACK = 1.5
"""Where the picture leaves them open, they also differ by more than what is left open so many times: at both ends of a
clip it may be that of its middle and that of its clock."""
PLACES = 7
"""Instants of the clip at which flashes are compared."""


def fits_elsewhere(plan: Plan, found: ClipFit) -> Beat | None:
    """Return a beat whose flashes come at other times than those of a fit and explain the clip as well, under a clock
    that the plan allows or a misnamed frame rate makes; None where there is none. Where rows open one after another it
    is looked for only if the fit's clock is none of these, or nearly keeps step with the frames.

    Shutter and readout are the fit's, or the plan's where those were moved away from it.
    """
    beat = found.fit.beat
    at_once = rows_open_at_once(plan, beat)
    in_step = not at_once and _likely(plan, beat)
    if found.across > 0.0 or (in_step and not shows_few(plan, found.rows, beat)):
        return None
    rolling = _rows_in_step(plan, found.rows, beat) if in_step else ROLLING_ROWS
    few = replace(found.rows.binned(ROWS if at_once else rolling), restless=None)
    known = unexplained(plan, few, beat)
    most = ALIKE * robust_loss(few, known, known) + LITTLE
    apart_s = (FAR if in_step else APART) * plan.shortest_flash_s
    least_s = max(apart_s, ERRORS * found.fit.shift_error_s, SLACK * found.slack_s)
    for start in _shutters(plan, beat):
        nearby: Iterable[Beat] = _nearby(plan, few, start) if at_once else ()
        for other in (*nearby, *_others(plan, few, start)):
            apart = _apart_s(plan, found.rows, beat, other) > least_s
            if apart and robust_loss(few, unexplained(plan, few, other), known) < most:
                return other
    return None


def _rows_in_step(plan: Plan, rows: Profiles, beat: Beat) -> int:
    """Return how many rows are enough, and leave the shortest flash a few that it spans."""
    return max(ROLLING_ROWS, int(np.ceil(ROWS_EACH * beat.row_time_s * len(rows.place) / plan.shortest_flash_s)))


def rows_open_at_once(plan: Plan, beat: Beat) -> bool:
    """Return whether all rows of a beat, or of the plan's camera, open at nearly the same time."""
    row_time_s = min(beat.row_time_s, first_guess(plan).row_time_s or beat.row_time_s)
    return row_time_s * plan.camera.height_px <= SHORT * plan.shortest_flash_s


def _shutters(plan: Plan, beat: Beat) -> tuple[Beat, ...]:
    planned = first_guess(plan)
    as_planned = replace(beat, row_time_s=planned.row_time_s, exposure_s=planned.exposure_s)
    return (beat, as_planned) if plan.camera.readout_s is not None else (beat,)


def _nearby(plan: Plan, rows: Profiles, beat: Beat) -> Iterator[Beat]:
    """Yield what a beat becomes when its flashes come a little earlier or later, each under the clock that fits best
    then: where the same end of the exposure cuts all of them, brighter lights that it cuts more look the same."""
    start_s = rows.frame_start_s
    pivot_s, half_s = float(start_s.mean()), 0.5 * float(start_s[-1] - start_s[0])
    flash_s = plan.shortest_flash_s
    for shift_s in (share * flash_s for share in NEAR):
        turned = [
            replace(beat, clock=beat.clock.shifted(shift_s, 1e6 * turn * flash_s / half_s, pivot_s=pivot_s))
            for turn in np.linspace(-1.0, 1.0, TURNS).tolist()
        ]
        best = min(turned, key=lambda one: float(np.abs(unexplained(plan, rows, one)).sum()))
        other = refined_beat(plan, rows, best, steps=8, first_scale=0.01)
        if _likely(plan, other):
            yield other


def _others(plan: Plan, rows: Profiles, start: Beat) -> Iterator[Beat]:
    """Yield what a clip's best places become when they are fitted, for each clock that is likely."""
    start = replace(start, clock=FoundClock(phase_s=0.0, offset_ppm=0.0))
    stretch = rows.take(slice(0, FRAMES)).one_window()
    for slower in (1.0, 1.0 + MISNAMED_PPM * 1e-6, 1.0 - MISNAMED_PPM * 1e-6):
        part = replace(stretch, period_s=stretch.period_s * slower)
        for place in search(plan, part, range_ppm=plan.clock_range_ppm, start=start, readout_known=True, keep=TRIED):
            found = place.beat.clock
            clock = FoundClock(phase_s=found.phase_s / slower, offset_ppm=1e6 * (found.rate / slower - 1.0))
            other = refined_beat(plan, rows, replace(place.beat, clock=clock), steps=8)
            if _likely(plan, other):
                yield other


def _likely(plan: Plan, beat: Beat) -> bool:
    """Return whether a clock is as far off as the plan allows, or as a misnamed frame rate makes it beside."""
    ppm = abs(beat.clock.mean_offset_ppm())
    return min(ppm, abs(ppm - MISNAMED_PPM)) < plan.clock_range_ppm


def _apart_s(plan: Plan, rows: Profiles, one: Beat, other: Beat) -> float:
    """Return by how much flashes are apart, at most, each from the nearest one, whatever they are called."""
    first_s, last_s = rows.ends_s[[0, -1]].tolist()
    return max(_nearest_s(plan, one, other, at_s) for at_s in np.linspace(first_s, last_s, PLACES).tolist())


def _nearest_s(plan: Plan, one: Beat, other: Beat, at_s: float) -> float:
    starts: list[Doubles] = [train_between(plan, beat.clock, at_s, at_s).start_s for beat in (one, other)]
    near_s = starts[0][np.abs(starts[0] - at_s).argmin()]
    return float(np.abs(starts[1] - near_s).min())
