"""Which time would explain most of what a fit leaves if it were free, without fitting it: a score test."""

import numpy as np

from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.normal_equations import projected, solved
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import CAUCHY, WIDE_SCALE, Fit, errors_of_residuals, prior, straight_basis, units_of


def clearest(
    plan: Plan, rows: Profiles, fit: Fit, free: tuple[str, ...], names: tuple[str, ...], *, at_least: float
) -> str | None:
    """Return the time that would explain most if it were free (a score test), or None where none explains enough."""
    for share in (WIDE_SCALE, 0.0) if names else ():
        gains = _gains(plan, rows, fit, free, names, share=share, at_least=at_least)
        if gains:
            return max(gains, key=lambda name: gains[name])
    return None


def _gains(
    plan: Plan,
    rows: Profiles,
    fit: Fit,
    free: tuple[str, ...],
    names: tuple[str, ...],
    *,
    share: float,
    at_least: float,
) -> dict[str, float]:
    """Return what the times would explain that explain enough; residuals count up to a share of their row's spread."""
    every = (*free, *names)
    scale = errors_of_residuals(rows, fit.rest, share)
    weight = 1.0 / (1.0 + (fit.rest / (CAUCHY * scale)) ** 2) / scale**2
    _, hessian, scores, _ = projected(plan, rows, fit.beat, weight, straight_basis(rows, every), tails=True)
    gains: dict[str, float] = {}
    for name in names:
        kept = [*range(2 + len(free)), 2 + every.index(name)]
        part, pulls = hessian[np.ix_(kept, kept)], scores[:, kept]
        known = prior(units_of(plan, rows, (*free, name)), (*free, name))
        move = solved(part + known, pulls.sum(axis=0))
        gain = float(move @ part @ move)
        if gain > at_least and _may_move(rows, fit.beat, name, float(move[-1])):
            gains[name] = gain
    return gains


def _may_move(rows: Profiles, beat: Beat, name: str, move: float) -> bool:
    """Return whether a time has room to move: tails are not negative, exposures not longer than the frame."""
    if move < 0:
        return bool(getattr(beat, name) > 0)
    return name != "exposure_s" or beat.exposure_s < rows.period_s * (1 - 1e-9)
