"""Which way rows that open or close in a flash pull its time, and how certain that makes the times of all flashes.

Rows that open during a flash and rows that close during it show its time independently of one another.
"""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.sync.rowfit import projection
from psvideo.sync.rowfit.compiled_profiles import compiled_flashes, compiled_rows, equations
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import CAUCHY, WIDE_SCALE, Fit, errors_of_residuals
from psvideo.sync.rowfit.row_model import Flashes

CHANCE = 2.0
"""Standard errors by which openings and closings may disagree by chance."""
ROW_BLOCKS = 8
"""Blocks of rows whose errors are taken as independent."""


def moved_flashes(flashes: Flashes, late_s: Doubles) -> Flashes:
    """Return the flashes as late as they were found; they stay in order."""
    return flashes._replace(start_s=np.maximum.accumulate(flashes.start_s + late_s))


def pulls(
    rows: Profiles, fit: Fit, flashes: Flashes, among: slice | NDArray[np.bool_] = slice(None), *, robust: bool = True
) -> tuple[Doubles, Doubles]:
    """Return how strongly rows that open and rows that close shift each flash, shape (flash, 2) twice.

    ``rows`` are those ``among`` the fit's own. Not ``robust``, large residuals pull as much as they are large.
    """
    seen = compiled_rows(rows, fit.beat)
    pull, stiff = np.zeros((len(flashes.start_s), 2)), np.zeros((len(flashes.start_s), 2))
    rest = np.ascontiguousarray(fit.rest[:, among])
    scale = errors_of_residuals(rows, rest, WIDE_SCALE)
    trust = 1.0 / (1.0 + (rest / (CAUCHY * scale)) ** 2) if robust else np.ones_like(rest)
    projection.edges(seen, flashes, trust / scale**2, 0, rows.value.shape[1], pull, stiff)
    return pull, stiff


def disagreement_s(plan: Plan, rows: Profiles, fit: Fit) -> float:
    """Return by how much rows that open and rows that close disagree on the flashes' times, beyond chance.

    Half their distance is as large as the standard error where noise is all that parts them; blurred rows part them
    further, and that much the times are in doubt.
    """
    pull, stiff = pulls(rows, fit, compiled_flashes(plan, rows, fit.beat))
    if stiff.sum(axis=0).min() <= 0.0:
        return 0.0
    opening_s, closing_s = pull.sum(axis=0) / stiff.sum(axis=0)
    return float(np.sqrt(max((0.5 * (opening_s - closing_s)) ** 2 - (CHANCE * fit.shift_error_s) ** 2, 0.0)))


def shift_error_s(plan: Plan, rows: Profiles, fit: Fit) -> float:
    """Return the standard error of the common shift as blocks of rows give it, which a moving subject upsets."""
    edges = np.linspace(0, rows.value.shape[1], ROW_BLOCKS + 1).astype(int)
    if np.diff(edges).min() == 0:
        return 0.0
    each, stiff = [], []
    for first, last in pairwise(edges.tolist()):
        block = rows.only_rows(slice(first, last))
        weight = np.ascontiguousarray(fit.weight[:, first:last])
        found = equations(plan, block, fit.beat, weight, tails=False, steepness=weight)
        each.append(found.frame[:, :2].sum())
        stiff.append(found.windows[:, :2, :2].sum())
    pull, whole = np.array(each), float(np.sum(stiff))
    if whole <= 0.0:
        return 0.0
    pull -= np.array(stiff) * pull.sum() / whole
    return float(np.sqrt(ROW_BLOCKS / (ROW_BLOCKS - 1) * (pull**2).sum()) / whole)
