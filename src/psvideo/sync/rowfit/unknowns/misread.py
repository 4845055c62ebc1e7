"""Footage that was read by another curve altogether: a signal taken for light, light for a signal, or log for gamma.

Half of a flash then looks far more or far less than half as bright as all of it, alike where rows open in it and where
they close. Another exposure with slow LEDs looks similar and moves all flashes, but it leaves rows in the middle of a
flash unexplained. So where a fit needs either, the usual curves are tried in its place: each is fitted to what it makes
of the rows, and held against the rows as they were read.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np

from psvideo.compute.ranks import quantile
from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import Fit, refine, robust_loss
from psvideo.sync.rowfit.unknowns.bend import rms_apart_s

POWERS = (1 / 3.0, 1 / 2.2, 1 / 1.6, 1.6, 2.2, 3.0)
"""Of what was read, to be light: sRGB and Rec. 709 that were read as light are near 2.2, the reverse is 1 / 2.2."""
LOGS = (2.0, 4.0, 6.0)
"""How much steeper light is at white than at black under logarithmic curves, as natural logarithms: S-Log3 whose
rows reach codes of 0.5 to 0.6 is near 5."""
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


@dataclass(frozen=True, kw_only=True)
class OtherCurve:
    """How light is to be told from what was read: as its power ``strength``, or as its exponential, ``strength`` being
    the natural logarithm of how much steeper that is at white than at black.

    ``white`` is what was read of the brightest rows.
    """

    kind: Literal["power", "exponential"]
    strength: float
    white: float

    def light(self, value: Doubles) -> Doubles:
        """Return the light of what was read, any shape; white stays what it was."""
        share = np.maximum(value / self.white, 0.0)
        if self.kind == "power":
            return np.asarray(self.white * share**self.strength)
        return np.asarray(self.white * np.expm1(self.strength * np.minimum(share, 2.0)) / np.expm1(self.strength))

    def read(self, light: Doubles) -> Doubles:
        """Return what is read of light, the reverse."""
        share = np.maximum(light / self.white, 0.0)
        if self.kind == "power":
            return np.asarray(self.white * share ** (1.0 / self.strength))
        return np.asarray(self.white * np.log1p(share * np.expm1(self.strength)) / self.strength)

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
    """The ``reading`` that is to be taken instead, if any; else by how much times are in doubt as one may be."""

    reading: OtherCurve | None = None
    unsure_s: float = 0.0


def misread(plan: Plan, rows: Profiles, fit: Fit, free: tuple[str, ...]) -> Misread:
    """Return by which other curve rows are to be read, where that explains clearly more than all that ``fit`` holds.

    ``free`` are the times that are free under the plan itself: under the right curve no others are needed.
    """
    planned = replace(fit.beat, exposure_s=plan.camera.exposure_s, rise_s=plan.rise_s, fall_s=plan.fall_s, blur_s=0.0)
    part = rows.take(slice(0, PROBED_FRAMES)).binned(PROBED_ROWS)
    best = min(_tried(plan, part, planned, free), key=lambda one: one[1])[0]
    read, left = _left(plan, rows, fit, planned, best, free)
    share = left / max(robust_loss(rows, fit.rest, fit.rest), 1e-30)
    if share < TAKEN:
        return Misread(reading=best)
    return Misread(unsure_s=rms_apart_s(rows, fit.beat, read.beat) if share < 1.0 else 0.0)


def _tried(plan: Plan, part: Profiles, beat: Beat, free: tuple[str, ...]) -> Iterator[tuple[OtherCurve, float]]:
    """Yield readings of some rows and what they leave, from coarse steps to fine ones."""
    known = refine(plan, part, beat, free=free)
    white = max(quantile(part.value.ravel(), WHITE), 1e-9)

    def loss(reading: OtherCurve) -> float:
        return _left(plan, part, known, beat, reading, free)[1]

    coarse = [OtherCurve(kind="power", strength=one, white=white) for one in POWERS]
    coarse += [OtherCurve(kind="exponential", strength=one, white=white) for one in LOGS]
    losses = [loss(one) for one in coarse]
    best, least = min(zip(coarse, losses, strict=True), key=lambda one: one[1])
    yield best, least
    for factor in FINER:
        near = [replace(best, strength=best.strength * by) for by in (factor, 1 / factor)]
        best, least = min([(best, least), *((one, loss(one)) for one in near)], key=lambda one: one[1])
        yield best, least


def _left(
    plan: Plan, rows: Profiles, known: Fit, beat: Beat, reading: OtherCurve, free: tuple[str, ...]
) -> tuple[Fit, float]:
    """Return the fit to what a reading makes of the rows, and the robust loss that it leaves of them as they are."""
    there = reading.of(rows)
    fit = refine(plan, there, beat, free=free)
    return fit, robust_loss(rows, rows.value - reading.read(there.value - fit.rest), known.rest)
