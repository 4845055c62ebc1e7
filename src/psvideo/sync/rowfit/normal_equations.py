"""The fit's normal equations in the unknowns of a basis, and their solution."""

from typing import NamedTuple

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.compiled_profiles import equations
from psvideo.sync.rowfit.profiles import Profiles

DAMPING = 1e-10
"""This share of every unknown's own precision is added: rows may show two unknowns together, and neither alone."""


class Projected(NamedTuple):
    """Residuals ``rest`` (frame, row), the normal matrix ``hessian`` and scores in the unknowns of a basis, apart by
    ``scores`` (frame, unknown) and ``at_place`` (place, unknown)."""

    rest: Doubles
    hessian: Doubles
    scores: Doubles
    at_place: Doubles


def projected(
    plan: Plan,
    rows: Profiles,
    beat: Beat,
    weight: Doubles,
    basis: Doubles,
    *,
    tails: bool,
    steepness: Doubles | None = None,
) -> Projected:
    """Return the normal equations in the unknowns of a basis; ``at_place`` is empty without ``steepness``."""
    found = equations(plan, rows, beat, weight, tails=tails, steepness=steepness)
    knots = len(rows.window_start) + 1
    size = basis.shape[1]
    hessian, at_place = np.zeros((size, size)), np.zeros((found.place.shape[1], size))
    common = basis[knots:]
    for w, matrix in enumerate(found.windows):
        local = np.vstack([basis[w], basis[w + 1], common])
        moved = np.flatnonzero(local.any(axis=0))
        hessian[np.ix_(moved, moved)] += local[:, moved].T @ matrix @ local[:, moved]
        at_place[:, moved] += found.place[w] @ local[:, moved]
    window = np.searchsorted(rows.window_start, np.arange(len(rows.value)), side="right") - 1
    score = found.frame
    scores = score[:, :1] * basis[window] + score[:, 1:2] * basis[window + 1] + score[:, 2:] @ common
    return Projected(found.rest, hessian, scores, at_place)


def solved(matrix: Doubles, right: Doubles) -> Doubles:
    """Return what a normal matrix times the result is; it is damped (Marquardt 1963) only where it has no inverse.

    A strobe in step with the frames shows one edge again and again: shift and slope are then one unknown.
    """
    try:
        return np.asarray(np.linalg.solve(matrix, right))
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.solve(matrix + DAMPING * np.diag(np.diag(matrix)), right))
