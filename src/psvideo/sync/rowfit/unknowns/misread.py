"""Footage that was read by another curve altogether: a signal taken for light, light for a signal, or log for gamma.

Half of a flash then looks far more or far less than half as bright as all of it, alike where rows open in it and where
they close. Another exposure with slow LEDs looks similar and moves all flashes, but it leaves rows in the middle of a
flash unexplained. So where a fit needs either, the usual curves are tried in its place: each is fitted to what it makes
of the rows, and held against the rows as they were read.
"""

from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np

from psvideo.compute.ranks import quantile
from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import TAILS, Fit, refine, robust_loss
from psvideo.sync.rowfit.unknowns.bend import rms_apart_s
from psvideo.sync.rowfit.unknowns.softness import plausible

BENT: tuple[Literal["exponential", "logarithm"], ...] = ("exponential", "logarithm")
POWERS = (1 / 3.0, 1 / 2.2, 1 / 1.6, 1.6, 2.2, 3.0)
"""Of what was read, to be light: sRGB and Rec. 709 that were read as light are near 2.2, the reverse is 1 / 2.2."""
LOGS = (2.0, 4.0, 6.0)
"""How much steeper light is at white than at black under logarithmic curves, as natural logarithms: S-Log3 whose
rows reach codes of 0.5 to 0.6 is near 5. Gamma that was read as S-Log3 is the reverse."""
FINER = (1.25, 1.12)
"""Factors by which strengths are changed from the best of these, round by round."""
PROBED_ROWS, PROBED_FRAMES = 60, 240
"""Rows and frames in which curves are looked for; the likeliest is then fitted to all."""
WHITE = 0.999
"""The quantile of the rows that counts as white: light beyond it is followed as far."""
TAKEN = 0.75
"""A curve is taken that leaves less than this share of the robust loss: wrong ones left 0.19 to 0.66 of it where little
moved (0.08 to 0.58 in clips of other seeds), right ones 0.998 and more. One that leaves no more than all of it puts
times in doubt."""
FIRST_TAILS = 0.03
"""Tails are looked for from this share of the shortest flash."""
AS_LIKELY, UNTOLD = 1.5, 0.6
"""Where a curve is taken, others that leave less than this many times what is left at least put times in doubt by the
second share of how far they move them: with tails, too, where these leave less."""
CLIPPED = 0.5
"""No curve is taken where clipped pixels may account for this share of how rows change: they look bent anyway."""


@dataclass(frozen=True, kw_only=True)
class OtherCurve:
    """How light is to be told from what was read: as its power ``strength``, or as its exponential, ``strength`` being
    the natural logarithm of how much steeper that is at white than at black, or as its logarithm, the reverse.

    ``white`` is what was read of the brightest rows.
    """

    kind: Literal["power", "exponential", "logarithm"]
    strength: float
    white: float

    def light(self, value: Doubles) -> Doubles:
        """Return the light of what was read, any shape; white stays what it was."""
        return np.asarray(self.white * self._bent(value / self.white, backwards=False))

    def read(self, light: Doubles) -> Doubles:
        """Return what is read of light, the reverse."""
        return np.asarray(self.white * self._bent(light / self.white, backwards=True))

    def _bent(self, share: Doubles, *, backwards: bool) -> Doubles:
        share = np.maximum(share, 0.0)
        if self.kind == "power":
            return np.asarray(share ** (1.0 / self.strength if backwards else self.strength))
        if (self.kind == "logarithm") is backwards:
            return np.asarray(np.expm1(self.strength * np.minimum(share, 2.0)) / np.expm1(self.strength))
        return np.asarray(np.log1p(share * np.expm1(self.strength)) / self.strength)

    @property
    def half(self) -> float:
        """How bright half of the brightest flash looks against all of it."""
        return float(self.read(np.array([0.5 * self.white]))[0] / self.white)

    def of(self, rows: Profiles) -> Profiles:
        """Return profiles as light, with what is doubtful in them."""
        value = np.ascontiguousarray(self.light(rows.value))
        if rows.doubt is None:
            return replace(rows, value=value)
        reach = self.light(rows.value + rows.doubt) - self.light(rows.value - rows.doubt)
        return replace(rows, value=value, doubt=np.ascontiguousarray(0.5 * reach))


class Misread(NamedTuple):
    """The ``reading`` that is to be taken instead, if any, and the beats of what is nearly as likely beside it; else by
    how much times are in doubt as one may be."""

    reading: OtherCurve | None = None
    others: tuple[Beat, ...] = ()
    unsure_s: float = 0.0


