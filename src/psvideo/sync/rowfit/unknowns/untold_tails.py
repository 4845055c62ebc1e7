"""How long LEDs' tails may be that neither the plan nor the picture shows: as long as rows make likely.

A rise and a fall that are alike move a flash and leave its length, so that short ones change nothing to the first
order: the error that a fit gives for them is that of a straight line, and may be far longer than rows allow.
"""

from dataclasses import replace

import numpy as np

from psvideo.model.plan import Plan
from psvideo.sync.rowfit.compiled_profiles import unexplained
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import CAUCHY, Fit, robust_loss

SHORTEST, LENGTHS = 1e-3, 25
"""The shortest ones that are tried, as a share of the shortest flash, which is the longest; each time as many times
longer, and as likely before rows are asked (Jeffreys 1939)."""
OUT_OF_QUESTION = 20.0
"""Tails that add so much to the robust loss end the search: longer ones add more."""


def untold_tails_s(plan: Plan, rows: Profiles, fit: Fit) -> float:
    """Return the root of the mean square of how long tails may be beyond the fit's, if there are any, by how likely
    rows are under each; flashes start as much earlier under them."""
    lengths_s = np.geomspace(SHORTEST, 1.0, LENGTHS) * plan.shortest_flash_s
    plain = robust_loss(rows, unexplained(plan, rows, fit.beat, fit.weight), fit.rest)
    likely = np.zeros(LENGTHS)
    for n, tail_s in enumerate(lengths_s.tolist()):
        beat = fit.beat.with_phase(fit.beat.clock.phase_s - tail_s)
        beat = replace(beat, rise_s=beat.rise_s + tail_s, fall_s=beat.fall_s + tail_s)
        more = robust_loss(rows, unexplained(plan, rows, beat, fit.weight), fit.rest) - plain
        if more > OUT_OF_QUESTION:
            break
        likely[n] = np.exp(-0.5 * CAUCHY**2 * max(more, -OUT_OF_QUESTION))  # Cauchy's loss of small residuals
    return float(np.sqrt((likely * lengths_s**2).sum() / max(likely.sum(), 1e-30)))
