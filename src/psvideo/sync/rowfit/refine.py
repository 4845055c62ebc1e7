"""Sharpening: robust Gauss-Newton steps on a clock that runs straight, the shutter's times with it where asked for."""

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.compiled_profiles import unexplained
from psvideo.sync.rowfit.normal_equations import projected, solved
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.row_slopes import BLUR, EXPOSURE, FALL, RISE, ROW_TIME
from psvideo.sync.rowfit.standard_error import believable, mean_error, standard_error_of

CAUCHY = 2.4
"""Residuals of this many standard deviations are trusted half as much (95 % efficiency for Gaussian noise)."""
FIRST_SCALE, LAST_SCALE = 0.3, 2e-3
"""The robust fit's residual scale as a share of each row's spread: it shrinks from step to step down to the noise, so
that the few rows that a flash splits, which show the time, are not taken for outliers before the fit is near."""
WIDE_SCALE = 0.05
"""The scale at which a time that is off is looked for: rows that it spoils must not count as outliers then."""
GLOBALS = {"exposure_s": EXPOSURE, "row_time_s": ROW_TIME, "rise_s": RISE, "fall_s": FALL, "blur_s": BLUR}
"""The times, beside the clock's, that can be set free, and the signal of each."""
TAILS = ("rise_s", "fall_s")
EDGES = {*TAILS, "blur_s"}
"""Those that make edges soft: what they change is worked out only where one is free."""
LEAST_BLUR_ROWS = 0.05
"""A blur that is free stays this large, which is next to none: a row takes 0.1 % from either neighbour."""


@dataclass(frozen=True, kw_only=True)
class Fit:
    """A beat and how well it fits. ``errors_s`` holds the standard error of every time that was free, by name;
    ``alike_s`` is as in ``Believable``."""

    beat: Beat
    rest: Doubles
    weight: Doubles
    shift_error_s: float
    errors_s: dict[str, float]
    explained: float
    alike_s: float = 0.0

    @property
    def loss(self) -> float:
        """The weighted sum of squares that is left."""
        return float((self.weight * self.rest**2).sum())


class _Stepped(NamedTuple):
    """Where robust steps end: the beat, what it leaves, and each sample's weight and the trust in it (frame, row)."""

    beat: Beat
    rest: Doubles
    weight: Doubles
    trust: Doubles


def refine(
    plan: Plan,
    rows: Profiles,
    beat: Beat,
    *,
    free: tuple[str, ...] = (),
    steps: int = 10,
    first_scale: float = FIRST_SCALE,
) -> Fit:
    """Fit shift and clock ratio, and the times named in ``free``, by steps that are taken only as far as they help."""
    beat, rest, weight, trust = _stepped(plan, rows, beat, free=free, steps=steps, first_scale=first_scale)
    basis, unit_s = straight_basis(rows, free), units_of(plan, rows, free)
    covariance, alike_s = believable(plan, rows, beat, weight, trust, basis, prior(unit_s, free))
    return Fit(
        beat=beat,
        rest=rest,
        weight=weight,
        shift_error_s=mean_error(basis[: len(rows.window_start) + 1], covariance),
        errors_s={name: standard_error_of(covariance[2 + n, 2 + n]) for n, name in enumerate(free)},
        explained=explained(rows, rest),
        alike_s=alike_s,
    )


def refined_beat(
    plan: Plan,
    rows: Profiles,
    beat: Beat,
    *,
    free: tuple[str, ...] = (),
    steps: int = 10,
    first_scale: float = FIRST_SCALE,
) -> Beat:
    """Return the beat of ``refine``; errors, which cost as much as some of its steps, are not worked out."""
    return _stepped(plan, rows, beat, free=free, steps=steps, first_scale=first_scale).beat


def _stepped(
    plan: Plan, rows: Profiles, beat: Beat, *, free: tuple[str, ...], steps: int, first_scale: float
) -> _Stepped:
    basis, unit_s = straight_basis(rows, free), units_of(plan, rows, free)
    rest = unexplained(plan, rows, beat)
    weight = trust = np.ones_like(rest)
    for step in range(steps):
        scale = errors_of_residuals(rows, rest, first_scale * 0.4**step)
        trust = 1.0 / (1.0 + (rest / (CAUCHY * scale)) ** 2)
        weight = trust / scale**2
        rest, hessian, scores, _ = projected(plan, rows, beat, weight, basis, tails=bool(EDGES & set(free)))
        move = solved(hessian + prior(unit_s, free), scores.sum(axis=0))
        beat, rest, gained = _step(plan, rows, beat, free, _held(plan, move), weight, rest)
        if step > 6 and (not gained or (np.abs(move) < 1e-5 * unit_s).all()):
            break
    return _Stepped(beat, rest, weight, trust)


