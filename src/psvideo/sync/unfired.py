"""Flashes that never fired: a light that missed its turn, or that died during the clip.

Where a flash is missing, the picture shows at its time what a dark slot shows, so that its level (``flash_levels``) is
near none. It is a missing flash where flashes before and after it gave light; a subject that leaves the picture takes
the light of all that follow.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from psvideo.model.arrays import Doubles, Integers, Mask
from psvideo.model.plan import Plan
from psvideo.model.timing import Flash
from psvideo.sync.flash_levels import GOES_ON, SURE, TOUCHED, flash_levels
from psvideo.sync.rowfit.fit import ClipFit
from psvideo.sync.rowfit.tracking.misfires import first_seen

NONE = 0.2
"""A flash that gives less than this share of what its light gives elsewhere, as the flashes around it do, has not
fired."""
AROUND = 3
"""Lit flashes before and after, or a round of them, that show whether light goes on; it does where one on either side
gives ``GOES_ON`` of its own light."""
FAINT = 0.01
"""A light that gives less than this share of the brightest one is said to give none at all, elsewhere."""
LEAST_FIRED = 3
"""Flashes of a light that fired, from which on it is known how much they scatter."""


@dataclass(frozen=True, kw_only=True)
class Unfired:
    """Flashes by their ``index``: those that ``never`` fired, and those ``beside`` them, or beside where the strobe
    began or stopped, that may not have fired either."""

    never: frozenset[int]
    beside: frozenset[int]


def unfired_of(
    plan: Plan, found: ClipFit, flashes: Sequence[Flash], *, breaks: tuple[bool, bool] = (False, False)
) -> Unfired:
    """Return which of a clip's flashes, in order, give no light where others go on. ``found`` is the fit under the
    lights' names.

    A flash of which too little was seen, as below 360 degrees most that fall between two exposures, is one where those
    of its light before and after are, and may be one where one of them is, or the next one of any light on either side
    of which enough was seen. ``breaks``: whether the strobe began at the first frame, or stopped at the last, or some
    frames off: flashes beyond all that are seen to give light may not have fired, and a dark slot there may be
    none, but the dark of a strobe that stood still.

    One light's flashes, with those of others between them, under ``breaks`` (True, False). What they give is 1, 0 or
    not known; ``told`` are those of which it is::

        gives     ?   ?   1   ?   1   ?   0   ?   0   ?   1   ?
        told      .   .   x   .   x   .   x   .   x   .   x   .
        never                             x   x   x
        beside    b   b               x               x

    Between two that fired one has fired, between two dead ones it never did, and between one of each it may have. The
    first two (b) have none before them, and the strobe began in their time; the last is taken to be as the one before
    it, as the strobe did not stop.
    """
    lit = [flash for flash in flashes if not flash.is_dark]
    if not lit:
        return Unfired(never=frozenset(), beside=frozenset())
    off, told, gives = _unfired(plan, found, lit)
    never, beside = set[int](), set[int]()
    for slot in plan.lit_slots:
        own = [n for n, flash in enumerate(lit) if flash.slot == slot]
        known = [n for n in own if told[n]]
        for n in own:
            around = (next((k for k in reversed(known) if k <= n), None), next((k for k in known if k >= n), None))
            dead = [bool(off[k]) for k in around if k is not None]
            if any(dead):
                (never if all(dead) else beside).add(lit[n].index)
    beside |= {lit[n].index for n in _beside_off(off, told)} - never
    shows = np.flatnonzero(gives)
    if len(shows):
        first, last = lit[shows[0]].index, lit[shows[-1]].index
        beside |= {
            one.index for one in flashes if (breaks[0] and one.index < first) or (breaks[1] and one.index > last)
        }
    return Unfired(never=frozenset(never - beside), beside=frozenset(beside))


def _beside_off(off: Mask, told: Mask) -> Integers:
    """Return the flashes of which it is not ``told`` whether they fired, where the nearest of which it is, on either
    side, did not: several may have been missing in a row."""
    known, unknown = np.flatnonzero(told), np.flatnonzero(~told)
    if not len(known):
        return unknown[:0]
    behind = np.searchsorted(known, unknown)
    before, after = known[np.maximum(behind - 1, 0)], known[np.minimum(behind, len(known) - 1)]
    found: Integers = unknown[off[before] | off[after]]
    return found


def incomplete(flashes: Sequence[Flash], those: frozenset[int]) -> tuple[Flash, ...]:
    """Return flashes with some of them, by their ``index``, marked as incomplete."""
    return tuple(replace(one, complete=one.complete and one.index not in those) for one in flashes)


def _unfired(plan: Plan, found: ClipFit, lit: Sequence[Flash]) -> tuple[Mask, Mask, Mask]:
    """Return which of the lit flashes never fired, of which enough was seen to tell, and which are seen to give some
    light, all of shape (flash,)."""
    slot = np.array([flash.slot for flash in lit])
    levels = flash_levels(plan, found, lit)
    share, error = np.full(len(lit), np.nan), np.full(len(lit), np.inf)
    usual = {one: _usual(levels.value[slot == one]) for one in plan.lit_slots}
    for one, level in usual.items():
        if level > FAINT * max(usual.values()):
            share[slot == one] = levels.value[slot == one] / level
            error[slot == one] = levels.error[slot == one] / level
    known = np.where([flash.complete for flash in lit], share, np.nan)
    goes_on = around(known, max(AROUND, len(plan.lit_slots)))
    fires, gives = share > GOES_ON, share > NONE
    share, error = share / goes_on, error / goes_on
    off = (share < NONE) & (goes_on > GOES_ON) & (share + SURE * error < GOES_ON)
    for one in plan.lit_slots:
        fired = share[(slot == one) & (share > GOES_ON) & (goes_on > GOES_ON)]
        scatter = 1.4826 * float(np.median(np.abs(fired - np.median(fired)))) if len(fired) >= LEAST_FIRED else np.inf
        off &= (slot != one) | (1 - share > SURE * scatter)
    return off, np.isfinite(share) & (fires | (goes_on > GOES_ON)), gives


def _usual(level: Doubles) -> float:
    """Return what a light's flashes give that fire, most of which may be missing."""
    known = level[np.isfinite(level)]
    if not len(known):
        return 0.0
    return float(np.median(known[known >= GOES_ON * np.percentile(known, 95)], keepdims=True)[0])


