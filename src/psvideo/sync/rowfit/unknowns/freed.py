"""Times that the plan may have a little wrong: set free where the picture contradicts the plan, and only there."""

from dataclasses import dataclass, replace

import numpy as np

from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.coarse.seed import gain_of
from psvideo.sync.rowfit.compiled_profiles import unexplained
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import LEAST_BLUR_ROWS, TAILS, Fit, robust_loss
from psvideo.sync.rowfit.score_test import clearest
from psvideo.sync.rowfit.unknowns.bend import fitted, rms_apart_s
from psvideo.sync.rowfit.unknowns.softness import BELIEVED, BLURRED, FEIGNED, blurred_s, cleared, plausible, within_blur

CLEAR = 5.0
"""A time leaves the plan's value only when it is off by this many standard errors."""
BETTER, LEAST_GAIN = 1e-3, 30.0
"""And only where that takes away this share of the robust loss, and this much of it: a subject that moves in step with
the dark row bends errors and estimates alike."""
STILL, PLAIN = 0.95, 0.3
"""Where a fit takes away less of the robust loss than the first (a subject that moves), a time that leaves the plan's
value must take away this share of what is left; else it is as likely that the subject feigns it."""
SLOWER, SLOWER_SHARE = 10.0, 5e-3
"""What tails must take away of the robust loss beyond what a blur does, and which share of it; alone they must do more
than a blur. Compressed clips without tails gave 31 and 3e-3 at most where tails were also clear of their errors,
tails of two rows through H.264 at least 22 and 0.016. Noise alone feigns 0.7."""
LONGER = 2.0
"""The longer tail must be this many times the blur that is found beside both, also where tails without that blur fit
better: its shape is only nearly that of the model. Compression feigned 2.5 at most in 239 of 240 clips (and 3.4 in the
last), mostly below 1.8; tails through H.264 were 3.2 and more."""
SOFTER, WORTH = (0.02, 0.06, 0.18), 1.0
"""Tails, as shares of the shortest flash, that are tried where rise and fall are alike: they leave the length of a
flash as it is, so that small ones change nothing to the first order. Freeing them must take away so much at least."""
FIRST_BLUR_ROWS = 0.3
"""A blur is looked for from here: from far too large a one, rows that it spoils count as outliers, and it stays."""
SOFT = 3.0
"""Edges are soft where tails take away this much of the robust loss,"""
UNTOLD = 0.6
"""and put the times in doubt by this share of how far tails beside a blur would move them: it may be tails or none."""
FARTHEST, STEPS = 0.06, 2
"""An exposure that is off by more than a flash lasts leaves rows far from where a flash is cut unexplained, so that no
small step finds it. It is looked for up to this share of it, in steps of the shortest flash over the second: farther
off, it is another shutter."""
PROBED_ROWS, PROBED_FRAMES = 60, 240
"""Rows and frames that it is looked for in."""
BLUR = "blur_s"
"""What tails are held against. They are freed together: a rise or a fall alone changes how long a flash seems, both
together when."""


@dataclass(frozen=True, kw_only=True)
class Freed:
    """A fit in which the plan's values are free that the picture contradicts.

    ``unsure_s`` is by how much the times are in doubt because with and without may both be right; ``soft_s`` how soft
    the edges are where that was not taken for tails, else 0.
    """

    fit: Fit
    unsure_s: float = 0.0
    soft_s: float = 0.0


def freed(plan: Plan, rows: Profiles, fit: Fit, free: tuple[str, ...]) -> Freed:
    """Free the plan's values where the picture clearly contradicts them, one after another, the clearest first.

    A shutter that differs by no more than a blur reaches is believed only where it explains what edges leave.
    """
    first, known = fit, free
    refused: set[str] = set()
    unsure_s, hidden_s, soft_s, wider_s = 0.0, 0.0, 0.0, dict[str, float]()
    far = None if "exposure_s" in free else _far_exposure(plan, rows, fit)
    while True:
        names = tuple(name for name in _may_differ(plan) if name not in free and name not in refused)
        more = ("exposure_s",) if far else _next(plan, rows, fit, free, names)
        if not more:
            break
        if set(more) <= set(TAILS):
            slow = _tails(plan, rows, fit, free, more)
            tried, hidden_s, soft_s = slow.fit, float(np.hypot(hidden_s, slow.unsure_s)), max(soft_s, slow.soft_s)
            taken = tried is not fit
        else:
            tried = fitted(plan, rows, far or fit.beat, (*free, *more))
            taken = taken_away(plan, rows, fit, tried) > max(BETTER * _loss(rows, fit), LEAST_GAIN) and _clear(
                fit, tried, more
            )
        started_far, far = far is not None, None
        if not taken:
            refused |= set() if started_far else set(more)
            continue
        if not set(more) <= set(TAILS) and _may_be_feigned(plan, rows, fit, tried):
            unsure_s = float(np.hypot(unsure_s, rms_apart_s(rows, fit.beat, tried.beat) / np.sqrt(2)))
            wider_s |= {name: _off_s(fit, tried, name) / np.sqrt(2) for name in more}
        fit, free = tried, tuple(dict.fromkeys((*free, *tried.errors_s)))
    only_shutter = len(free) > len(known) and not set(TAILS) & set(free)
    if only_shutter and within_blur(rows, first.beat, fit.beat) and cleared(plan, rows, first, fit) < BELIEVED:
        blur_s = BLURRED * (soft_s or blurred_s(plan, rows, first))
        return Freed(fit=first, unsure_s=float(np.hypot(blur_s, hidden_s)), soft_s=soft_s)
    unsure_s = float(np.hypot(unsure_s, hidden_s))
    if not (soft_s or set(TAILS) & set(free)):
        unsure_s = float(np.hypot(unsure_s, BLURRED * blurred_s(plan, rows, fit)))
    errors_s = {name: float(np.hypot(error_s, wider_s.get(name, 0.0))) for name, error_s in fit.errors_s.items()}
    return Freed(fit=replace(fit, errors_s=errors_s) if wider_s else fit, unsure_s=unsure_s, soft_s=soft_s)


