"""A transfer curve that is a little wrong: half of a flash does not look half as bright as all of it.

Rows that open in a flash and rows that close in it then both seem to see more of it, or both less, as under another
exposure; freeing that would move all flashes by half of the difference. But another exposure changes what a row saw by
as much wherever in a flash it opens or closes, and a curve changes nothing where it saw almost all of it or none. So
both are fitted together, as small steps from a fit that is near.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from psvideo.model.arrays import Doubles, Integers
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.compiled_profiles import unexplained
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import EDGES, Fit, robust_loss
from psvideo.sync.rowfit.unknowns.bend import fitted, rms_apart_s
from psvideo.sync.rowfit.unknowns.misread import CLIPPED

CLEAR = 30.0
"""Variances that a curve, or an exposure, must explain beyond what the other one does, to be needed beside it."""
LIKELY = 9.0
"""Variances that an exposure or a readout must explain to put times in doubt, and a curve to be off still more."""
SIMPLER = 5.0
"""Variances that another shape of the curve must explain to be worth its being free."""
ROUNDS = 4
"""Steps are small ones: what is left is looked at again so often."""
MOST = 0.05
"""A curve that changes light by more than this share of the brightest is another curve."""
PROBE = 1e-3
"""Share of the shortest flash by which times are moved, to see what that changes."""
FAINT = 1e-4
"""Below this share of saturation a power is not followed: its logarithm has no end."""
NOMINAL, OFTEN, BENT = 0.003, 0.25, 0.02
"""Exposures and readouts are off from what plans say by about the first share of themselves, as those are that LED
stripes show, by odds of the second to one; the third are a curve's odds, unless so much clips that this looks bent."""
SAME = 1e-10
"""Steps that differ by less than this share of themselves are the same one."""


def power(light: Doubles) -> Doubles:
    """Return how light changes with the power to which it is raised."""
    return light * np.log(np.maximum(np.abs(light), FAINT))


def compression(light: Doubles) -> Doubles:
    """Return how light changes that a sensor compresses evenly up to saturation."""
    return light * (np.abs(light) - 1.0)


SHAPES: tuple[Callable[[Doubles], Doubles], ...] = (power, compression)
Curve = tuple[float, ...]
"""How much of each shape is to be added to light that was read, to be what fell on the sensor."""
SHIFT, EXPOSURE, ROW_TIME, FIRST_SHAPE, OTHERS = 0, 2, 3, 4, 4 + len(SHAPES)
"""Places of the steps: shift and slope of the clock, exposure, row time, the shapes, and other times that are free."""
SETS = ((FIRST_SHAPE,), (FIRST_SHAPE + 1,), (FIRST_SHAPE, FIRST_SHAPE + 1))


@dataclass(frozen=True, kw_only=True)
class Straightened:
    """Rows and their fit without the ``curves`` that were taken out of them, and by how much times are in doubt because
    curve and exposure are not told apart."""

    rows: Profiles
    fit: Fit
    curves: tuple[Curve, ...] = ()
    unsure_s: float = 0.0


def straight(rows: Profiles, curves: Sequence[Curve]) -> Profiles:
    """Return profiles with curves taken out, in order."""
    for curve in curves:
        more = sum((off * shape(rows.value) for off, shape in zip(curve, SHAPES, strict=True)), np.float64(0.0))
        rows = replace(rows, value=np.ascontiguousarray(rows.value + more))
    return rows


def straightened(plan: Plan, rows: Profiles, fit: Fit, free: tuple[str, ...]) -> Straightened:
    """Take the curve out of rows that clearly show it to be off, where another exposure does not explain them as well.

    ``free`` are the times that are free in ``fit``; where the exposure is one of them, so it stays.
    """
    curves: list[Curve] = []
    while True:
        steps = _steps(plan, rows, fit, free)
        curve, unsure_s = _curve(steps, held="exposure_s" not in free, surely=not curves)
        if not any(curve) or len(curves) == ROUNDS or not _likelier(plan, rows, fit, free, curve):
            return Straightened(rows=rows, fit=fit, curves=tuple(curves), unsure_s=unsure_s)
        rows = straight(rows, [curve])
        fit = fitted(plan, rows, fit.beat, free)
        curves.append(curve)


def _likelier(plan: Plan, rows: Profiles, fit: Fit, free: tuple[str, ...], curve: Curve) -> bool:
    """Return whether a curve leaves less than another exposure does: what small steps show of it may be far off.

    The curve is taken out of what the fit predicts, lest noise in bright rows grows or shrinks with it.
    """
    more = sum((off * one for off, one in zip(curve, _shapes(plan, rows, fit), strict=True)), np.float64(0.0))
    if float(np.abs(more).max()) > MOST * float(rows.value.max()):
        return False
    bent = fitted(plan, replace(rows, value=np.ascontiguousarray(rows.value + more)), fit.beat, free)
    exposed = fit if "exposure_s" in free else fitted(plan, rows, fit.beat, (*free, "exposure_s"))
    return robust_loss(rows, bent.rest, fit.rest) < robust_loss(rows, exposed.rest, fit.rest)


def maybe_otherwise_s(plan: Plan, rows: Profiles, fit: Fit, free: tuple[str, ...]) -> float:
    """Return by how much times are in doubt because exposure or readout, where they are not ``free`` in the fit, may be
    others than the plan's: the exposure explains more than a curve does, or what a curve leaves."""
    steps = _steps(plan, rows, fit, free)
    others, beside_s = list[str](), 0.0
    if "exposure_s" not in free:
        exposed, bent, both = steps.taken([EXPOSURE]), steps.best([]), steps.best([EXPOSURE])
        beside_s = abs(float(both.by[SHIFT] - bent.by[SHIFT])) if both.gain - bent.gain > LIKELY else 0.0
        others += ["exposure_s"] if exposed.gain > max(bent.gain, steps.taken([]).gain + LIKELY) else []
    if "row_time_s" not in free and steps.taken([ROW_TIME]).gain > steps.taken([]).gain + LIKELY:
        others.append("row_time_s")
    if not others:
        return beside_s
    return max(beside_s, rms_apart_s(rows, fit.beat, fitted(plan, rows, fit.beat, (*free, *others)).beat))


