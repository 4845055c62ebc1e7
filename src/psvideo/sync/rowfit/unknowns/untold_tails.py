"""How long LEDs' tails may be that neither the plan nor the picture shows: as long as rows make likely.

A rise and a fall that are alike move a flash and leave its length, so that short ones change nothing to the first
order: the error that a fit gives for them is that of a straight line, and may be far longer than rows allow, or far
shorter. Rows that open or close as a flash begins or ends show how long they can be, also where nothing moves.
"""

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.compiled_profiles import unexplained
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import CAUCHY, Fit, row_noise
from psvideo.sync.rowfit.shared_tails import OUT_OF_QUESTION, shared_tails, with_tails
from psvideo.sync.rowfit.unknowns.softness import misfit

SHORTEST, LENGTHS = 1e-3, 19
"""The shortest ones that are tried, as a share of the shortest flash, which is the longest; each time as many times
longer, and as likely before rows are asked (Jeffreys 1939)."""
HINTED = 0.3
"""What tails must take away of the robust loss to be hinted at: 1.3 standard deviations of noise."""


def untold_tails_s(plan: Plan, rows: Profiles, fit: Fit, *, moves: bool) -> float:
    """Return the root of the mean square of how long tails may be beyond the fit's, if there are any, by how likely
    rows are under each; flashes start as much earlier under them. Where nothing ``moves``, 0 unless rows hint at some.
    """
    lengths_s, more = tails_tried(plan, rows, fit)
    if not moves and more.min() > -HINTED:
        return 0.0
    if rows.restless is not None:  # what moves hides tails from a fit, and not from frames that share a flash
        more = np.maximum(more, shared_tails(plan, rows, fit.beat, lengths_s))
    return likely_length_s(lengths_s, more)


def likely_length_s(lengths_s: Doubles, more: Doubles) -> float:
    """Return the root of the mean square of tails of some lengths (length,) by what each adds to the robust loss."""
    likely = np.exp(-0.5 * CAUCHY**2 * (more - float(more.min())))  # Cauchy's loss of small residuals
    return float(np.sqrt((likely * lengths_s**2).sum() / likely.sum()))


def lengths_tried_s(plan: Plan) -> Doubles:
    """Return the lengths of tails that are tried."""
    lengths_s: Doubles = np.geomspace(SHORTEST, 1.0, LENGTHS) * plan.shortest_flash_s
    return lengths_s


def tails_tried(plan: Plan, rows: Profiles, fit: Fit) -> tuple[Doubles, Doubles]:
    """Return lengths of tails beyond the fit's (length,), and what each adds to the robust loss (length,), infinite
    beyond those that are out of the question.

    Residuals count by their own noise, as large as they are at flashes' edges, however small a share of the light.
    """
    doubt = 0.0 if rows.doubt is None else rows.doubt
    scale = CAUCHY * misfit(plan, rows, fit) * np.hypot(row_noise(fit.rest), doubt)

    def loss(beat: Beat) -> float:
        return float(np.log1p((unexplained(plan, rows, beat, fit.weight) / scale) ** 2).sum())

    lengths_s, plain = lengths_tried_s(plan), loss(fit.beat)
    more = np.full(LENGTHS, np.inf)
    for n, tail_s in enumerate(lengths_s.tolist()):
        more[n] = loss(with_tails(fit.beat, tail_s)) - plain
        if more[n] > OUT_OF_QUESTION:
            break
    return lengths_s, more
