"""By how much all flashes of a window of frames come later than a clock says: one robust step of the finder's fit."""

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.normal_equations import projected
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import CAUCHY, GLOBALS, errors_of_residuals
from psvideo.sync.rowfit.standard_error import sandwich

HELD = 0.33
"""A correction moves the clock by no more than this share of a flash."""


def late_by(plan: Plan, rows: Profiles, beat: Beat, rest: Doubles) -> tuple[float, float]:
    """Return by how many seconds flashes come later than a beat says, and the standard error.

    ``rest`` (frame, row) is what the beat, with brightnesses fitted, leaves of the rows.
    """
    scale = errors_of_residuals(rows, rest, 0.0)
    weight = 1.0 / (1.0 + (rest / (CAUCHY * scale)) ** 2) / scale**2
    basis = np.zeros((len(rows.window_start) + 1 + len(GLOBALS), 1))  # what a fit may free is held here
    basis[: len(rows.window_start) + 1] = 1.0
    _, hessian, scores, _ = projected(plan, rows, beat, weight, basis, tails=False)
    shortest_s = plan.shortest_flash_s
    known = np.full((1, 1), shortest_s**-2.0)
    shift_s = float(scores.sum() / (hessian[0, 0] + known[0, 0]))
    most_s = HELD * shortest_s
    least_s = (hessian[0, 0] + known[0, 0]) ** -0.5  # where few rows show the phase, none of them may differ
    error_s = max(float(np.sqrt(sandwich(hessian, scores, known)[0, 0])), float(least_s))
    return float(np.clip(shift_s, -most_s, most_s)), error_s
