"""The best fit of some rows: what the plan does not know exactly is set free, one thing after the other, where the data
call for it; and by how much times differ with how that is done."""

from dataclasses import dataclass, replace

import numpy as np

from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.compiled_profiles import unexplained
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import Fit
from psvideo.sync.rowfit.tracking.course import window_frames
from psvideo.sync.rowfit.unknowns.bend import fitted, rms_apart_s
from psvideo.sync.rowfit.unknowns.curve import Curve, Straightened, straightened
from psvideo.sync.rowfit.unknowns.freed import freed
from psvideo.sync.rowfit.unknowns.likelier import Freed
from psvideo.sync.rowfit.unknowns.plan_errors import maybe_otherwise_s
from psvideo.sync.rowfit.unknowns.plateau import centred
from psvideo.sync.rowfit.unknowns.restless import restless

SURER = 0.8
"""Share of the standard error that must be left before brightnesses are fitted again in windows half as long."""
MOST_WINDOWS = 400
MAINS_HZ = (100.0, 120.0)
MAINS_EXPLAINS = 0.8
"""Flicker is believed where it leaves less than this share of the squares that are left without it, and less than this
share of what frequencies that mains do not have leave: where many rows saturate, anything that swings explains much."""
OTHER_SWINGS = (-2.5, -1.5, 1.5, 2.5)
"""Frequencies tried instead, as swings more or fewer in a window: near enough to be alike, far enough to differ."""


@dataclass(frozen=True, kw_only=True)
class BestFit:
    """The best fit of some rows, and what it cannot know of its own error.

    ``apart_s``: by how much times differ with how they are fitted. ``slack_s`` and ``soft_s`` are as in ``ClipFit``.
    ``curves`` were taken out of the rows.
    """

    rows: Profiles
    fit: Fit
    apart_s: float
    slack_s: float
    soft_s: float
    curves: tuple[Curve, ...]


def best_fit(plan: Plan, rows: Profiles, start: Beat, free: tuple[str, ...]) -> BestFit:
    """Fit the times to rows, from the plain model to all that real footage may differ in from it."""
    rows, fit = _restless(plan, rows, fitted(plan, rows, start, free), free)
    fit = _with_mains(plan, rows, fit, free)
    rows, fit, apart_s = _in_short_windows(plan, rows, fit, free)
    held = straightened(plan, rows, fit, free)
    differing = freed(plan, held.rows, held.fit, free)
    final, doubts_s = _told_from_curve(plan, held, differing, free)
    rows, fit = final.rows, final.fit
    if fit.errors_s:
        fit, apart_s = _with_window_errors(plan, rows, fit)
    fit, slack_s = centred(plan, rows, fit)
    apart_s = float(np.sqrt(apart_s**2 + differing.unsure_s**2 + doubts_s**2))
    return BestFit(rows=rows, fit=fit, apart_s=apart_s, slack_s=slack_s, soft_s=differing.soft_s, curves=final.curves)


def _told_from_curve(
    plan: Plan, held: Straightened, differing: Freed, free: tuple[str, ...]
) -> tuple[Straightened, float]:
    """Return what was freed with the curve that shows beside it, and by how much times are in doubt because exposure
    and readout may be otherwise."""
    final = replace(held, fit=differing.fit, unsure_s=0.0)
    if "exposure_s" in differing.fit.errors_s:
        beside = straightened(plan, held.rows, differing.fit, tuple(differing.fit.errors_s))
        final = replace(beside, curves=(*held.curves, *beside.curves))
    otherwise_s = maybe_otherwise_s(plan, final.rows, final.fit, tuple(final.fit.errors_s))
    return final, float(np.hypot(final.unsure_s, otherwise_s))


def _restless(plan: Plan, rows: Profiles, fit: Fit, free: tuple[str, ...]) -> tuple[Profiles, Fit]:
    """Fit again with what flashes that differ say together, where the subject moves."""
    for _ in range(2):
        rows = restless(plan, rows, fit.beat)
        if rows.restless is None:
            break
        fit = fitted(plan, rows, fit.beat, free)
    return rows, fit


def _in_short_windows(plan: Plan, rows: Profiles, fit: Fit, free: tuple[str, ...]) -> tuple[Profiles, Fit, float]:
    """Fit brightnesses again more often where the subject moves so much that this makes the times better.

    Return too how far apart the times are with and without: an error that neither of the two fits can know of.
    """
    if rows.restless is not None:
        return rows, fit, rms_apart_s(rows, fit.beat, fitted(plan, _other_windows(rows), fit.beat, free).beat)
    short = rows.windowed(max(window_frames(plan) // 2, len(rows.value) // MOST_WINDOWS))
    other = fitted(plan, short, fit.beat, free)
    apart_s = rms_apart_s(rows, fit.beat, other.beat)
    taken, better = (short, other) if other.shift_error_s < SURER * fit.shift_error_s else (rows, fit)
    return taken, better, apart_s


def _with_window_errors(plan: Plan, rows: Profiles, fit: Fit) -> tuple[Fit, float]:
    """Add to the errors of what is free how far it moves when brightnesses are fitted twice as often.

    Return too how far apart the flashes' times are then.
    """
    other = fitted(plan, _other_windows(rows), fit.beat, tuple(fit.errors_s))
    errors_s = {
        name: float(np.hypot(error_s, getattr(other.beat, name) - getattr(fit.beat, name)))
        for name, error_s in fit.errors_s.items()
    }
    return replace(fit, errors_s=errors_s), rms_apart_s(rows, fit.beat, other.beat)


def _other_windows(rows: Profiles) -> Profiles:
    """Return the same profiles in windows half as long; twice as long where flashes differ, and so need none."""
    many = len(rows.window_start)
    return rows.windowed(
        max(len(rows.value) // (2 * many) if rows.restless is None else 2 * len(rows.value) // many, 1)
    )


def _with_mains(plan: Plan, rows: Profiles, fit: Fit, free: tuple[str, ...]) -> Fit:
    """Try ambient light that flickers with the mains, and keep it where it explains much of what is left."""

    def left(hz: float) -> float:
        beat = replace(fit.beat, beat_hz=(hz,))
        return float((fit.weight * unexplained(plan, rows, beat, fit.weight) ** 2).sum())

    hz = min(MAINS_HZ, key=left)
    least = left(hz)
    if least > MAINS_EXPLAINS * fit.loss:
        return fit
    window_s = rows.window_frames * rows.period_s
    if least > MAINS_EXPLAINS * float(np.median([left(hz + swings / window_s) for swings in OTHER_SWINGS])):
        return fit
    return fitted(plan, rows, replace(fit.beat, beat_hz=(hz,)), free)
