"""How certain the times of a robust fit are: sandwich estimates, which hold where neighbouring frames err together."""

from typing import NamedTuple

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.normal_equations import projected, solved
from psvideo.sync.rowfit.profiles import Profiles

LEAST_STEEP = -0.1
"""Cauchy's pull falls where residuals are large; this share of that counts, lest a few rule a short clip's errors."""
LAG = 3
"""Residuals of frames so far apart may still err together (a subject that moves): Newey and West 1987."""
CLUSTER, LEAST_CLUSTERS = 12, 8
"""Or whole stretches of frames err together; that needs this many of them to be seen."""
LEAST_LEFT = 4
"""So many more places of a flash than there are unknowns must be seen, to tell what residuals at each share."""
CLEARLY_MORE = 1.6
"""And the error must be as many times larger then: noise alone makes two estimates of it differ by half."""


class Believable(NamedTuple):
    """The ``covariance`` of the unknowns, and ``alike_s``, the standard error of the flashes' times where residuals err
    alike at the same places of flashes by clearly more than they do in frames near one another, else 0."""

    covariance: Doubles
    alike_s: float


def believable(
    plan: Plan, rows: Profiles, beat: Beat, weight: Doubles, trust: Doubles, basis: Doubles, known: Doubles
) -> Believable:
    """Return how certain the unknowns are at the end of a robust fit.

    ``weight`` is each sample's, ``trust`` (0 to 1) the part of it that is owed to its residual: a residual whose trust
    falls as it grows pulls less than its weight says (Huber 1981, section 7.6).
    """
    steepness = weight * np.maximum(2.0 * trust - 1.0, LEAST_STEEP)
    found = projected(plan, rows, beat, weight, basis, tails=True, steepness=steepness)
    covariance = sandwich(found.hessian, found.scores, known)
    knots, common = np.split(basis, [len(rows.window_start) + 1])
    unknowns = 2 + int(common.any(axis=0).sum())
    opening, closing = np.split(found.at_place[1:], 2)
    kinds = (found.at_place[1:], opening + closing)
    alike_s = max(mean_error(knots, _alike(found.hessian, one, known, unknowns=unknowns)) for one in kinds)
    return Believable(covariance, alike_s if alike_s > CLEARLY_MORE * mean_error(knots, covariance) else 0.0)


def _alike(hessian: Doubles, at_place: Doubles, known: Doubles, *, unknowns: int) -> Doubles:
    """Return the covariance of the unknowns if residuals err alike wherever rows open or close at the same place of a
    flash, as where edges are compressed; 0 where rows do so at few places. Of ``unknowns``, a clock's bends count as
    none: places are spread over the whole clip."""
    seen = at_place[at_place.any(axis=1)]
    left = len(seen) - unknowns
    if left < LEAST_LEFT:
        return np.zeros_like(known)
    bread = solved(hessian + known, np.eye(len(known)))
    covariance: Doubles = bread @ (seen.T @ seen) @ bread * len(seen) / left
    return covariance


def sandwich(hessian: Doubles, scores: Doubles, known: Doubles) -> Doubles:
    """Return the covariance of the unknowns, true also where frames near one another err together.

    Of several estimates, each right under other correlations, the one that claims least certainty is taken.
    """
    bread = solved(hessian + known, np.eye(len(known)))
    filling = scores.T @ scores
    for lag in range(1, min(LAG, len(scores) - 1) + 1):
        cross = scores[lag:].T @ scores[:-lag]
        filling = filling + (1 - lag / (LAG + 1)) * (cross + cross.T)
    fillings = [filling, scores.T @ scores]
    if len(scores) >= LEAST_CLUSTERS * CLUSTER:
        apart = np.add.reduceat(scores, np.arange(0, len(scores), CLUSTER), axis=0)
        fillings.append(apart.T @ apart * len(apart) / max(len(apart) - 2, 1))
    errors = [bread @ one @ bread for one in fillings]
    return max(errors, key=lambda covariance: float(covariance[0, 0]))


def mean_error(knots: Doubles, covariance: Doubles) -> float:
    """Return the root of the mean variance over the knots."""
    return float(np.sqrt(max(np.mean(np.einsum("ka,ab,kb->k", knots, covariance, knots)), 0.0)))


def freedom(plan: Plan, rows: Profiles, beat: Beat) -> float:
    """Return which share of the residuals' squares brightnesses that are fitted to them leave (MacKinnon, White 1985).

    Not less than one frame's share, which a clip that has as many brightnesses as frames does not even have.
    """
    frames = len(rows.value)
    fitted = len(rows.window_start) * (len(plan.lit_slots) + 1 + 2 * len(beat.beat_hz))
    return max(frames - fitted, 1) / frames


def standard_error_of(variance: float) -> float:
    """Return the root of a variance, infinite where rounding left it below 0: rows do not determine it."""
    return float(np.sqrt(variance)) if variance >= 0 else float("inf")
