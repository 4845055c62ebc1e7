"""How long LEDs' tails may be that the plan does not tell and the picture hardly shows: as long as rows make likely.

A rise and a fall that are alike move a flash and leave its length, so that short ones change nothing to the first
order: the error that a fit gives for them is that of a straight line, and may be far longer than rows allow, or far
shorter.
"""

from dataclasses import replace

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.compiled_profiles import unexplained
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import CAUCHY, Fit, errors_of_residuals, row_noise
from psvideo.sync.rowfit.unknowns.softness import misfit

SHORTEST, LENGTHS = 1e-3, 25
"""The shortest ones that are tried, as a share of the shortest flash, which is the longest; each time as many times
longer, and as likely before rows are asked (Jeffreys 1939)."""
FINEST = 0.1
"""Around tails that were found, the first step is this share of their times' standard error."""
OUT_OF_QUESTION = 20.0
"""Tails that add so much to the robust loss end the search: longer ones add more."""
HINTED, SHOWN = 1.0, 3.0
"""Rows hint at tails that take away this much of the robust loss, 2.4 standard deviations of noise, and show those that
take away this much (from 0.3, five of 31 clips of sharp LEDs claimed 15 to 40 times more, from 1 one does),"""
NO_BLUR = 0.5
"""unless a blur takes away more than this share of it: 0 to 0.3 in uncompressed clips with tails of 0.05 to 0.3 row,
0.8 to 1.6 through H.264, with tails or without (one of 22: 0.1, with tails)."""


def untold_tails_s(plan: Plan, rows: Profiles, fit: Fit) -> float:
    """Return the root of the mean square of how long tails may be beyond the fit's, if there are any, by how likely
    rows are under each; flashes start as much earlier under them."""
    lengths_s, more = _tried(plan, rows, fit, errors_of_residuals(rows, fit.rest, 0.0))
    return _likely_length_s(lengths_s, np.maximum(more, -OUT_OF_QUESTION))


def hinted_tails_s(plan: Plan, rows: Profiles, fit: Fit) -> float:
    """Return as ``untold_tails_s`` where nothing moves and rows hint at tails that they do not show, else 0; nor where
    they show a blur."""
    errors = _own_errors(plan, rows, fit)
    lengths_s, more = _tried(plan, rows, fit, errors)
    hinted = -SHOWN < more.min() < -HINTED and _by_blur(plan, rows, fit, errors, lengths_s) > -SHOWN
    return _likely_length_s(lengths_s, more) if hinted else 0.0


def open_tails_s(plan: Plan, rows: Profiles, fit: Fit) -> float:
    """Return by how much tails that were found may be longer or shorter, rise and fall alike, as a root mean square by
    how likely rows are under each: of short ones their own error knows too little."""
    errors, flash_s = _own_errors(plan, rows, fit), plan.shortest_flash_s
    first_s = float(np.clip(FINEST * fit.shift_error_s, FINEST * SHORTEST**2 * flash_s, SHORTEST * flash_s))
    apart_s = np.geomspace(first_s, flash_s, LENGTHS)
    added = np.append(_added(plan, rows, fit, errors, apart_s), _added(plan, rows, fit, errors, -apart_s))
    apart_s = np.append(apart_s, apart_s)
    likely = apart_s * np.exp(-0.5 * CAUCHY**2 * (added - min(float(added.min()), 0.0)))  # steps grow with lengths
    return float(np.sqrt((likely * apart_s**2).sum() / max(likely.sum(), 1e-30)))


def shows_tails(plan: Plan, rows: Profiles, fit: Fit) -> bool:
    """Return whether rows that stand still show tails beyond the fit's that are no blur of the rows."""
    errors = _own_errors(plan, rows, fit)
    lengths_s, more = _tried(plan, rows, fit, errors)
    least = float(more.min())
    return least < -SHOWN and _by_blur(plan, rows, fit, errors, lengths_s[more < 0.0]) > NO_BLUR * least


def _by_blur(plan: Plan, rows: Profiles, fit: Fit, errors: Doubles, lengths_s: Doubles) -> float:
    """Return what the best of blurs of the rows, as long as tails are tried, adds to the robust loss."""
    plain = _loss(fit.rest, errors)
    blurred = (unexplained(plan, rows, replace(fit.beat, blur_s=s), fit.weight) for s in lengths_s.tolist())
    return min(_loss(rest, errors) - plain for rest in blurred)


def _own_errors(plan: Plan, rows: Profiles, fit: Fit) -> Doubles:
    """Return how far residuals may be off (frame, row) by rows' own noise, as large as it is at flashes' edges, however
    small a share of the light."""
    doubt = 0.0 if rows.doubt is None else rows.doubt
    errors: Doubles = misfit(plan, rows, fit) * np.hypot(row_noise(fit.rest), doubt)
    return errors


def _likely_length_s(lengths_s: Doubles, more: Doubles) -> float:
    """Return the root of the mean square of tails of some lengths (length,) by what each adds to the robust loss."""
    likely = np.exp(-0.5 * CAUCHY**2 * more)  # Cauchy's loss of small residuals
    return float(np.sqrt((likely * lengths_s**2).sum() / max(likely.sum(), 1e-30)))


def _tried(plan: Plan, rows: Profiles, fit: Fit, errors: Doubles) -> tuple[Doubles, Doubles]:
    """Return lengths of tails beyond the fit's (length,), and what each adds to the robust loss (length,)."""
    lengths_s = np.geomspace(SHORTEST, 1.0, LENGTHS) * plan.shortest_flash_s
    return lengths_s, _added(plan, rows, fit, errors, lengths_s)


def _added(plan: Plan, rows: Profiles, fit: Fit, errors: Doubles, longer_s: Doubles) -> Doubles:
    """Return what tails that are longer than the fit's by so much (length,), or shorter, add to the robust loss of
    residuals that are off by some errors; infinite beyond those that are out of the question."""
    plain, added = _loss(fit.rest, errors), np.full(len(longer_s), np.inf)
    least_s = -min(fit.beat.rise_s, fit.beat.fall_s)
    for n, tail_s in enumerate(longer_s.tolist()):
        if tail_s < least_s:
            break
        more = _loss(unexplained(plan, rows, with_tails(fit.beat, tail_s), fit.weight), errors) - plain
        if more > OUT_OF_QUESTION:
            break
        added[n] = more
    return added


def with_tails(beat: Beat, tail_s: float) -> Beat:
    """Return a beat whose flashes rise and fall more slowly, and start as much earlier: as rows see it, they are where
    they were."""
    earlier = beat.with_phase(beat.clock.phase_s - tail_s)
    return replace(earlier, rise_s=beat.rise_s + tail_s, fall_s=beat.fall_s + tail_s)


def _loss(rest: Doubles, errors: Doubles) -> float:
    return float(np.log1p((rest / (CAUCHY * errors)) ** 2).sum())