def around(share: Doubles, reach: int) -> Doubles:
    """Return what flashes that fired give of their own light just before and after each one, shape (flash,).

    A ``share`` (flash,) is NaN where it is not known. Light goes on where most of the nearest flashes give it, or where
    one on either side does: ``1 1 0 0 0 1 1`` are three in whose place it went on, ``1 1 0 0 0 0 0`` may be a subject
    that left. Those that give less than half of that did not fire themselves.
    """
    beside = np.array([n for n in range(-reach, reach + 1) if n])
    at = np.arange(len(share))[:, None] + beside
    near = np.where((at >= 0) & (at < len(share)), share[np.clip(at, 0, len(share) - 1)], np.nan)
    near = np.maximum(near, 0.0)
    near[np.isnan(near[:, np.abs(beside) <= AROUND]).all(axis=1)] = 0.0
    sides = [np.fmax.reduce(near[:, side], axis=1) for side in (beside < 0, beside > 0)]
    goes_on = np.fmax(np.nanmedian(near[:, np.abs(beside) <= AROUND], axis=1), np.minimum(*sides))
    fired = np.where(near >= GOES_ON * goes_on[:, None], near, np.nan)
    found: Doubles = np.maximum(np.minimum(np.nanmedian(fired, axis=1), goes_on), 1e-9)
    return found


def only_fired(found: ClipFit, flashes: Sequence[Flash], unfired: Unfired) -> ClipFit:
    """Return the fit with only those frames that saw nothing of ``flashes`` that did not fire, or may not have: their
    light says nothing of the camera's exposure."""
    lost = [flash for flash in flashes if flash.index in unfired.never | unfired.beside]
    if not lost:
        return found
    first = first_seen(found.rows, found.fit.beat, np.array([flash.start_s for flash in lost]))
    saw = (first[:, None] + np.arange(TOUCHED)).ravel()
    rows, fit, kept = found.rows, found.fit, ~np.isin(found.rows.index, saw)
    if not kept.any():
        return found
    doubt = None if rows.doubt is None else rows.doubt[kept]
    rows = replace(rows, value=rows.value[kept], index=rows.index[kept], doubt=doubt).one_window()
    return replace(found, rows=rows, fit=replace(fit, rest=fit.rest[kept], weight=fit.weight[kept]))