class _Held(NamedTuple):
    """A fit to what a reading makes of rows, and the robust loss that it leaves of them as they were read."""

    fit: Fit
    left: float


def misread(plan: Plan, rows: Profiles, fit: Fit, free: tuple[str, ...]) -> Misread:
    """Return by which other curve rows are to be read, where that explains clearly more than all that ``fit`` holds.

    ``free`` are the times that are free under the plan itself: under the right curve no others are needed, but tails.
    """
    if rows.clipped_share > CLIPPED:
        return Misread()
    planned = replace(fit.beat, exposure_s=plan.camera.exposure_s, rise_s=plan.rise_s, fall_s=plan.fall_s, blur_s=0.0)
    readings = _likeliest(plan, rows, planned, free)
    plain = _held(plan, rows, fit, planned, readings[0], free)
    all_of_it = max(robust_loss(rows, fit.rest, fit.rest), 1e-30)
    if plain.left > all_of_it:
        return Misread()
    slow = _held(plan, rows, fit, _slower(plan, planned), readings[0], _with_tails(free))
    if plain.left > TAKEN * all_of_it and not _better_with_tails(plan, rows, fit, planned, free, slow):
        return Misread(unsure_s=rms_apart_s(rows, fit.beat, plain.fit.beat))
    likely = [plain, slow] if slow.left < plain.left else [plain]
    most = AS_LIKELY * likely[-1].left
    for other in readings[1:]:
        bare = _held(plan, rows, fit, planned, other, free)
        tails = _held(plan, rows, fit, _slower(plan, planned), other, _with_tails(free))
        likely += [one for one in (bare, tails) if one.left < most and one.left <= bare.left]
    return Misread(reading=readings[0], others=tuple(one.fit.beat for one in likely if plausible(plan, one.fit.beat)))


def _better_with_tails(plan: Plan, rows: Profiles, fit: Fit, planned: Beat, free: tuple[str, ...], slow: _Held) -> bool:
    """Return whether a reading is clearly the better one once there are tails, under the plan's own curve too."""
    as_read = refine(plan, rows, _slower(plan, planned), free=_with_tails(free))
    least = min(robust_loss(rows, one.rest, fit.rest) for one in (fit, as_read))
    return slow.left < TAKEN * least and plausible(plan, slow.fit.beat)


def doubt_s(rows: Profiles, fit: Fit, others: tuple[Beat, ...]) -> float:
    """Return by how much the times of a fit to rows that were read again are in doubt because others are as likely."""
    return UNTOLD * max((rms_apart_s(rows, fit.beat, one) for one in others), default=0.0)


def _with_tails(free: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(dict.fromkeys((*free, *TAILS)))


def _slower(plan: Plan, beat: Beat) -> Beat:
    """Return a beat whose flashes rise and fall more slowly, and start earlier by that."""
    more_s = FIRST_TAILS * plan.shortest_flash_s
    earlier = beat.with_phase(beat.clock.phase_s - more_s)
    return replace(earlier, rise_s=beat.rise_s + more_s, fall_s=beat.fall_s + more_s)


def _likeliest(plan: Plan, rows: Profiles, beat: Beat, free: tuple[str, ...]) -> list[OtherCurve]:
    """Return the best reading of each kind, as some of the rows show it, the best of all first."""
    part = rows.take(slice(0, PROBED_FRAMES)).binned(PROBED_ROWS)
    known = refine(plan, part, beat, free=free)
    white = max(quantile(part.value.ravel(), WHITE), 1e-9)

    def left(reading: OtherCurve) -> float:
        return _held(plan, part, known, beat, reading, free).left

    usual = [OtherCurve(kind="power", strength=one, white=white) for one in POWERS]
    usual += [OtherCurve(kind=kind, strength=one, white=white) for kind in BENT for one in LOGS]
    losses = {reading: left(reading) for reading in usual}
    best = [min((one for one in usual if one.kind == kind), key=lambda one: losses[one]) for kind in ("power", *BENT)]
    best.sort(key=lambda one: losses[one])
    first = best[0]
    for factor in FINER:
        near = [replace(first, strength=first.strength * by) for by in (factor, 1 / factor)]
        losses |= {reading: left(reading) for reading in near}
        first = min((first, *near), key=lambda one: losses[one])
    return [first, *best[1:]]


def _held(plan: Plan, rows: Profiles, known: Fit, beat: Beat, reading: OtherCurve, free: tuple[str, ...]) -> _Held:
    there = reading.of(rows)
    fit = refine(plan, there, beat, free=free)
    return _Held(fit, robust_loss(rows, rows.value - reading.read(there.value - fit.rest), known.rest))
