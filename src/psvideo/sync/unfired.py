"""Flashes that never fired: a light that missed its turn, or that died during the clip.

Where a flash is missing, the picture shows at its time what a dark slot shows. Every flash gets a gain of its own on
what its light gives: rows' brightnesses are fitted under the gains, and the gains under the brightnesses, in turns, so
that a light that is dead for half of the clip counts as one that gives nothing then, and not as half as bright. A gain
near none is a missing flash where flashes before and after it gave light; a subject that leaves the picture takes the
light of all that follow.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles, Integers, Mask
from psvideo.model.plan import Plan
from psvideo.model.timing import Flash
from psvideo.model.units import counted
from psvideo.sync.rowfit.fit import ClipFit
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import row_noise
from psvideo.sync.rowfit.tracking.misfires import first_seen, seen_flashes

ROWS = 60
PART_FRAMES = 512
"""Frames over which a light's brightnesses are taken to be the same, but for one gain a flash."""
TURNS = 4
TOUCHED = 4
"""A flash is looked for in this many frames from the first that may see any of it."""
NONE = 0.2
"""A flash that gives less than this share of what its light gives elsewhere, as the flashes around it do, has not
fired."""
AROUND = 3
"""Lit flashes before and after, or a round of them, that show whether light goes on;"""
GOES_ON = 0.5
"""it does where one on either side gives this share of its own light."""
SEEN = 0.02
"""Rows that have seen less than this of a flash, as a share of its squared light, do not show whether it fired, however
little noise there is: what the times' errors do to so few rows is not in it."""
SURE = 4.0
"""Standard errors by which a gain, and usual scatters by which a flash, must lie below what one that fired shows. With
so many a gain must be known to ``GOES_ON`` at all."""
FAINT = 0.01
"""A light that gives less than this share of the brightest one is said to give none at all, elsewhere."""
LEAST_FIRED = 3
"""Flashes of a light that fired, from which on it is known how much they scatter."""
MOST_NAMED = 8
"""Frames that a sentence names."""


@dataclass(frozen=True, kw_only=True)
class _Levels:
    """What flashes give, ``value`` (flash,), with its standard errors; NaN where too little was seen of one."""

    value: Doubles
    error: Doubles


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
    frames off: flashes beyond all that are seen to give light may not have fired.

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
    early, late = (lit[: shows[0]], lit[shows[-1] + 1 :]) if len(shows) else ([], [])
    beside.update(flash.index for there, some in zip(breaks, (early, late), strict=True) if there for flash in some)
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
    levels = _levels(plan, found, lit)
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


def _levels(plan: Plan, found: ClipFit, lit: Sequence[Flash]) -> _Levels:
    """Return what every lit flash gives, with brightnesses that are fitted part by part."""
    rows = replace(found.rows.one_window(), doubt=None, restless=None).binned(ROWS)
    start_s, duration_s = (np.array([getattr(one, name) for one in lit]) for name in ("start_s", "duration_s"))
    number = {slot: n for n, slot in enumerate(plan.lit_slots)}
    unknown = np.array([number[one.slot] for one in lit])
    first = first_seen(found.rows, found.fit.beat, start_s)
    value, error = np.full(len(lit), np.nan), np.full(len(lit), np.inf)
    parts = max(round(len(rows.value) / PART_FRAMES), 1)
    edges = np.linspace(0, len(rows.value), parts + 1).astype(int)
    for begin, end in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        span = slice(begin, min(end + TOUCHED, len(rows.value)))
        own = np.flatnonzero((first <= rows.index[end - 1]) & (first + TOUCHED > rows.index[begin]))
        if not len(own):
            continue
        part = _Part.of(found, rows.take(span), start_s[own], duration_s[own], unknown[own])
        level, unsure = part.levels(len(plan.lit_slots))
        here = (first[own] >= rows.index[begin]) | (begin == 0)
        value[own[here]], error[own[here]] = level[here], unsure[here]
    return _Levels(value=value, error=error)


