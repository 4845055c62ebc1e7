"""The latest frames held against what was to come: brightnesses are known from earlier frames, and none is fitted.

Frames that went missing leave the strobe where its clock has it. A strobe that was started again stands anywhere, and
of so many frames as may be missing some nearly explain it: near a flash's place is not at it.
"""

from dataclasses import dataclass, replace

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.compiled_profiles import brightnesses, predictions
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import CAUCHY, LAST_SCALE
from psvideo.sync.rowfit.tracking.losses import SUSPICIOUS, losses_of
from psvideo.sync.rowfit.tracking.steps_ahead import MOST as MOST_MISSING

STEPS, NUDGE, MOST = 4, 0.05, 0.3
"""Steps of the fit; the shift by which its slope is measured, and the longest step, as shares of the shortest flash."""
LIT = 0.03
"""Rows count that change by this share of what the most changing one does."""
NORMAL = 1.4826
"""A normal distribution's standard deviation in median absolute deviations."""
NOTHING = 1e-3
"""Frames that change by this share of what the strobe's light changes (ten stops less) show nothing of it, and what is
fitted to them explains it all."""
STEP_COST = 0.02
"""What every frame that is taken for missing costs, in mean losses of a frame: cycles may look alike."""


@dataclass(frozen=True, kw_only=True)
class Learnt:
    """The brightness of every row under every light, ``light``, as the ``frames`` gave it that a strobe was seen in.

    ``usual`` is what such a frame is usually predicted worse by than perfectly, as a loss.
    """

    plan: Plan
    light: Doubles
    frames: Profiles
    usual: float

    def losses(self, rows: Profiles, beat: Beat) -> Doubles:
        """Return how badly frames are foretold, (frame,), where flashes come as a beat says."""
        return losses_of(self.plan, self.frames, rows, beat, self.light)

    def are_odd(self, losses: Doubles) -> bool:
        """Return whether frames' losses are, on the whole, more than is usual."""
        return bool(losses.mean() >= self.usual + SUSPICIOUS)

    def show_nothing(self, rows: Profiles) -> bool:
        """Return whether rows hardly change, against what they did when brightnesses were learnt."""
        return float(rows.value.std(axis=0).max()) < NOTHING * float(self.frames.spread.max())

    def missing_before(self, rows: Profiles, beat: Beat, *, most: int = MOST_MISSING) -> int:
        """Return how many frames, at most so many, are missing before some that are odd, 0 where that explains
        nothing."""
        tried = [replace(rows, index=rows.index + extra) for extra in range(most + 1)]
        losses = np.array([self.losses(one, beat).mean() for one in tried])
        best = int((losses + STEP_COST * np.arange(len(losses))).argmin())
        return best if losses[best] < min(self.usual, losses[0] - SUSPICIOUS) + SUSPICIOUS else 0

    def late_by(self, rows: Profiles, beat: Beat) -> tuple[float, float]:
        """Return by how many seconds the flashes in ``rows`` come later than a beat says, and the standard error."""
        step_s, most_s = NUDGE * self.plan.shortest_flash_s, MOST * self.plan.shortest_flash_s
        shift_s, error_s, spread = 0.0, np.inf, self.frames.spread
        lit = spread > LIT * spread.max()
        for _ in range(STEPS):
            clocks = [beat.clock.shifted(shift_s + by_s, 0.0, pivot_s=0.0) for by_s in (-step_s, 0.0, step_s)]
            before, rest, after = (
                (rows.value - predictions(self.plan, rows, replace(beat, clock=one), self.light))[:, lit]
                for one in clocks
            )
            slope = (after - before) / (2 * step_s)
            scale = np.maximum(NORMAL * np.median(np.abs(rest)), LAST_SCALE * spread[lit])
            weight = 1.0 / (1.0 + (rest / (CAUCHY * scale)) ** 2) / scale**2
            known = float((weight * slope**2).sum())
            if not known:
                return 0.0, np.inf
            shift_s -= float(np.clip((weight * slope * rest).sum() / known, -most_s, most_s))
            error_s = float(np.sqrt((weight**2 * slope**2 * rest**2).sum())) / known
        return shift_s, error_s


def learnt_from(plan: Plan, frames: Profiles, beat: Beat) -> Learnt:
    """Return the brightnesses that frames give where flashes come as a beat says."""
    light = brightnesses(plan, frames, beat)
    return Learnt(
        plan=plan, light=light, frames=frames, usual=float(np.median(losses_of(plan, frames, frames, beat, light)))
    )
