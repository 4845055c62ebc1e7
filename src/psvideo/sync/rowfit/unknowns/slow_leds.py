"""LEDs that rise and fall slowly: tails are freed where they explain what a blur of the rows does not."""

from dataclasses import replace

import numpy as np

from psvideo.model.plan import Plan
from psvideo.sync.rowfit.coarse.seed import gain_of
from psvideo.sync.rowfit.compiled_profiles import unexplained
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import LEAST_BLUR_ROWS, TAILS, Fit, robust_loss
from psvideo.sync.rowfit.unknowns.bend import fitted, rms_apart_s
from psvideo.sync.rowfit.unknowns.likelier import STILL, Freed, has_moved, loss_of, taken_away
from psvideo.sync.rowfit.unknowns.softness import FEIGNED, cleared, plausible
from psvideo.sync.rowfit.unknowns.untold_tails import (
    NO_BLUR,
    hinted_tails_s,
    open_tails_s,
    shows_tails,
    untold_tails_s,
    with_tails,
)

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
BLUR = "blur_s"
"""What tails are held against. They are freed together: a rise or a fall alone changes how long a flash seems, both
together when."""


def tails_freed(plan: Plan, rows: Profiles, fit: Fit, free: tuple[str, ...], tails: tuple[str, ...]) -> Freed:
    """Free the tails, if they explain what a blur of the rows does not; else the fit as it is, with what is in doubt.

    A tail moves the start of its flash by as much as it is long, a blur does not: where both would do, a wrong tail is
    worse. Tails that explain no more of what edges leave than compression feigns are in doubt even where they fit best.
    """
    slow = fitted(plan, rows, fit.beat, (*free, *tails))
    gain = taken_away(plan, rows, fit, slow)
    if gain < SOFT or not plausible(plan, slow.beat):
        return Freed(fit=fit, unsure_s=_hidden_s(plan, rows, fit, slow) if may_hide_tails(plan, rows, fit) else 0.0)
    row_time_s = fit.beat.row_time_s
    if row_time_s == 0.0:
        return Freed(fit=slow if has_moved(fit, slow, tails) and gain > SLOWER else fit)
    blurred = fitted(plan, rows, replace(fit.beat, blur_s=FIRST_BLUR_ROWS * row_time_s), (*free, BLUR))
    start = replace(slow.beat, blur_s=blurred.beat.blur_s)
    joint = fitted(plan, rows, start, (*free, *tails, BLUR))
    if taken_away(plan, rows, blurred, joint) < 0.0:  # no step led from the tails to where a blur alone is better
        joint = fitted(plan, rows, blurred.beat, (*free, *tails, BLUR))
    both = joint if plausible(plan, joint.beat) and taken_away(plan, rows, slow, joint) >= -WORTH else slow
    apart_s = rms_apart_s(rows, slow.beat, both.beat)
    by_blur = max(taken_away(plan, rows, fit, blurred), 0.0)
    beyond = taken_away(plan, rows, fit, both) - by_blur
    likelier = gain > by_blur and beyond > max(SLOWER, SLOWER_SHARE * loss_of(rows, fit))
    taken = both if taken_away(plan, rows, slow, both) > WORTH else slow
    sharp = by_blur < NO_BLUR * gain
    if likelier and (sharp or _longer(taken, joint)) and has_moved(fit, both, tails):
        apart_s = float(np.hypot(apart_s, 0.0 if taken is both else _more_s(slow, both)))
        if cleared(plan, rows, fit, taken) < FEIGNED:
            apart_s = float(np.hypot(apart_s, UNTOLD * rms_apart_s(rows, fit.beat, taken.beat)))
        return Freed(fit=taken, unsure_s=apart_s)
    doubt_s = UNTOLD * float(np.hypot(rms_apart_s(rows, fit.beat, both.beat), both.shift_error_s))
    return Freed(fit=fit, unsure_s=doubt_s, soft_s=max(slow.beat.rise_s, slow.beat.fall_s))


def _hidden_s(plan: Plan, rows: Profiles, fit: Fit, slow: Fit) -> float:
    """Return by how much times are in doubt because tails that the picture does not show may be there all the same: as
    far as a fit with tails moves them, but no farther than rows make likely."""
    moved_s = UNTOLD * float(np.hypot(rms_apart_s(rows, fit.beat, slow.beat), _more_s(fit, slow)))
    return min(moved_s, untold_tails_s(plan, rows, fit))


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


def is_softer(plan: Plan, rows: Profiles, fit: Fit) -> bool:
    """Return whether flashes that rise and fall as slowly, and start earlier by that, fit better."""
    limit = loss_of(rows, fit) - WORTH
    for share in SOFTER:
        beat = with_tails(fit.beat, share * plan.shortest_flash_s)
        if robust_loss(rows, unexplained(plan, rows, beat), fit.rest) < limit:
            return True
    return _stands_still(plan, rows, fit) and shows_tails(plan, rows, fit)


def may_hide_tails(plan: Plan, rows: Profiles, fit: Fit) -> bool:
    """Return whether LEDs may rise and fall slowly without the picture or the plan showing it: the subject moves."""
    plain = replace(rows, restless=None)
    return not _tells_tails(plan) and gain_of(plain, unexplained(plan, plain, fit.beat, fit.weight)) < STILL


def hinted_s(plan: Plan, rows: Profiles, fit: Fit) -> float:
    """Return by how much times are in doubt where nothing moves because of tails that rows hint at, or because those
    that were found may be longer or shorter than their own errors say."""
    if not _stands_still(plan, rows, fit):
        return 0.0
    if set(TAILS) & set(fit.errors_s):
        return float(np.sqrt(max(open_tails_s(plan, rows, fit) ** 2 - fit.shift_error_s**2, 0.0)))
    return hinted_tails_s(plan, rows, fit)


def _stands_still(plan: Plan, rows: Profiles, fit: Fit) -> bool:
    """Return whether tails that the plan does not tell would show: nothing moves, and rows open one after another."""
    if _tells_tails(plan) or rows.restless is not None or fit.beat.row_time_s == 0.0:
        return False
    return gain_of(rows, unexplained(plan, rows, fit.beat, fit.weight)) >= STILL


def _tells_tails(plan: Plan) -> bool:
    return max(plan.rise_s, plan.fall_s) > 0.0
