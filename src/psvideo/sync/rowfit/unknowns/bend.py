"""A clock that drifts: its bends as a smoothing spline whose stiffness the clip itself decides.

The bends are an integrated random walk of the clock's rate (Wahba 1978): how much the rate wanders is chosen by the
marginal likelihood of the fit, and a clock that runs straight stays straight.
"""

from dataclasses import dataclass, replace

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.compiled_profiles import unexplained
from psvideo.sync.rowfit.normal_equations import projected
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import CAUCHY, EDGES, GLOBALS, Fit, errors_of_residuals, explained, refine, times_moved
from psvideo.sync.rowfit.standard_error import believable, mean_error, standard_error_of

LEAST_WINDOWS = 4
CLEARLY = 5.0
"""By how much the log-likelihood of a bent clock must exceed a straight one's."""
WANDERING = np.geomspace(1e-18, 1e-6, 49)
"""Strengths of the rate's random walk that are tried, in s^2 per s^3."""
HARDLY = 1e-12
"""What no window shows is known as little as this share of what is known best: at all, so that equations are solved."""


@dataclass(frozen=True, kw_only=True)
class Knots:
    """Knots and what is known of bends at them: ``penalty`` / strength is their precision."""

    at_s: Doubles
    penalty: Doubles


def fitted(plan: Plan, rows: Profiles, beat: Beat, free: tuple[str, ...]) -> Fit:
    """Fit a clock, bent where the clip shows that, and the times named in ``free``, from a beat that is near."""
    if beat.clock.knot_s and len(rows.window_start) >= LEAST_WINDOWS:
        rest = unexplained(plan, rows, beat)
        rough = Fit(
            beat=beat,
            rest=rest,
            weight=errors_of_residuals(rows, rest, 0.0) ** -2.0,
            shift_error_s=0.0,
            errors_s={},
            explained=explained(rows, rest),
        )
        return bend(plan, rows, rough, free=free)
    straight = replace(beat, clock=replace(beat.clock, knot_s=(), bend_s=()))
    return bend(plan, rows, refine(plan, rows, straight, free=free), free=free)


def bend(plan: Plan, rows: Profiles, fit: Fit, *, free: tuple[str, ...] = (), steps: int = 6) -> Fit:
    """Return the fit with the clock's drift in it; unchanged where nothing shows any."""
    if len(rows.window_start) < LEAST_WINDOWS:
        return fit
    knots = _knots(rows)
    basis = _basis(len(knots.at_s), free)
    was_bent = bool(fit.beat.clock.knot_s)
    beat, rest = fit.beat, fit.rest
    for step in range(steps):
        scale = errors_of_residuals(rows, rest, 0.02 if step == 0 and was_bent else 0.0)
        trust = 1.0 / (1.0 + (rest / (CAUCHY * scale)) ** 2)
        weight = trust / scale**2
        rest, hessian, scores, _ = projected(plan, rows, beat, weight, basis, tails=bool(EDGES & set(free)))
        inflation = _inflation(hessian, scores, rows)
        pull = scores.sum(axis=0)
        strength, gain = _wandering(hessian / inflation, pull / inflation, beat, knots)
        if gain < CLEARLY and not was_bent:
            return fit
        known = known_of_bends(hessian, knots, strength, inflation)
        now = np.append(beat.clock.bend(knots.at_s), np.zeros(len(free)))
        beat = _moved(rows, beat, knots, free, np.linalg.solve(hessian + known, pull - known @ now))
    covariance, alike_s = believable(plan, rows, beat, weight, trust, basis, known)
    posterior = np.linalg.inv(hessian + known)
    covariance = covariance + posterior @ known @ posterior
    return _bent_fit(replace(fit, beat=beat, weight=weight, alike_s=alike_s), plan, rows, basis, covariance, free)


def _bent_fit(
    fit: Fit, plan: Plan, rows: Profiles, basis: Doubles, covariance: Doubles, free: tuple[str, ...]
) -> Fit:  # fmt: skip
    """Return a fit with what its beat leaves, and the errors of its shift and of the times named in ``free``."""
    rest = unexplained(plan, rows, fit.beat, fit.weight)
    knots = len(covariance) - len(free)
    return replace(
        fit,
        rest=rest,
        shift_error_s=mean_error(basis[:knots], covariance),
        errors_s={name: standard_error_of(covariance[knots + n, knots + n]) for n, name in enumerate(free)},
        explained=explained(rows, rest),
    )


def _knots(rows: Profiles) -> Knots:
    at_s = rows.ends_s
    gap_s = np.diff(at_s)
    second = np.zeros((len(at_s) - 2, len(at_s)))
    for n in range(len(second)):
        second[n, n : n + 3] = 1 / gap_s[n], -1 / gap_s[n] - 1 / gap_s[n + 1], 1 / gap_s[n + 1]
    spacing_s = (gap_s[:-1] + gap_s[1:]) / 2
    return Knots(at_s=at_s, penalty=second.T @ (second / spacing_s[:, None]))


