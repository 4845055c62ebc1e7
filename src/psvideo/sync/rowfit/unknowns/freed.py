"""Times that the plan may have a little wrong: set free where the picture contradicts the plan, and only there."""

from dataclasses import replace

import numpy as np

from psvideo.model.plan import Plan
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import TAILS, Fit
from psvideo.sync.rowfit.score_test import clearest
from psvideo.sync.rowfit.unknowns.bend import fitted, rms_apart_s
from psvideo.sync.rowfit.unknowns.far_exposure import far_exposure
from psvideo.sync.rowfit.unknowns.likelier import (
    LEAST_GAIN,
    Freed,
    is_clearly_better,
    may_be_feigned,
    moved_by_s,
)
from psvideo.sync.rowfit.unknowns.slow_leds import hinted_s, is_softer, may_hide_tails, tails_freed
from psvideo.sync.rowfit.unknowns.softness import BELIEVED, BLURRED, blurred_s, cleared, within_blur


def freed(plan: Plan, rows: Profiles, fit: Fit, free: tuple[str, ...]) -> Freed:
    """Free the plan's values where the picture clearly contradicts them, one after another, the clearest first.

    A shutter that differs by no more than a blur reaches is believed only where it explains what edges leave.
    """
    first, known = fit, free
    refused: set[str] = set()
    unsure_s, hidden_s, soft_s, wider_s = 0.0, 0.0, 0.0, dict[str, float]()
    far = None if "exposure_s" in free else far_exposure(plan, rows, fit)
    while True:
        names = tuple(name for name in _may_differ(plan) if name not in free and name not in refused)
        more = ("exposure_s",) if far else _next(plan, rows, fit, free, names)
        if not more:
            break
        if set(more) <= set(TAILS):
            slow = tails_freed(plan, rows, fit, free, more)
            tried, hidden_s, soft_s = slow.fit, float(np.hypot(hidden_s, slow.unsure_s)), max(soft_s, slow.soft_s)
            taken = tried is not fit
        else:
            tried = fitted(plan, rows, far or fit.beat, (*free, *more))
            taken = is_clearly_better(plan, rows, fit, tried, more)
        started_far, far = far is not None, None
        if not taken:
            refused |= set() if started_far else set(more)
            continue
        if not set(more) <= set(TAILS) and may_be_feigned(plan, rows, fit, tried):
            unsure_s = float(np.hypot(unsure_s, rms_apart_s(rows, fit.beat, tried.beat) / np.sqrt(2)))
            wider_s |= {name: moved_by_s(fit, tried, name) / np.sqrt(2) for name in more}
        fit, free = tried, tuple(dict.fromkeys((*free, *tried.errors_s)))
    only_shutter = len(free) > len(known) and not set(TAILS) & set(free)
    if only_shutter and within_blur(rows, first.beat, fit.beat) and cleared(plan, rows, first, fit) < BELIEVED:
        blur_s = BLURRED * (soft_s or blurred_s(plan, rows, first))
        return Freed(fit=first, unsure_s=float(np.hypot(blur_s, hidden_s)), soft_s=soft_s)
    if not soft_s:
        hidden_s = float(np.hypot(hidden_s, hinted_s(plan, rows, fit)))
    unsure_s = float(np.hypot(unsure_s, hidden_s))
    if not (soft_s or set(TAILS) & set(free)):
        unsure_s = float(np.hypot(unsure_s, BLURRED * blurred_s(plan, rows, fit)))
    errors_s = {name: float(np.hypot(error_s, wider_s.get(name, 0.0))) for name, error_s in fit.errors_s.items()}
    return Freed(fit=replace(fit, errors_s=errors_s) if wider_s else fit, unsure_s=unsure_s, soft_s=soft_s)


def _next(plan: Plan, rows: Profiles, fit: Fit, free: tuple[str, ...], names: tuple[str, ...]) -> tuple[str, ...]:
    """Return the times that are worth freeing next: one, or both tails; none where nothing would be explained."""
    tails = tuple(name for name in names if name in TAILS)
    name = clearest(plan, rows, fit, free, names, at_least=LEAST_GAIN)
    if name is None:
        return tails if tails and (may_hide_tails(plan, rows, fit) or is_softer(plan, rows, fit)) else ()
    return tails if name in TAILS else (name,)


def _may_differ(plan: Plan) -> tuple[str, ...]:
    names = ("exposure_s", "row_time_s", *TAILS)
    return names if plan.camera.readout_s != 0 else tuple(name for name in names if name != "row_time_s")
