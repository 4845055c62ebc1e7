"""Edges in the picture that are softer than the plan's: times that are otherwise, or rows that compression blurs.

A time that truly is otherwise (LEDs that rise and fall slowly, another exposure) leaves no more at the flashes' edges
than elsewhere once it is right. Compression and scaling blur edges too, but not in the way of any time: a fit that
takes them for one removes a small part of what the edges leave (``bench/compression.py`` measures how much).
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.compiled_profiles import brightnesses, predictions, unexplained
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import CAUCHY, Fit, errors_of_residuals, robust_loss

NEAR_ROWS = 1.0
"""Samples that tails of this many rows would change lie at an edge,"""
CHANGED = 0.02
"""where they would change by more than this share of what the row sees at most."""
BELIEVED = 0.4
"""A time is believed where it takes away this share of what the edges leave: H.264 at any rate feigned 0.25 at most,
tails and exposures gave 0.98 to 1.02 uncompressed, and through H.264 0.3 to 0.8."""
FEIGNED = 0.25
"""Tails that take away less than this may be compression's: tails of less than a row through H.264 gave 0.06 to 0.22,
longer ones 0.25 and more."""
BLURRED = 0.05
"""Edges that are blurred put the times in doubt by this share of how soft they are: 19 encodes whose blur was not worth
freeing anything were off by 0.01 to 0.08 of it, 0.04 on an average."""
SOFT_ROWS, SOFT = (0.1, 0.2, 0.4, 0.8, 1.6), 3.0
"""How soft edges are is tried in these steps; the best one must take away this share of the robust loss."""
REACHES_ROWS = 3.0
"""A blur reaches this many rows: what differs by more is no blur."""
OUTLIER = 6.0
"""Residuals count as no more standard deviations than this."""
CHANCE = 2.0
"""Standard errors by which noise alone may make edges differ from what is elsewhere."""
FEW = 50
"""Fewer samples at edges, or elsewhere, say nothing."""


def at_edges(plan: Plan, rows: Profiles, beat: Beat) -> NDArray[np.bool_]:
    """Return which samples (frame, row) soft edges would change."""
    brightness = brightnesses(plan, rows.one_window(), beat)
    plain = predictions(plan, rows, beat, brightness)
    more_s = NEAR_ROWS * (beat.row_time_s or rows.period_s / len(rows.place))
    softer = replace(beat, rise_s=beat.rise_s + more_s, fall_s=beat.fall_s + more_s)
    change = np.abs(predictions(plan, rows, softer, brightness) - plain)
    near: NDArray[np.bool_] = change > CHANGED * np.ptp(plain, axis=0)
    return near


def blurred_s(plan: Plan, rows: Profiles, fit: Fit) -> float:
    """Return how soft edges are beyond the fit's, as a rise and a fall that are as long; 0 where they are not."""
    losses = {0.0: robust_loss(rows, fit.rest, fit.rest) - SOFT}
    for rows_soft in SOFT_ROWS if fit.beat.row_time_s > 0 else ():
        more_s = rows_soft * fit.beat.row_time_s
        beat = fit.beat.with_phase(fit.beat.clock.phase_s - more_s)
        beat = replace(beat, rise_s=beat.rise_s + more_s, fall_s=beat.fall_s + more_s)
        losses[more_s] = robust_loss(rows, unexplained(plan, rows, beat, fit.weight), fit.rest)
    return min(losses, key=lambda more_s: losses[more_s])


def plausible(plan: Plan, beat: Beat) -> bool:
    """Return whether a beat's tails are tails: no longer than the shortest flash, unless the plan says so."""
    longest_s = max(plan.shortest_flash_s, plan.rise_s, plan.fall_s)
    return max(beat.rise_s, beat.fall_s) <= longest_s


def cleared(plan: Plan, rows: Profiles, before: Fit, after: Fit) -> float:
    """Return which share of what one fit leaves at edges, beyond what is left elsewhere, another fit takes away."""
    edges = at_edges(plan, rows, before.beat) | at_edges(plan, rows, after.beat)
    if min(edges.sum(), (~edges).sum()) < FEW:
        return 1.0
    scale = CAUCHY * errors_of_residuals(rows, before.rest, 0.0)
    first, last = (np.log1p((rest / scale) ** 2) for rest in (before.rest, after.rest))
    excess = float(first[edges].mean() - last[~edges].mean())
    gain = float(first[edges].mean() - last[edges].mean())
    chance = CHANCE * float(np.sqrt(last[edges].var() / edges.sum() + last[~edges].var() / (~edges).sum()))
    return 1.0 if excess <= gain + chance else max(gain / excess, 0.0)


def within_blur(rows: Profiles, one: Beat, other: Beat) -> bool:
    """Report whether two shutters differ by so little that a blur could be taken for the difference."""
    exposure_s = abs(other.exposure_s - one.exposure_s)
    readout_s = abs(other.row_time_s - one.row_time_s) * float(rows.place.max())
    return max(exposure_s, readout_s) < REACHES_ROWS * one.row_time_s


def misfit(plan: Plan, rows: Profiles, fit: Fit) -> float:
    """Return how many times larger residuals at edges are than elsewhere, 1 or more."""
    edges = at_edges(plan, rows, fit.beat)
    if min(edges.sum(), (~edges).sum()) < FEW:
        return 1.0
    squares: Doubles = np.minimum((fit.rest / errors_of_residuals(rows, fit.rest, 0.0)) ** 2, OUTLIER**2)
    return max(float(np.sqrt(squares[edges].mean() / max(squares[~edges].mean(), 1e-30))), 1.0)
