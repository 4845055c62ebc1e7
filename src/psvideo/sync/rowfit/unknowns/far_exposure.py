"""An exposure that is off by more than a flash lasts, which no small step finds."""

from dataclasses import replace

import numpy as np

from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.compiled_profiles import unexplained
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import Fit, robust_loss
from psvideo.sync.rowfit.unknowns.likelier import BETTER, LEAST_GAIN

FARTHEST, STEPS = 0.06, 2
"""An exposure that is off by more than a flash lasts leaves rows far from where a flash is cut unexplained, so that no
small step finds it. It is looked for up to this share of it, in steps of the shortest flash over the second: farther
off, it is another shutter."""
PROBED_ROWS, PROBED_FRAMES = 60, 240
"""Rows and frames that it is looked for in."""


def far_exposure(plan: Plan, rows: Profiles, fit: Fit) -> Beat | None:
    """Return the fit's beat with an exposure that is off by more than flashes last, if one explains more; else None.

    Where the beginning of the exposure cuts flashes as the fit says, its end does not, or the reverse.
    """
    beat = fit.beat
    part = rows.take(slice(0, PROBED_FRAMES)).binned(PROBED_ROWS)
    known = unexplained(plan, part, beat)
    step_s = plan.shortest_flash_s / STEPS
    count = int(FARTHEST * beat.exposure_s / step_s)
    longer_s = np.minimum(step_s * np.arange(-count, count + 1), max(rows.period_s - beat.exposure_s, 0.0))
    tried = [
        replace(beat.with_phase(beat.clock.phase_s + moved_s), exposure_s=beat.exposure_s + s)
        for s in np.unique(longer_s[longer_s != 0.0]).tolist()
        for moved_s in (0.0, s)
    ]
    losses = [robust_loss(part, unexplained(plan, part, one), known) for one in tried]
    most = robust_loss(part, known, known)
    gained = most - min(losses, default=most) > max(BETTER * most, LEAST_GAIN)
    return tried[int(np.argmin(losses))] if gained else None
