"""By how much the latest frames come later than foretold: held against brightnesses that are known, none is fitted.

Frames that went missing leave the strobe where its clock has it. A strobe that was started again stands anywhere, and
of so many frames as may be missing some nearly explain it: near a flash's place is not at it.
"""

from dataclasses import replace

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.profiles import Profiles, predictions
from psvideo.sync.rowfit.refine import CAUCHY, LAST_SCALE

STEPS, NUDGE, MOST = 4, 0.05, 0.3
"""Steps of the fit; the shift by which its slope is measured, and the longest step, as shares of the shortest flash."""
LIT = 0.03
"""Rows count that change by this share of what the most changing one does."""
NORMAL = 1.4826
"""A normal distribution's standard deviation in median absolute deviations."""


def shift_of(plan: Plan, rows: Profiles, beat: Beat, *, learnt: Profiles, light: Doubles) -> tuple[float, float]:
    """Return by how many seconds the flashes in ``rows`` come later than a beat says, and the standard error.

    ``light`` are the brightnesses that ``learnt`` frames gave.
    """
    step_s, most_s, shift_s, error_s = NUDGE * plan.shortest_flash_s, MOST * plan.shortest_flash_s, 0.0, np.inf
    lit = learnt.spread > LIT * learnt.spread.max()
    for _ in range(STEPS):
        clocks = [beat.clock.shifted(shift_s + by_s, 0.0, pivot_s=0.0) for by_s in (-step_s, 0.0, step_s)]
        before, rest, after = (
            (rows.value - predictions(plan, rows, replace(beat, clock=one), light))[:, lit] for one in clocks
        )
        slope = (after - before) / (2 * step_s)
        scale = np.maximum(NORMAL * np.median(np.abs(rest)), LAST_SCALE * learnt.spread[lit])
        weight = 1.0 / (1.0 + (rest / (CAUCHY * scale)) ** 2) / scale**2
        known = float((weight * slope**2).sum())
        if not known:
            return 0.0, np.inf
        shift_s -= float(np.clip((weight * slope * rest).sum() / known, -most_s, most_s))
        error_s = float(np.sqrt((weight**2 * slope**2 * rest**2).sum())) / known
    return shift_s, error_s