@dataclass(frozen=True, kw_only=True)
class _Part:
    """Frames ``value`` (frame, row) and the flashes in them: of each its light ``unknown`` (flash,), the frames ``at``
    (flash, touched) that may have seen it, and what share of it their rows saw, ``seen`` (flash, touched, row)."""

    value: Doubles
    at: Integers
    seen: Doubles
    unknown: Integers

    @classmethod
    def of(
        cls,
        found: ClipFit,
        rows: Profiles,
        start_s: Doubles,
        duration_s: Doubles,
        unknown: Integers,
    ) -> "_Part":
        """Lay out flashes that start and last for some seconds."""
        at, seen = seen_flashes(rows, found.fit.beat, start_s, duration_s, touched=TOUCHED)
        return cls(value=rows.value, at=at, seen=seen, unknown=unknown)

    def levels(self, lights: int) -> tuple[Doubles, Doubles]:
        """Return what every flash gives, as a mean over rows, and its standard error, both of shape (flash,)."""
        gain = np.ones(len(self.unknown))
        for turn in range(TURNS):
            design = self._design(gain, lights)
            light = _solved(design, self.value)
            rest = self.value - np.einsum("fru,ru->fr", design, light)
            own = self.seen * light[:, 1:].T[self.unknown][:, None, :]
            power = (own**2).sum(axis=(1, 2))
            move = (own * rest[self.at]).sum(axis=(1, 2)) / np.maximum(power, 1e-30)
            gain = np.clip(gain + move * (1.0 if turn == 0 else 0.7), -1.0, 9.0)
        size = np.sqrt((light[:, 1:] ** 2).mean(axis=0))[self.unknown]
        whole = (light[:, 1:] ** 2).sum(axis=0)[self.unknown]
        noise = np.sqrt((own**2 * row_noise(rest) ** 2).sum(axis=(1, 2))) / np.maximum(power, 1e-30)
        level: Doubles = np.where((power > SEEN * whole) & (SURE * noise < GOES_ON), gain * size, np.nan)
        return level, noise * size

    def _design(self, gain: Doubles, lights: int) -> Doubles:
        """Return what rows saw of ambient light and of every light, shape (frame, row, 1 + light)."""
        design = np.zeros((*self.value.shape, 1 + lights))
        design[:, :, 0] = 1.0
        share = gain[:, None, None] * self.seen
        np.add.at(design.transpose(0, 2, 1), (self.at, 1 + self.unknown[:, None]), share)
        return design


def _solved(design: Doubles, value: Doubles) -> Doubles:
    """Return the brightnesses (row, unknown) that explain rows best."""
    normal = np.einsum("fru,frv->ruv", design, design, optimize=True)
    size = np.einsum("ruu->ru", normal)
    normal += 1e-6 * np.maximum(size, size.max())[:, :, None] * np.eye(design.shape[2])
    right = np.einsum("fru,fr->ru", design, value, optimize=True)
    found: Doubles = np.linalg.solve(normal, right[:, :, None])[:, :, 0]
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


def _lost(flashes: Sequence[Flash], fired: Sequence[Flash]) -> list[Flash]:
    return [one for one, other in zip(flashes, fired, strict=True) if one.complete and not other.complete]


def remarks_on_unfired(
    found: ClipFit, flashes: Sequence[Flash], fired: Sequence[Flash], numbers: NDArray[np.int64]
) -> Iterator[str]:
    """Say which of a clip's complete ``flashes`` are not among those that ``fired``, by the frames' ``numbers``."""
    lost = _lost(flashes, fired)
    for lit in dict.fromkeys(flash.lit for flash in lost):
        own = [flash for flash in lost if flash.lit == lit]
        first = first_seen(found.rows, found.fit.beat, np.array([flash.start_s for flash in own]))
        frames = numbers[np.clip(np.searchsorted(found.track.index, first), 0, len(numbers) - 1)].tolist()
        last_s = max((flash.start_s for flash in fired if flash.lit == lit and flash.complete), default=-np.inf)
        shown = ", ".join(str(number) for number in frames[:MOST_NAMED]) + (" …" if len(frames) > MOST_NAMED else "")
        where = f"none after frame {frames[0]}" if len(own) > 1 and last_s < own[0].start_s else f"in frames {shown}"
        yield (
            f"{'+'.join(lit)}: {counted(len(own), 'flash')} never fired ({where}), where flashes before and after did. "
            "They are marked as incomplete and give no plate: check this light, its wiring and its power."
        )