def nominally_s(plan: Plan, rows: Profiles, fit: Fit, free: tuple[str, ...]) -> float:
    """Return by how much times are in doubt because exposure or readout, where they are not ``free`` in the fit, may be
    as little off as plans usually are.

    Where rows tell little of them, as where most pixels clip, such an error stays, and moves all flashes. Each is held
    against the plan's value and against a curve by how likely the rows are under it (Jeffreys 1939).
    """
    steps, beat = _steps(plan, rows, fit, free), fit.beat
    plain = steps.taken([]).gain
    bent = np.log(BENT) + 0.5 * (steps.best([]).gain - plain) if rows.clipped_share < CLIPPED else -np.inf
    doubts_s = [0.0]
    for name, place in (("exposure_s", EXPOSURE), ("row_time_s", ROW_TIME)):
        off, variance, moved = steps.beside(place)
        usual = (NOMINAL * getattr(beat, name)) ** 2
        if name in free or usual == 0.0 or (off > 0.0 and place == EXPOSURE and beat.exposure_s >= rows.period_s):
            continue
        kept = usual / (usual + variance)
        likely = np.log(OFTEN) + 0.5 * (np.log(variance / (usual + variance)) + kept * off**2 / variance)
        share = float(np.exp(likely - np.logaddexp(likely, np.logaddexp(0.0, bent))))
        doubts_s.append(float(abs(moved) * np.sqrt(share * ((kept * off) ** 2 + kept * variance))))
    return max(doubts_s)


@dataclass(frozen=True, kw_only=True)
class _Step:
    """What small steps explain, in variances, the steps (step,), and the variance of the common shift."""

    gain: float
    by: Doubles
    variance: float


@dataclass(frozen=True, kw_only=True)
class _Steps:
    """The normal equations of small steps from a fit; ``always`` are the places of those that are free anyway."""

    matrix: Doubles
    pull: Doubles
    always: tuple[int, ...]

    def taken(self, more: Sequence[int]) -> _Step:
        """Return the best steps of the times that are free anyway, and of ``more``."""
        kept = np.array([*self.always, *more])
        inverse = self._inverse(kept)
        by = np.zeros(len(self.pull))
        by[kept] = inverse @ self.pull[kept]
        return _Step(gain=float(by @ self.pull), by=by, variance=float(inverse[0, 0]))

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

    def best(self, more: Sequence[int]) -> _Step:
        """Return the best steps with a curve as well, of the fewest shapes that explain as much."""
        taken = [(self.taken([*more, *shapes]), len(shapes)) for shapes in SETS]
        return max(taken, key=lambda one: one[0].gain - SIMPLER * one[1])[0]


def _curve(steps: _Steps, *, held: bool, surely: bool) -> tuple[Curve, float]:
    """Return the curve that is to be taken out, all 0 for none, and by how much times are in doubt as it stays.

    A curve that was found to be off is likelier to be off a little more than the exposure is, as well: not ``surely``,
    it need only explain more.
    """
    exposed, both = steps.taken([EXPOSURE]), steps.best([EXPOSURE])
    bent = steps.best([]) if held else both
    unsure = 0.0 if held else (both.by[SHIFT] - exposed.by[SHIFT]) ** 2 + both.variance - exposed.variance
    taken = both if both.gain - bent.gain > CLEAR else bent
    beyond, least = (both.gain - exposed.gain, CLEAR) if surely else (bent.gain - steps.taken([]).gain, LIKELY)
    needed = beyond > least and bent.gain >= exposed.gain
    curve = tuple(taken.by[FIRST_SHAPE:OTHERS].tolist()) if needed else (0.0,) * len(SHAPES)
    return curve, float(np.sqrt(max(unsure, 0.0)))


def _steps(plan: Plan, rows: Profiles, fit: Fit, free: tuple[str, ...]) -> _Steps:
    trust = np.sqrt(fit.weight)
    changes = np.array([(trust * one).ravel() for one in _changes(plan, rows, fit, free)])
    always = (0, 1, *([ROW_TIME] if "row_time_s" in free else []), *range(OTHERS, len(changes)))
    return _Steps(matrix=changes @ changes.T, pull=-changes @ (trust * fit.rest).ravel(), always=always)


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

    bent = _shapes(plan, rows, fit)
    return [
        change(lambda more: replace(beat, clock=clock.shifted(more, 0.0, pivot_s=pivot_s)), step_s),
        change(lambda more: replace(beat, clock=clock.shifted(0.0, 1e6 * more / span_s, pivot_s=pivot_s)), step_s),
        other("exposure_s"),
        other("row_time_s") if beat.row_time_s > 0.0 else np.zeros_like(fit.rest),
        *(unexplained(plan, replace(rows, value=one), beat, fit.weight) for one in bent),
        *(other(name) for name in free if name not in {"exposure_s", "row_time_s"}),
    ]


def _shapes(plan: Plan, rows: Profiles, fit: Fit) -> list[Doubles]:
    """Return what each shape of the curve adds to the light (frame, row) that the fit predicts."""
    light = rows.value - unexplained(plan, replace(rows, restless=None), fit.beat, fit.weight)
    return [shape(light) for shape in SHAPES]
