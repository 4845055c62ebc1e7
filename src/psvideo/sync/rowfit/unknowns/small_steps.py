"""What small steps from a fit would explain: of the clock, of exposure and row time, and of the transfer curve.

All are fitted together, as linear changes of what the rows show, each in variances that it explains.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from psvideo.model.arrays import Doubles, Integers
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.compiled_profiles import unexplained
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import EDGES, Fit

SIMPLER = 5.0
"""Variances that another shape of the curve must explain to be worth its being free."""
PROBE = 1e-3
"""Share of the shortest flash by which times are moved, to see what that changes."""
FAINT = 1e-4
"""Below this share of saturation a power is not followed: its logarithm has no end."""
SAME = 1e-10
"""Steps that differ by less than this share of themselves are the same one."""


def power(light: Doubles) -> Doubles:
    """Return how light changes with the power to which it is raised."""
    return light * np.log(np.maximum(np.abs(light), FAINT))


def compression(light: Doubles) -> Doubles:
    """Return how light changes that a sensor compresses evenly up to saturation."""
    return light * (np.abs(light) - 1.0)


SHAPES: tuple[Callable[[Doubles], Doubles], ...] = (power, compression)
SHIFT, EXPOSURE, ROW_TIME, FIRST_SHAPE, OTHERS = 0, 2, 3, 4, 4 + len(SHAPES)
"""Places of the steps: shift and slope of the clock, exposure, row time, the shapes, and other times that are free."""
SETS = ((FIRST_SHAPE,), (FIRST_SHAPE + 1,), (FIRST_SHAPE, FIRST_SHAPE + 1))


@dataclass(frozen=True, kw_only=True)
class StepTaken:
    """What small steps explain, in variances, the steps (step,), and the variance of the common shift."""

    gain: float
    by: Doubles
    variance: float


@dataclass(frozen=True, kw_only=True)
class SmallSteps:
    """The normal equations of small steps from a fit; ``always`` are the places of those that are free anyway."""

    matrix: Doubles
    pull: Doubles
    always: tuple[int, ...]

    def taken(self, more: Sequence[int]) -> StepTaken:
        """Return the best steps of the times that are free anyway, and of ``more``."""
        kept = np.array([*self.always, *more])
        inverse = self._inverse(kept)
        by = np.zeros(len(self.pull))
        by[kept] = inverse @ self.pull[kept]
        return StepTaken(gain=float(by @ self.pull), by=by, variance=float(inverse[0, 0]))

    def beside(self, place: int) -> tuple[float, float, float]:
        """Return the step of one more time, its variance, and by how much all flashes move with it."""
        kept, own = np.array(self.always), float(self.matrix[place, place])
        along = self._inverse(kept) @ self.matrix[kept, place]
        stiff = max(float(own - self.matrix[place, kept] @ along), SAME * own, 1e-300)
        return float(self.pull[place] - self.pull[kept] @ along) / stiff, 1.0 / stiff, -float(along[SHIFT])

    def _inverse(self, kept: Integers) -> Doubles:
        unit = 1.0 / np.sqrt(np.maximum(np.diag(self.matrix)[kept], 1e-300))
        scale = np.outer(unit, unit)
        return np.asarray(np.linalg.pinv(self.matrix[np.ix_(kept, kept)] * scale, rcond=SAME, hermitian=True) * scale)

    def best(self, more: Sequence[int]) -> StepTaken:
        """Return the best steps with a curve as well, of the fewest shapes that explain as much."""
        taken = [(self.taken([*more, *shapes]), len(shapes)) for shapes in SETS]
        return max(taken, key=lambda one: one[0].gain - SIMPLER * one[1])[0]


def small_steps(plan: Plan, rows: Profiles, fit: Fit, free: tuple[str, ...]) -> SmallSteps:
    """Return what small steps from a fit would explain, whose ``free`` times are free anyway."""
    trust = np.sqrt(fit.weight)
    changes = np.array([(trust * one).ravel() for one in _changes(plan, rows, fit, free)])
    always = (0, 1, *([ROW_TIME] if "row_time_s" in free else []), *range(OTHERS, len(changes)))
    return SmallSteps(matrix=changes @ changes.T, pull=-changes @ (trust * fit.rest).ravel(), always=always)


def _changes(plan: Plan, rows: Profiles, fit: Fit, free: tuple[str, ...]) -> list[Doubles]:
    """Return what each step adds to the residuals (frame, row), brightnesses being fitted again."""
    beat, clock = fit.beat, fit.beat.clock
    step_s = PROBE * plan.shortest_flash_s
    pivot_s, span_s = float(rows.frame_start_s.mean()), max(float(np.ptp(rows.frame_start_s)), rows.period_s)

    def change(moved: Callable[[float], Beat], by: float) -> Doubles:
        after, before = (unexplained(plan, rows, moved(one), fit.weight) for one in (by, -by))
        return (after - before) / (2.0 * by)

    def other(name: str) -> Doubles:
        by = step_s / max(float(rows.place.max()), 1.0) if name == "row_time_s" else step_s
        value = getattr(beat, name)
        least = by if name in EDGES else 0.0  # tails are not negative
        return change(lambda more: replace(beat, **{name: max(value, least) + more}), by)

    bent = shapes_added(plan, rows, fit)
    return [
        change(lambda more: replace(beat, clock=clock.shifted(more, 0.0, pivot_s=pivot_s)), step_s),
        change(lambda more: replace(beat, clock=clock.shifted(0.0, 1e6 * more / span_s, pivot_s=pivot_s)), step_s),
        other("exposure_s"),
        other("row_time_s") if beat.row_time_s > 0.0 else np.zeros_like(fit.rest),
        *(unexplained(plan, replace(rows, value=one), beat, fit.weight) for one in bent),
        *(other(name) for name in free if name not in {"exposure_s", "row_time_s"}),
    ]


def shapes_added(plan: Plan, rows: Profiles, fit: Fit) -> list[Doubles]:
    """Return what each shape of the curve adds to the light (frame, row) that the fit predicts."""
    light = rows.value - unexplained(plan, replace(rows, restless=None), fit.beat, fit.weight)
    return [shape(light) for shape in SHAPES]
