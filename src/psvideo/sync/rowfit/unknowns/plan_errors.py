"""By how much times are in doubt because the plan's exposure or readout, which a fit takes as given, may be wrong."""

import numpy as np

from psvideo.model.plan import Plan
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import Fit
from psvideo.sync.rowfit.unknowns.bend import fitted, rms_apart_s
from psvideo.sync.rowfit.unknowns.curve import LIKELY
from psvideo.sync.rowfit.unknowns.misread import CLIPPED
from psvideo.sync.rowfit.unknowns.small_steps import EXPOSURE, ROW_TIME, SHIFT, small_steps

NOMINAL, OFTEN, BENT = 0.003, 0.25, 0.02
"""Exposures and readouts are off from what plans say by about the first share of themselves, as those are that LED
stripes show, by odds of the second to one; the third are a curve's odds, unless so much clips that this looks bent."""


def maybe_otherwise_s(plan: Plan, rows: Profiles, fit: Fit, free: tuple[str, ...]) -> float:
    """Return by how much times are in doubt because exposure or readout, where they are not ``free`` in the fit, may be
    others than the plan's: the exposure explains more than a curve does, or what a curve leaves."""
    steps = small_steps(plan, rows, fit, free)
    others, beside_s = list[str](), 0.0
    if "exposure_s" not in free:
        exposed, bent, both = steps.taken([EXPOSURE]), steps.best([]), steps.best([EXPOSURE])
        beside_s = abs(float(both.by[SHIFT] - bent.by[SHIFT])) if both.gain - bent.gain > LIKELY else 0.0
        others += ["exposure_s"] if exposed.gain > max(bent.gain, steps.taken([]).gain + LIKELY) else []
    if "row_time_s" not in free and steps.taken([ROW_TIME]).gain > steps.taken([]).gain + LIKELY:
        others.append("row_time_s")
    if not others:
        return beside_s
    return max(beside_s, rms_apart_s(rows, fit.beat, fitted(plan, rows, fit.beat, (*free, *others)).beat))


def nominally_s(plan: Plan, rows: Profiles, fit: Fit, free: tuple[str, ...]) -> float:
    """Return by how much times are in doubt because exposure or readout, where they are not ``free`` in the fit, may be
    as little off as plans usually are.

    Where rows tell little of them, as where most pixels clip, such an error stays, and moves all flashes. Each is held
    against the plan's value and against a curve by how likely the rows are under it (Jeffreys 1939).
    """
    steps, beat = small_steps(plan, rows, fit, free), fit.beat
    plain = steps.taken([]).gain
    bent = np.log(BENT) + 0.5 * (steps.best([]).gain - plain) if rows.clipped_share < CLIPPED else -np.inf
    doubts_s = [0.0]
    for name, place in (("exposure_s", EXPOSURE), ("row_time_s", ROW_TIME)):
        off, variance, moved = steps.beside(place)
        usual = (NOMINAL * getattr(beat, name)) ** 2
        if name in free or usual == 0.0 or (off > 0.0 and place == EXPOSURE and beat.exposure_s >= rows.period_s):
            continue
        kept = usual / (usual + variance)
        likely = np.log(OFTEN) + 0.5 * (np.log(variance / (usual + variance)) + kept * off**2 / variance)
        share = float(np.exp(likely - np.logaddexp(likely, np.logaddexp(0.0, bent))))
        doubts_s.append(float(abs(moved) * np.sqrt(share * ((kept * off) ** 2 + kept * variance))))
    return max(doubts_s)
