"""Stretches of a clip whose flashes all come early or late: a clock that jumped by less than what cuts a clip.

A clock that bends smoothly meets a jump halfway, and the robust fit takes frames beside it for odd ones. What rows that
open and rows that close during the flashes of a stretch say alike shows by how much the times are off there; light
that changes and a subject that moves shift the two against one another.
"""

import numpy as np

from psvideo.model.plan import Plan
from psvideo.sync.rowfit.compiled_profiles import compiled_flashes
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import Fit
from psvideo.sync.rowfit.unknowns.edge_pulls import moved_flashes, pulls
from psvideo.sync.rowfit.unknowns.jitter import ENOUGH, SURE, Jitter

STRETCH = 4
"""Flashes of a stretch."""
ALIKE = 2.0
"""Both kinds of rows show a stretch early or late where their mean is as many times half of their distance."""
LEAST = 0.01
"""Share of the shortest flash by which a stretch must be off: less changes no plate by more."""
DARK = 0.03
"""Rows that change by less than this share of what the one that changes most does show no flash."""
NORMAL = 1.4826
"""A standard deviation in median absolute deviations of normal errors."""


def unsteady_s(plan: Plan, rows: Profiles, fit: Fit, stray: Jitter) -> float:
    """Return by how much flashes are off in stretches that are clearly early or late, as a root mean square over all
    of the clip. What was found of single flashes' jitter does not count."""
    flashes = compiled_flashes(plan, rows, fit.beat)
    if len(stray.late_s):
        flashes = moved_flashes(flashes, stray.late_s)
    lit = rows.spread > DARK * rows.spread.max()
    pull, stiff = pulls(rows.only_rows(lit), fit, flashes, lit, robust=False)
    both = stiff.min(axis=1)
    timed = both > ENOUGH * float(np.median(both[both > 0])) if (both > 0).any() else both > 0
    pull, stiff = pull[timed], stiff[timed]
    first = np.arange(0, len(pull) - STRETCH + 1, STRETCH)
    if len(first) < 2:
        return 0.0
    apart_s = np.diff(pull / stiff, axis=1)[:, 0]
    apart_s -= np.median(apart_s)
    noise = (NORMAL * float(np.median(np.abs(apart_s) / np.sqrt((1 / stiff).sum(axis=1))))) ** 2
    pull, stiff = np.add.reduceat(pull, first), np.add.reduceat(stiff, first)
    opening_s, closing_s = (pull / stiff - pull.sum(axis=0) / stiff.sum(axis=0)).T
    late_s, half_s = 0.5 * (opening_s + closing_s), 0.5 * np.abs(opening_s - closing_s)
    scatter_s = NORMAL * float(np.median(np.abs(np.diff(late_s)))) / np.sqrt(2)
    least_s = np.maximum(SURE * 0.5 * np.sqrt(noise * (1 / stiff).sum(axis=1)), LEAST * plan.shortest_flash_s)
    least_s = np.maximum(least_s, SURE * scatter_s)
    off_s = np.where((np.abs(late_s) > least_s) & (np.abs(late_s) > ALIKE * half_s), late_s, 0.0)
    return float(np.sqrt(np.mean(off_s**2)))
