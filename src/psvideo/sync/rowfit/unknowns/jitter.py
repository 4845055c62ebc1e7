"""What a smooth clock leaves: flashes that each come a little early or late.

Rows that open during a flash and rows that close during it show its time independently of one another. What both say
alike is jitter, what they say differently is noise; so jitter is believed, and noise shrunk away, without a model of
either (empirical Bayes).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.coarse.seed import gain_of
from psvideo.sync.rowfit.compiled_profiles import compiled_flashes, compiled_rows
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import Fit, errors_of_residuals
from psvideo.sync.rowfit.row_model import Flashes, places
from psvideo.sync.rowfit.unknowns.edge_pulls import moved_flashes, pulls

LEAST_FLASHES = 8
"""Of fewer flashes nothing is said."""
SURE = 5.0
"""Standard deviations of Fisher's z (1921) by which openings and closings must agree before flashes are moved."""
FEW, LIKELY = 0.5, 2.5
"""Where so small a share of the flashes has both, as below 360 degrees, these few need agree by this much only, if even
and odd rows agree as well."""
ALIKE = 1 - 1e-9
"""A likeness of 1 would be infinitely sure."""
ROUNDS = 4
"""Flashes are moved, and looked at again where they then are: brightnesses had taken up some of what they strayed."""
ENOUGH = 0.1
"""A flash is timed where rows show it by more than this share of what is usual."""
OUTLIER = 6.0
"""Flashes stray by no more standard deviations than this, as the others show them."""
STILL = 0.9
"""Where the first rows to see a flash are not those that see it last, even and odd rows are held against one another,
if the subject stands still: a fit takes away this share of the robust loss. Else brightness would pass for jitter."""
ROWS_OVER, ALONE_OVER, ALIKE_ROWS = 20.0, 1.0, 0.1
"""What such rows agree on must be so many times what parts them, as variances: compression makes neighbours alike.
Where neighbouring rows that no edge touches err alike by no more than the third (a correlation), the second does."""
LEAST_ROWS = 400
"""Fewer pairs of neighbouring rows do not show whether they err alike."""


@dataclass(frozen=True, kw_only=True)
class Jitter:
    """By how much each flash comes late, ``late_s`` (flash,), by its start ``start_s``; ``error_s`` is each one's.

    ``mean_error_s`` is the standard error of what all have in common.
    """

    start_s: Doubles
    late_s: Doubles
    error_s: float
    mean_error_s: float = 0.0

    def of(self, start_s: Doubles) -> Doubles:
        """Return by how much the flashes that start at these times come late, same shape; 0 for others."""
        if not len(self.start_s):
            return np.zeros_like(start_s)
        after = np.minimum(np.searchsorted(self.start_s, start_s), len(self.start_s) - 1)
        before = np.maximum(after - 1, 0)
        nearest = np.where(start_s - self.start_s[before] < self.start_s[after] - start_s, before, after)
        same = np.abs(self.start_s[nearest] - start_s) < 1e-7
        late_s: Doubles = np.where(same, self.late_s[nearest], 0.0)
        return late_s


STEADY = Jitter(start_s=np.empty(0), late_s=np.empty(0), error_s=0.0)


def jitter(plan: Plan, rows: Profiles, fit: Fit) -> Jitter:
    """Return how single flashes stray from the clock; none at all where what the rows say does not agree on it."""
    flashes = compiled_flashes(plan, rows, fit.beat)
    late_s = np.zeros(len(flashes.start_s))
    straying = _straying(rows, fit, flashes)
    if straying is None:
        return STEADY
    spread_s, noise = straying
    for _ in range(ROUNDS):
        pull, stiff = (two.sum(axis=1) for two in pulls(rows, fit, moved_flashes(flashes, late_s)))
        timed = stiff > ENOUGH * float(np.median(stiff[stiff > 0]))
        seen_s = late_s[timed] + pull[timed] / stiff[timed]
        mean_s = float(np.median(seen_s))
        variance = noise / stiff[timed]
        share = spread_s**2 / (spread_s**2 + variance)
        late_s = np.full(len(late_s), mean_s)
        late_s[timed] += share * np.clip(seen_s - mean_s, -OUTLIER * spread_s, OUTLIER * spread_s)
    inside = (flashes.start_s > rows.frame_start_s[0]) & (flashes.start_s < rows.frame_start_s[-1])
    left = np.full(len(late_s), spread_s**2)
    left[timed] = share * variance
    return Jitter(
        start_s=flashes.start_s,
        late_s=late_s,
        error_s=float(np.sqrt(left[inside].mean())),
        mean_error_s=float(np.sqrt(noise / stiff[timed].sum())),
    )