def _far_exposure(plan: Plan, rows: Profiles, fit: Fit) -> Beat | None:
    """Return the fit's beat with an exposure that is off by more than flashes last, if one explains more; else None.

    Where the beginning of the exposure cuts flashes as the fit says, its end does not, or the reverse.
    """
    beat = fit.beat
    part = rows.take(slice(0, PROBED_FRAMES)).binned(PROBED_ROWS)
    known = unexplained(plan, part, beat)
    step_s = plan.shortest_flash_s / STEPS
    count = int(FARTHEST * beat.exposure_s / step_s)
    longer_s = np.minimum(step_s * np.arange(-count, count + 1), max(rows.period_s - beat.exposure_s, 0.0))
    tried = [
        replace(beat.with_phase(beat.clock.phase_s + moved_s), exposure_s=beat.exposure_s + s)
        for s in np.unique(longer_s[longer_s != 0.0]).tolist()
        for moved_s in (0.0, s)
    ]
    losses = [robust_loss(part, unexplained(plan, part, one), known) for one in tried]
    most = robust_loss(part, known, known)
    gained = most - min(losses, default=most) > max(BETTER * most, LEAST_GAIN)
    return tried[int(np.argmin(losses))] if gained else None


def _may_be_feigned(plan: Plan, rows: Profiles, before: Fit, after: Fit) -> bool:
    """Return whether the subject moves so much that it may feign what the times that were freed explain."""
    moving = rows.restless is None and gain_of(rows, after.rest) < STILL
    return moving and taken_away(plan, rows, before, after) < PLAIN * _loss(rows, before)


def _tails(plan: Plan, rows: Profiles, fit: Fit, free: tuple[str, ...], tails: tuple[str, ...]) -> Freed:
    """Free the tails, if they explain what a blur of the rows does not; else the fit as it is, with what is in doubt.

    A tail moves the start of its flash by as much as it is long, a blur does not: where both would do, a wrong tail is
    worse. Tails that explain no more of what edges leave than compression feigns are in doubt even where they fit best.
    """
    slow = fitted(plan, rows, fit.beat, (*free, *tails))
    gain = taken_away(plan, rows, fit, slow)
    if gain < SOFT or not plausible(plan, slow.beat):
        return Freed(fit=fit, unsure_s=_hidden_s(rows, fit, slow) if _may_hide_tails(plan, rows, fit) else 0.0)
    row_time_s = fit.beat.row_time_s
    if row_time_s == 0.0:
        return Freed(fit=slow if _clear(fit, slow, tails) and gain > SLOWER else fit)
    blurred = fitted(plan, rows, replace(fit.beat, blur_s=FIRST_BLUR_ROWS * row_time_s), (*free, BLUR))
    start = replace(slow.beat, blur_s=blurred.beat.blur_s)
    joint = fitted(plan, rows, start, (*free, *tails, BLUR))
    if taken_away(plan, rows, blurred, joint) < 0.0:  # no step led from the tails to where a blur alone is better
        joint = fitted(plan, rows, blurred.beat, (*free, *tails, BLUR))
    both = joint if plausible(plan, joint.beat) and taken_away(plan, rows, slow, joint) >= -WORTH else slow
    apart_s = rms_apart_s(rows, slow.beat, both.beat)
    by_blur = max(taken_away(plan, rows, fit, blurred), 0.0)
    beyond = taken_away(plan, rows, fit, both) - by_blur
    likelier = gain > by_blur and beyond > max(SLOWER, SLOWER_SHARE * _loss(rows, fit))
    taken = both if taken_away(plan, rows, slow, both) > WORTH else slow
    if likelier and _longer(taken, joint) and _clear(fit, both, tails):
        apart_s = float(np.hypot(apart_s, 0.0 if taken is both else _more_s(slow, both)))
        if cleared(plan, rows, fit, taken) < FEIGNED:
            apart_s = float(np.hypot(apart_s, UNTOLD * rms_apart_s(rows, fit.beat, taken.beat)))
        return Freed(fit=taken, unsure_s=apart_s)
    doubt_s = UNTOLD * float(np.hypot(rms_apart_s(rows, fit.beat, both.beat), both.shift_error_s))
    return Freed(fit=fit, unsure_s=doubt_s, soft_s=max(slow.beat.rise_s, slow.beat.fall_s))