def straight_basis(rows: Profiles, free: tuple[str, ...]) -> Doubles:
    """Return the columns by which shift and slope move the knots, and each free time itself."""
    ends_s = rows.ends_s
    pivot_s, half_s = _pivot(rows)
    basis = np.zeros((len(ends_s) + len(GLOBALS), 2 + len(free)))
    basis[: len(ends_s), 0] = 1.0
    basis[: len(ends_s), 1] = (ends_s - pivot_s) / half_s
    for n, name in enumerate(free):
        basis[len(ends_s) + GLOBALS[name] - EXPOSURE, 2 + n] = 1.0
    return basis


def _pivot(rows: Profiles) -> tuple[float, float]:
    start_s = rows.frame_start_s
    return float(start_s.mean()), max(float(start_s[-1] - start_s[0]) / 2, rows.period_s)


def units_of(plan: Plan, rows: Profiles, free: tuple[str, ...]) -> Doubles:
    """Return a fiftieth of a flash in every unknown, which is small for all of them."""
    shortest_s = 0.02 * plan.shortest_flash_s
    return np.array([shortest_s] * 2 + [shortest_s / (rows.place.max() if n == "row_time_s" else 1.0) for n in free])


def prior(unit_s: Doubles, free: tuple[str, ...]) -> Doubles:
    """Return the precision of what is known beforehand: free times stay within a few flashes of where they are."""
    known = np.zeros((len(unit_s), len(unit_s)))
    for n in range(len(free)):
        known[2 + n, 2 + n] = (50.0 * unit_s[2 + n]) ** -2.0
    return known + 1e-12 * np.diag(unit_s**-2.0)


def _held(plan: Plan, move: Doubles) -> Doubles:
    """Take no step of more than a third of a flash."""
    longest_s = 0.33 * plan.shortest_flash_s
    largest_s = float(np.abs(move[:2]).max())
    held: Doubles = move * min(1.0, longest_s / max(largest_s, 1e-30))
    return held


def _step(
    plan: Plan,
    rows: Profiles,
    beat: Beat,
    free: tuple[str, ...],
    move: Doubles,
    weight: Doubles,
    rest: Doubles,
) -> tuple[Beat, Doubles, bool]:
    """Take a step, halved until it explains more; say whether it did."""
    loss = float((weight * rest**2).sum())
    for _ in range(5):
        moved = _moved(rows, beat, free, move)
        moved_rest = unexplained(plan, rows, moved, weight)
        if float((weight * moved_rest**2).sum()) < loss:
            return moved, moved_rest, True
        move = move / 2
    return beat, rest, False


def _moved(rows: Profiles, beat: Beat, free: tuple[str, ...], move: Doubles) -> Beat:
    pivot_s, half_s = _pivot(rows)
    clock = beat.clock.shifted(float(move[0]), float(move[1]) / half_s * 1e6, pivot_s=pivot_s)
    return replace(beat, clock=clock, **times_moved(rows, beat, free, move[2:]))


def times_moved(rows: Profiles, beat: Beat, free: tuple[str, ...], move: Doubles) -> dict[str, Any]:
    """Return the times named in ``free`` after a step, within the bounds of what a camera and LEDs can do."""
    times_s = {name: max(getattr(beat, name) + float(move[n]), 0.0) for n, name in enumerate(free)}
    if "exposure_s" in times_s:
        times_s["exposure_s"] = min(times_s["exposure_s"], rows.period_s)
    if "blur_s" in times_s:
        times_s["blur_s"] = max(times_s["blur_s"], LEAST_BLUR_ROWS * beat.row_time_s)
    if "row_time_s" in times_s:
        times_s["row_time_s"] = min(times_s["row_time_s"], 1.02 * rows.period_s / (rows.place.max() + 1))
    return times_s


def errors_of_residuals(rows: Profiles, rest: Doubles, share: float) -> Doubles:
    """Return how far each residual may be off: noise, at first a share of the row's spread, and what is doubtful."""
    scale = np.maximum(row_noise(rest), rows.spread * max(share, LAST_SCALE))
    if rows.doubt is None:
        return np.broadcast_to(scale, rest.shape)
    return np.sqrt(scale**2 + rows.doubt**2)


def row_noise(rest: Doubles) -> Doubles:
    """Return each row's own residual spread (from the median, so that outliers do not count), shape (row,)."""
    spread = 1.4826 * np.median(np.abs(rest), axis=0)
    noise: Doubles = np.maximum(spread, 0.1 * np.median(spread) + 1e-9)
    return noise


def robust_loss(rows: Profiles, rest: Doubles, reference: Doubles) -> float:
    """Return Cauchy's loss of residuals against the noise of ``reference`` residuals."""
    return float(np.log1p((rest / (CAUCHY * errors_of_residuals(rows, reference, 0.0))) ** 2).sum())


def explained(rows: Profiles, rest: Doubles) -> float:
    """Return which share of the rows' changes from frame to frame a fit explains."""
    change = rows.value - rows.value.mean(axis=0)
    return 1.0 - float((rest**2).sum() / max(float((change**2).sum()), 1e-30))