def _straying(rows: Profiles, fit: Fit, flashes: Flashes) -> tuple[float, float] | None:
    """Return by how much flashes stray, and a pull's noise: its variance over its stiffness; None where none do."""
    pull, stiff = pulls(rows, fit, flashes)
    both = _timed(stiff)
    if both.sum() >= LEAST_FLASHES:
        found = _agreed(pull, stiff, over=1.0)
        few = both.sum() < FEW * (stiff > 0).any(axis=1).sum()
        if found is not None or not few or _agreed(pull, stiff, over=1.0, sure=LIKELY) is None:
            return found
    if gain_of(rows, fit.rest) < STILL:
        return None
    over = ROWS_OVER if _likeness_of_rows(rows, fit, flashes) > ALIKE_ROWS else ALONE_OVER
    return _agreed(*_halves(rows, fit, flashes), over=over)


def maybe_astray_s(plan: Plan, rows: Profiles, fit: Fit) -> float:
    """Return by how much flashes that are not followed may stray one by one, as far as rows that err apart show it."""
    flashes = compiled_flashes(plan, rows, fit.beat)
    if gain_of(rows, fit.rest) < STILL or _likeness_of_rows(rows, fit, flashes) > ALIKE_ROWS:
        return 0.0
    straying = _agreed(*_halves(rows, fit, flashes), over=0.0, sure=LIKELY)
    return 0.0 if straying is None else straying[0]


def _halves(rows: Profiles, fit: Fit, flashes: Flashes) -> tuple[Doubles, Doubles]:
    """Return how strongly even and odd rows shift each flash, shape (flash, 2) twice, as ``pulls`` does."""
    halves = [pulls(rows.only_rows(half), fit, flashes, half) for half in (slice(0, None, 2), slice(1, None, 2))]
    pull, stiff = (np.stack([half[n].sum(axis=1) for half in halves], axis=1) for n in (0, 1))
    return pull, stiff


def _likeness_of_rows(rows: Profiles, fit: Fit, flashes: Flashes) -> float:
    """Return the correlation of what neighbouring rows leave unexplained where neither opens or closes in a flash."""
    place = np.empty(fit.rest.shape, np.int64)
    places(compiled_rows(rows, fit.beat), flashes, place)
    rest = fit.rest / errors_of_residuals(rows, fit.rest, 0.0)
    both = ((place[:, 1:] == 0) & (place[:, :-1] == 0)).ravel()
    if both.sum() < LEAST_ROWS:
        return 1.0
    one, next_one = (np.clip(part.ravel()[both], -OUTLIER, OUTLIER) for part in (rest[:, :-1], rest[:, 1:]))
    return float((one * next_one).mean() / max(float((one**2).mean() * (next_one**2).mean()) ** 0.5, 1e-30))


def _timed(stiff: Doubles) -> NDArray[np.bool_]:
    """Return which flashes (flash,) both kinds of rows show, from stiffnesses (flash, 2)."""
    usual = np.array([np.median(one[one > 0]) if (one > 0).any() else np.inf for one in stiff.T])
    return np.asarray((stiff > ENOUGH * usual).all(axis=1), np.bool_)


def _agreed(pull: Doubles, stiff: Doubles, *, over: float, sure: float = SURE) -> tuple[float, float] | None:
    """Return by how much flashes stray and the noise, as two kinds of rows (flash, 2) show both.

    None where they do not agree by ``sure`` standard deviations, or on no more than ``over`` times what noise makes of
    their mean, as variances.
    """
    timed = _timed(stiff)
    if timed.sum() < LEAST_FLASHES:
        return None
    apart = pull[timed] / stiff[timed]
    apart -= np.median(apart, axis=0)
    bound = OUTLIER * 1.4826 * float(np.median(np.abs(apart))) + 1e-15
    apart = np.clip(apart, -bound, bound)
    common, own = float((apart[:, 0] * apart[:, 1]).mean()), (apart**2).mean(axis=0)
    likeness = common / max(float(np.sqrt(own[0] * own[1])), 1e-30)
    by_noise = float(((apart[:, 0] - apart[:, 1]) ** 2).mean()) / 4
    if common < over * by_noise or np.arctanh(min(likeness, ALIKE)) * np.sqrt(len(apart) - 3) < sure:
        return None
    noise = float(((apart[:, 0] - apart[:, 1]) ** 2 / (1.0 / stiff[timed]).sum(axis=1)).mean())
    return float(np.sqrt(common)), noise
