"""A transfer curve that is a little wrong: half of a flash does not look half as bright as all of it.

Rows that open in a flash and rows that close in it then both seem to see more of it, or both less, as under another
exposure; freeing that would move all flashes by half of the difference. But another exposure changes what a row saw by
as much wherever in a flash it opens or closes, and a curve changes nothing where it saw almost all of it or none. So
both are fitted together, as small steps from a fit that is near.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from psvideo.model.plan import Plan
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import Fit, robust_loss
from psvideo.sync.rowfit.unknowns.bend import fitted
from psvideo.sync.rowfit.unknowns.small_steps import (
    EXPOSURE,
    FIRST_SHAPE,
    OTHERS,
    SHAPES,
    SHIFT,
    SmallSteps,
    shapes_added,
    small_steps,
)

CLEAR = 30.0
"""Variances that a curve, or an exposure, must explain beyond what the other one does, to be needed beside it."""
LIKELY = 9.0
"""Variances that an exposure or a readout must explain to put times in doubt, and a curve to be off still more."""
ROUNDS = 4
"""Steps are small ones: what is left is looked at again so often."""
MOST = 0.05
"""A curve that changes light by more than this share of the brightest is another curve."""
Curve = tuple[float, ...]
"""How much of each shape is to be added to light that was read, to be what fell on the sensor."""


@dataclass(frozen=True, kw_only=True)
class Straightened:
    """Rows and their fit without the ``curves`` that were taken out of them, and by how much times are in doubt because
    curve and exposure are not told apart."""

    rows: Profiles
    fit: Fit
    curves: tuple[Curve, ...] = ()
    unsure_s: float = 0.0


def straight(rows: Profiles, curves: Sequence[Curve]) -> Profiles:
    """Return profiles with curves taken out, in order."""
    for curve in curves:
        more = sum((off * shape(rows.value) for off, shape in zip(curve, SHAPES, strict=True)), np.float64(0.0))
        rows = replace(rows, value=np.ascontiguousarray(rows.value + more))
    return rows


def straightened(plan: Plan, rows: Profiles, fit: Fit, free: tuple[str, ...]) -> Straightened:
    """Take the curve out of rows that clearly show it to be off, where another exposure does not explain them as well.

    ``free`` are the times that are free in ``fit``; where the exposure is one of them, so it stays.
    """
    curves: list[Curve] = []
    while True:
        steps = small_steps(plan, rows, fit, free)
        curve, unsure_s = _curve(steps, held="exposure_s" not in free, surely=not curves)
        if not any(curve) or len(curves) == ROUNDS or not _likelier(plan, rows, fit, free, curve):
            return Straightened(rows=rows, fit=fit, curves=tuple(curves), unsure_s=unsure_s)
        rows = straight(rows, [curve])
        fit = fitted(plan, rows, fit.beat, free)
        curves.append(curve)


def _likelier(plan: Plan, rows: Profiles, fit: Fit, free: tuple[str, ...], curve: Curve) -> bool:
    """Return whether a curve leaves less than another exposure does: what small steps show of it may be far off.

    The curve is taken out of what the fit predicts, lest noise in bright rows grows or shrinks with it.
    """
    more = sum((off * one for off, one in zip(curve, shapes_added(plan, rows, fit), strict=True)), np.float64(0.0))
    if float(np.abs(more).max()) > MOST * float(rows.value.max()):
        return False
    bent = fitted(plan, replace(rows, value=np.ascontiguousarray(rows.value + more)), fit.beat, free)
    exposed = fit if "exposure_s" in free else fitted(plan, rows, fit.beat, (*free, "exposure_s"))
    return robust_loss(rows, bent.rest, fit.rest) < robust_loss(rows, exposed.rest, fit.rest)


def _curve(steps: SmallSteps, *, held: bool, surely: bool) -> tuple[Curve, float]:
    """Return the curve that is to be taken out, all 0 for none, and by how much times are in doubt as it stays.

    A curve that was found to be off is likelier to be off a little more than the exposure is, as well: not ``surely``,
    it need only explain more.
    """
    exposed, both = steps.taken([EXPOSURE]), steps.best([EXPOSURE])
    bent = steps.best([]) if held else both
    unsure = 0.0 if held else (both.by[SHIFT] - exposed.by[SHIFT]) ** 2 + both.variance - exposed.variance
    taken = both if both.gain - bent.gain > CLEAR else bent
    beyond, least = (both.gain - exposed.gain, CLEAR) if surely else (bent.gain - steps.taken([]).gain, LIKELY)
    needed = beyond > least and bent.gain >= exposed.gain
    curve = tuple(taken.by[FIRST_SHAPE:OTHERS].tolist()) if needed else (0.0,) * len(SHAPES)
    return curve, float(np.sqrt(max(unsure, 0.0)))
