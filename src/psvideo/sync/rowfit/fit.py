"""From row profiles to the clip's times: seed, track, sharpen, and set free what the plan does not know exactly."""

from dataclasses import dataclass, replace

import numpy as np

from psvideo.model.arrays import Integers, Mask
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.best_fit import BestFit, best_fit
from psvideo.sync.rowfit.coarse.retime import regular_step, stood_in
from psvideo.sync.rowfit.coarse.seed import Seed, renumbered
from psvideo.sync.rowfit.coarse.seed_choice import find_seed
from psvideo.sync.rowfit.compiled_profiles import unexplained
from psvideo.sync.rowfit.long_takes import ENOUGH_SAMPLES, stretches, throughout
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import Fit, explained
from psvideo.sync.rowfit.tracking.course import TRACK_ROWS, followed, window_frames
from psvideo.sync.rowfit.tracking.track import FrameTrack
from psvideo.sync.rowfit.unknowns.curve import straight
from psvideo.sync.rowfit.unknowns.edge_pulls import disagreement_s, shift_error_s
from psvideo.sync.rowfit.unknowns.jitter import STEADY, Jitter, jitter, maybe_astray_s
from psvideo.sync.rowfit.unknowns.misread import OtherCurve, doubt_s, misread
from psvideo.sync.rowfit.unknowns.plan_errors import nominally_s
from psvideo.sync.rowfit.unknowns.restless import across
from psvideo.sync.rowfit.unknowns.softness import misfit
from psvideo.sync.rowfit.unknowns.unsteady import unsteady_s
from psvideo.sync.rowfit.unlit import unlit, with_unlit

COARSE_ROWS = 288
FLASH_ROWS = 8
"""Rows that a flash must still span where a clip of more row means than are enough gets its rows averaged."""
UNSURE = 0.02
"""A fit whose times are unsure by more than this share of the shortest flash is worth being read by other curves."""


@dataclass(frozen=True, kw_only=True)
class ClipFit:
    """The fit of a whole clip: its rows with the times that their frames truly have, and which frames are repeats.

    ``steps`` counts the places where frames follow otherwise than numbering and repeated frames explain, ``strayed``
    the frames by which they do; ``trusted`` are the first and the last place in time at which frames fit, ``unsure``
    (frame,) places beside holes whose frames may as well lie on the other side. ``slack_s`` is by how much all flashes
    could come earlier or later and the picture be the same, 0 where it shows their times; ``soft_s`` is how soft the
    edges are where that was not taken for LEDs' tails, else 0. ``across`` is how much of what split flashes show is
    explained (0 to 1) where flashes differ because the subject moves, else 0. ``unlit`` (frame,) are frames that were
    left out because no flash lights them. ``unsteady_s`` is by how much stretches of flashes are early or late, as a
    root mean square over the clip, beyond their jitter. ``regular``: frames are missing or repeated by a rule. ``seed``
    is where it began. ``reading`` is the curve by which the rows were read again, if the plan's is wrong by far.
    """

    fit: Fit
    seed: Seed
    rows: Profiles
    track: FrameTrack
    unlit: Mask
    jitter: Jitter
    steps: int
    strayed: int
    trusted: tuple[int, int]
    unsure: Integers
    slack_s: float = 0.0
    soft_s: float = 0.0
    unsteady_s: float = 0.0
    across: float = 0.0
    regular: bool = False
    reading: OtherCurve | None = None


def find(plan: Plan, rows: Profiles, *, measured: tuple[str, ...] = ()) -> ClipFit:
    """Return the times of a clip; ``Fit.explained`` says how well they explain it.

    ``measured`` names times that are fitted even where the plan gives them, as the readout is where it is unknown.
    """
    whole, dark = rows, unlit(plan, rows)
    if dark.any():
        rows = renumbered(rows, stood_in(rows, dark))
    seed = find_seed(plan, rows)
    if seed.beat.upward:
        rows = rows.turned()
    rows = rows.binned(_rows_needed(plan, rows, seed.beat))
    window = window_frames(plan)
    course = followed(plan, rows.binned(TRACK_ROWS), seed)
    tracked = course.track
    fine = _tracked_rows(rows, tracked).windowed(window)
    free = measured if plan.camera.readout_s is not None else ("row_time_s", *measured)
    best, reading = _rightly_read(plan, stretches(fine), tracked.beat, free)
    fine = reading.of(fine) if reading else fine
    plain, as_seen = _of_whole_take(plan, fine, best, tracked.beat)
    stray = jitter(plan, plain, as_seen) if best.slack_s == 0.0 else STEADY
    loose_s = unsteady_s(plan, plain, as_seen, stray)
    return ClipFit(
        seed=seed,
        fit=replace(as_seen, shift_error_s=float(np.hypot(_error_s(plan, best, as_seen, stray), loose_s))),
        rows=plain,
        track=replace(tracked, index=with_unlit(whole, tracked.index, dark)),
        unlit=dark,
        jitter=stray,
        steps=course.steps,
        strayed=course.strayed,
        trusted=course.trusted,
        unsure=course.unsure,
        slack_s=best.slack_s,
        soft_s=best.soft_s,
        unsteady_s=loose_s,
        across=across(plan, best.rows, best.fit),
        regular=regular_step(tracked.index, rows.index) != 1,
        reading=reading,
    )


