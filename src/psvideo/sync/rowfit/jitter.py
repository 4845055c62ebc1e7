"""What a smooth clock leaves: flashes that each come a little early or late, and how certain all times are.

Rows that open during a flash and rows that close during it show its time independently of one another. What both say
alike is jitter, what they say differently is noise; so jitter is believed, and noise shrunk away, without a model of
either (empirical Bayes).
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from psvideo.model.camera import FloatArray
from psvideo.model.plan import Plan
from psvideo.sync.rowfit import kernel, row_model
from psvideo.sync.rowfit.profiles import Profiles, compiled_flashes, compiled_rows, equations
from psvideo.sync.rowfit.refine import CAUCHY, WIDE_SCALE, Fit, scaled

LEAST_FLASHES = 12
SURE = 5.0
"""Standard errors by which openings and closings must agree before single flashes are moved."""
CHANCE = 2.0
"""Standard errors by which openings and closings may disagree by chance."""
ROW_BLOCKS = 8
"""Blocks of rows whose errors are taken as independent."""


@dataclass(frozen=True, kw_only=True)
class Jitter:
    """By how much each flash comes late, ``late_s`` (flash,), by its start ``start_s``; ``error_s`` is each one's."""

    start_s: FloatArray
    late_s: FloatArray
    error_s: float

    def of(self, start_s: FloatArray) -> FloatArray:
        """Return by how much the flashes that start at these times come late, same shape; 0 for others."""
        if not len(self.start_s):
            return np.zeros_like(start_s)
        nearest = np.abs(self.start_s[None, :] - start_s[:, None]).argmin(axis=1)
        same = np.abs(self.start_s[nearest] - start_s) < 1e-7
        late_s: FloatArray = np.where(same, self.late_s[nearest], 0.0)
        return late_s


STEADY = Jitter(start_s=np.empty(0), late_s=np.empty(0), error_s=0.0)


def jitter(plan: Plan, rows: Profiles, fit: Fit) -> Jitter:
    """Return how single flashes stray from the clock; none at all where openings and closings do not agree on it."""
    flashes, pull, stiff = _pulls(plan, rows, fit)
    seen_at_all = stiff[stiff > 0]
    enough = 0.1 * float(np.median(seen_at_all)) if len(seen_at_all) else 1.0
    timed = np.logical_and(stiff[:, 0] > enough, stiff[:, 1] > enough)
    if timed.sum() < LEAST_FLASHES:
        return STEADY
    apart = pull[timed] / stiff[timed]
    apart -= np.median(apart, axis=0)
    bound = 6.0 * 1.4826 * float(np.median(np.abs(apart))) + 1e-15
    apart = np.clip(apart, -bound, bound)
    common, noise = float((apart[:, 0] * apart[:, 1]).mean()), float(((apart[:, 0] - apart[:, 1]) ** 2).mean()) / 4
    chance = float(np.sqrt((apart[:, 0] ** 2).mean() * (apart[:, 1] ** 2).mean() / len(apart)))
    if common < SURE * chance or common < noise:
        return STEADY
    share = common / (common + noise)
    seen_by_clip = (flashes.start_s > rows.frame_start_s[0]) & (flashes.start_s < rows.frame_start_s[-1])
    untimed = 1.0 - float(timed[seen_by_clip].mean())
    return Jitter(
        start_s=flashes.start_s[timed],
        late_s=share * apart.mean(axis=1),
        error_s=float(np.sqrt((1 - untimed) * share * noise + untimed * common)),
    )


def _pulls(plan: Plan, rows: Profiles, fit: Fit) -> tuple[row_model.Flashes, FloatArray, FloatArray]:
    """Return the flashes and how strongly rows that open and rows that close shift each, shape (flash, 2) twice."""
    seen, flashes = compiled_rows(rows, fit.beat), compiled_flashes(plan, rows, fit.beat)
    pull, stiff = np.zeros((len(flashes.start_s), 2)), np.zeros((len(flashes.start_s), 2))
    scale = scaled(rows, fit.rest, WIDE_SCALE)
    weight = 1.0 / (1.0 + (fit.rest / (CAUCHY * scale)) ** 2) / scale**2
    kernel.edges(seen, flashes, weight, 0, rows.value.shape[1], pull, stiff)
    return flashes, pull, stiff


def disagreement_s(plan: Plan, rows: Profiles, fit: Fit) -> float:
    """Return by how much rows that open and rows that close disagree on the flashes' times, beyond chance.

    Half their distance is as large as the standard error where noise is all that parts them; blurred rows part them
    further, and that much the times are in doubt.
    """
    _, pull, stiff = _pulls(plan, rows, fit)
    if stiff.sum(axis=0).min() <= 0.0:
        return 0.0
    opening_s, closing_s = pull.sum(axis=0) / stiff.sum(axis=0)
    return float(np.sqrt(max((0.5 * (opening_s - closing_s)) ** 2 - (CHANCE * fit.shift_error_s) ** 2, 0.0)))


def shift_error_s(plan: Plan, rows: Profiles, fit: Fit) -> float:
    """Return the standard error of the common shift as blocks of rows give it, which a moving subject upsets."""
    edges = np.linspace(0, rows.value.shape[1], ROW_BLOCKS + 1).astype(int)
    if np.diff(edges).min() == 0:
        return 0.0
    pulls, stiff = [], []
    for first, last in pairwise(edges.tolist()):
        block = rows.only_rows(slice(first, last))
        weight = np.ascontiguousarray(fit.weight[:, first:last])
        _, hessian, score = equations(plan, block, fit.beat, weight, tails=False, steepness=weight)
        pulls.append(score[:, :2].sum())
        stiff.append(hessian[:, :2, :2].sum())
    pull, whole = np.array(pulls), float(np.sum(stiff))
    if whole <= 0.0:
        return 0.0
    pull -= np.array(stiff) * pull.sum() / whole
    return float(np.sqrt(ROW_BLOCKS / (ROW_BLOCKS - 1) * (pull**2).sum()) / whole)
