"""How badly frames fit: their robust loss under brightnesses that are fitted to them, or known from frames around."""

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.coarse.search import ROBUST_STEEPNESS
from psvideo.sync.rowfit.compiled_profiles import predictions
from psvideo.sync.rowfit.profiles import Profiles

SUSPICIOUS = 0.25
"""A frame's loss by which it must exceed what is usual before other places in time are tried for it."""


def frame_losses(rows: Profiles, rest: Doubles) -> Doubles:
    """Return every frame's mean robust loss over the rows that change, shape (frame,)."""
    spread = rows.spread
    lit = spread > 0.03 * spread.max()
    losses: Doubles = np.log1p(ROBUST_STEEPNESS * (rest[:, lit] / spread[lit]) ** 2).mean(axis=1)
    return losses


def losses_of(plan: Plan, reference: Profiles, rows: Profiles, beat: Beat, light: Doubles) -> Doubles:
    """Return how badly known brightnesses predict frames, shape (frame,), on the scale of the reference's spreads."""
    rest = rows.value - predictions(plan, rows, beat, light)
    return frame_losses(reference, rest)