def _hidden_s(rows: Profiles, fit: Fit, slow: Fit) -> float:
    """Return by how much times are in doubt because tails that the picture does not show may be there all the same."""
    return UNTOLD * float(np.hypot(rms_apart_s(rows, fit.beat, slow.beat), _more_s(fit, slow)))


def _longer(taken: Fit, joint: Fit) -> bool:
    """Return whether tails that may be taken are far longer than the blur that was found beside tails, and longer than
    one that is too small to be found."""
    least_s = LEAST_BLUR_ROWS * joint.beat.row_time_s
    is_blurred = joint.beat.blur_s > 1.01 * least_s
    beyond_s = LONGER * joint.beat.blur_s if is_blurred else max(LONGER * taken.beat.blur_s, least_s)
    return max(taken.beat.rise_s, taken.beat.fall_s) > beyond_s


def _more_s(one: Fit, other: Fit) -> float:
    """Return what one fit's error must grow by to be as large as another's."""
    return float(np.sqrt(max(other.shift_error_s**2 - one.shift_error_s**2, 0.0)))


def _loss(rows: Profiles, fit: Fit) -> float:
    return robust_loss(rows, fit.rest, fit.rest)


def taken_away(plan: Plan, rows: Profiles, before: Fit, after: Fit) -> float:
    """Return what a fit takes away of the robust loss of the one before.

    Where flashes differ, which of them count as outliers has more than one answer, and brightnesses depend on it more
    than on the times: both fits get the better of their own trust in the samples and the other's.
    """
    if rows.restless is None:
        return _loss(rows, before) - robust_loss(rows, after.rest, before.rest)

    def least(one: Fit, other: Fit) -> float:
        as_other = unexplained(plan, rows, one.beat, other.weight)
        return min(robust_loss(rows, rest, before.rest) for rest in (one.rest, as_other))

    return least(before, after) - least(after, before)


def _off_s(before: Fit, after: Fit, name: str) -> float:
    return float(abs(getattr(after.beat, name) - getattr(before.beat, name)))


def _clear(before: Fit, after: Fit, names: tuple[str, ...]) -> bool:
    """Return whether one of some times has moved by far more than its error."""
    return any(_off_s(before, after, name) > CLEAR * after.errors_s[name] for name in names)


def _next(plan: Plan, rows: Profiles, fit: Fit, free: tuple[str, ...], names: tuple[str, ...]) -> tuple[str, ...]:
    """Return the times that are worth freeing next: one, or both tails; none where nothing would be explained."""
    tails = tuple(name for name in names if name in TAILS)
    name = clearest(plan, rows, fit, free, names, at_least=LEAST_GAIN)
    if name is None:
        return tails if tails and (_may_hide_tails(plan, rows, fit) or _softer(plan, rows, fit)) else ()
    return tails if name in TAILS else (name,)


def _softer(plan: Plan, rows: Profiles, fit: Fit) -> bool:
    """Return whether flashes that rise and fall as slowly, and start earlier by that, fit better."""
    limit = _loss(rows, fit) - WORTH
    for share in SOFTER:
        tail_s = share * plan.shortest_flash_s
        beat = fit.beat.with_phase(fit.beat.clock.phase_s - tail_s)
        beat = replace(beat, rise_s=beat.rise_s + tail_s, fall_s=beat.fall_s + tail_s)
        if robust_loss(rows, unexplained(plan, rows, beat), fit.rest) < limit:
            return True
    return False


def _may_hide_tails(plan: Plan, rows: Profiles, fit: Fit) -> bool:
    """Return whether LEDs may rise and fall slowly without the picture or the plan showing it: the subject moves."""
    plain = replace(rows, restless=None)
    told = max(plan.rise_s, plan.fall_s) > 0.0
    return not told and gain_of(plain, unexplained(plan, plain, fit.beat, fit.weight)) < STILL


def _may_differ(plan: Plan) -> tuple[str, ...]:
    names = ("exposure_s", "row_time_s", *TAILS)
    return names if plan.camera.readout_s != 0 else tuple(name for name in names if name != "row_time_s")