def _tracked_rows(rows: Profiles, track: FrameTrack) -> Profiles:
    """Return the frames that are no repeats, at the places in time where they were tracked."""
    keep = ~track.repeated
    return replace(
        rows,
        value=np.ascontiguousarray(rows.value[keep]),
        index=track.index[keep],
        doubt=None if rows.doubt is None else np.ascontiguousarray(rows.doubt[keep]),
    )


def _of_whole_take(plan: Plan, fine: Profiles, best: BestFit, start: Beat) -> tuple[Profiles, Fit]:
    """Return all rows of a take and their fit, where ``best`` was fitted to all of them or to some stretches."""
    if len(best.rows.value) == len(fine.value):
        return _as_seen(plan, best.rows, best.fit)
    whole_take = straight(fine, best.curves)
    return throughout(plan, whole_take, best.rows, best.fit, start, follow=best.slack_s == 0.0)


def _rightly_read(plan: Plan, rows: Profiles, start: Beat, free: tuple[str, ...]) -> tuple[BestFit, OtherCurve | None]:
    """Return the best fit of some rows, read by another curve where that explains more than what the fit sets free."""
    best = best_fit(plan, rows, start, free)
    if _strays(plan, best, free):
        reading, others, unsure_s = misread(plan, best.rows, best.fit, free)
        if reading:
            best = best_fit(plan, reading.of(rows), start, free)
            unsure_s = doubt_s(best.rows, best.fit, others)
        return replace(best, apart_s=float(np.hypot(best.apart_s, unsure_s))), reading
    return best, None


def _strays(plan: Plan, best: BestFit, free: tuple[str, ...]) -> bool:
    """Return whether a fit strays so far from the plan, or leaves times so unsure, that rows may be misread. It takes
    rows that open one after another to show how much of a flash each saw."""
    if best.fit.beat.row_time_s * float(best.rows.place.max()) < plan.shortest_flash_s:
        return False
    if best.curves or best.soft_s or set(best.fit.errors_s) - set(free):
        return True
    apart_s = disagreement_s(plan, best.rows, best.fit)
    return float(np.hypot(apart_s, np.hypot(best.fit.shift_error_s, best.apart_s))) > UNSURE * plan.shortest_flash_s


def _error_s(plan: Plan, best: BestFit, as_seen: Fit, stray: Jitter) -> float:
    """Return the standard error of all flashes' times together.

    That exposure or readout may be a little off from what plans say counts where that alone is more than all the rest:
    added to it, it would double what noise makes of plans that are exact.
    """
    rows, fit = best.rows, best.fit
    known_s = max(as_seen.shift_error_s, shift_error_s(plan, rows, fit), best.slack_s)
    if stray is not STEADY:
        known_s = min(known_s, stray.mean_error_s)
    else:
        apart_rows_s = disagreement_s(plan, rows, fit) if rows.restless is None else 0.0
        known_s = max(float(np.hypot(known_s * misfit(plan, rows, fit), apart_rows_s)), fit.alike_s)
        known_s = float(np.hypot(known_s, maybe_astray_s(plan, rows, fit)))
    nominal_s = nominally_s(plan, rows, fit, tuple(fit.errors_s))
    return max(float(np.sqrt(known_s**2 + stray.error_s**2 + best.apart_s**2)), nominal_s)


def _rows_needed(plan: Plan, rows: Profiles, beat: Beat) -> int:
    """Return to how many rows a clip may be averaged without blurring its flashes."""
    shortest_s = plan.shortest_flash_s
    sharp = int(FLASH_ROWS * beat.row_time_s * len(rows.place) / shortest_s)
    return max(COARSE_ROWS, ENOUGH_SAMPLES // len(rows.value), sharp)


def _as_seen(plan: Plan, rows: Profiles, fit: Fit) -> tuple[Profiles, Fit]:
    """Return the fit with what it leaves of the picture itself: flashes that differ are not explained by differing."""
    if rows.restless is None:
        return rows, fit
    plain = replace(rows, restless=None)
    rest = unexplained(plan, plain, fit.beat, fit.weight)
    return plain, replace(fit, rest=rest, explained=explained(plain, rest))