def _basis(knots: int, free: tuple[str, ...]) -> Doubles:
    basis = np.zeros((knots + len(GLOBALS), knots + len(free)))
    basis[:knots, :knots] = np.eye(knots)
    names = list(GLOBALS)
    for n, name in enumerate(free):
        basis[knots + names.index(name), knots + n] = 1.0
    return basis


def known_of_bends(hessian: Doubles, knots: Knots, strength: float, inflation: float) -> Doubles:
    """Return what is known of bends and free times beside the data, as a precision of the shape of ``hessian``."""
    size = len(knots.at_s)
    own = np.diag(hessian)
    known = np.diag(np.maximum(1e-9 * own, HARDLY * own.max()) + 1e-30)
    known[:size, :size] += inflation * knots.penalty / strength
    return known


def _inflation(hessian: Doubles, scores: Doubles, rows: Profiles) -> float:
    """Return by how much shifts of neighbouring windows differ more than noise alone explains (variances' ratio)."""
    knots = len(rows.window_start) + 1
    window = np.searchsorted(rows.window_start, np.arange(len(rows.value)), side="right") - 1
    pull = np.bincount(window, scores[:, :knots].sum(axis=1), minlength=knots - 1)
    along = np.diag(hessian)[:knots]
    cross = np.diag(hessian, 1)[: knots - 1]
    stiff = (along[:-1] + along[1:]) / 2 + 2 * cross + 1e-30
    shift = pull / stiff
    bent = shift[:-2] - 2 * shift[1:-1] + shift[2:]
    expected = 1 / stiff[:-2] + 4 / stiff[1:-1] + 1 / stiff[2:]
    return max(float(np.median(bent**2 / expected)) / 0.455, 1.0)


def _wandering(hessian: Doubles, pull: Doubles, beat: Beat, knots: Knots) -> tuple[float, float]:
    """Return the most likely strength of the rate's random walk, and its log-likelihood above a straight clock's."""
    from scipy.linalg import cho_solve_banded, cholesky_banded  # runs with a timing do without scipy

    size = len(knots.at_s)
    h = hessian[:size, :size]
    if not h.any():
        return float(WANDERING[0]), 0.0
    b = pull[:size] + h @ beat.clock.bend(knots.at_s)
    data, stiff = _bands(h + 1e-12 * np.diag(np.diag(h) + 1e-30)), _bands(knots.penalty)
    likelihood = []
    for strength in WANDERING:
        try:
            factor = cholesky_banded(data + stiff / strength, lower=True)
        except np.linalg.LinAlgError:  # too stiff to differ from a straight clock in double precision
            likelihood.append(-np.inf)
            continue
        gain = 0.5 * b @ cho_solve_banded((factor, True), b)  # type: ignore[no-untyped-call]
        likelihood.append(gain - np.log(factor[0]).sum() - 0.5 * (size - 2) * np.log(strength))
    best, straight = int(np.argmax(likelihood)), int(np.argmax(np.isfinite(likelihood)))
    if not np.isfinite(likelihood[best]):
        return float(WANDERING[0]), 0.0
    return float(WANDERING[best]), float(likelihood[best] - likelihood[straight])


def _bands(matrix: Doubles) -> Doubles:
    """Return the diagonal and the two below it, one a row: knots act on their neighbours only."""
    bands = np.zeros((3, len(matrix)))
    for below in range(3):
        bands[below, : len(matrix) - below] = np.diag(matrix, -below)
    return bands


def _moved(rows: Profiles, beat: Beat, knots: Knots, free: tuple[str, ...], move: Doubles) -> Beat:
    size = len(knots.at_s)
    clock = beat.clock.bent(knots.at_s, move[:size])
    return replace(beat, clock=clock, **times_moved(rows, beat, free, move[size:]))


def late_s(one: Beat, other: Beat, at_s: Doubles) -> Doubles:
    """Return by how much flashes of another clock come later than the flashes of one do at some times, same shape."""
    strobe_s = (at_s - one.clock.phase_s) / one.clock.rate
    straight_s = other.clock.phase_s + strobe_s * other.clock.rate
    late: Doubles = straight_s + other.clock.bend(straight_s) - at_s - one.clock.bend(at_s)
    return late


def rms_apart_s(rows: Profiles, one: Beat, other: Beat) -> float:
    """Return how far two clocks are apart at the windows' ends."""
    return float(np.sqrt(np.mean(late_s(one, other, rows.ends_s) ** 2)))
