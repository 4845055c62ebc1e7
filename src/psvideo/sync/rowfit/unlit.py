"""Frames that no flash lights: a strobe that starts after the camera, stops before it, or is covered for a while.

They look alike as repeated frames do, and fit no place in time. So they are left out before anything is searched for,
and keep the places in time that their numbering gives them.
"""

import numpy as np

from psvideo.model.plan import Plan
from psvideo.sync.rowfit.coarse.retime import REPEATED_MOST, Mask, twins
from psvideo.sync.rowfit.profiles import Profiles, slot_unknowns
from psvideo.sync.rowfit.row_model import IntArray

DARK, FLOOR = 0.02, 2.0
"""A frame is dark whose rows are nearer than this share of their spreads to their darkest, a percentile of each."""
VARIES = 0.03
"""Rows whose spread is below this share of the largest show nothing of the strobe."""
ROWS = 60
"""Averaged to this many rows, noise hides less of it."""
LEAST_SHARE = 0.1
"""Where fewer frames than that are lit, it may be the subject that is dark."""


def unlit(plan: Plan, rows: Profiles) -> Mask:
    """Return the frames that are dark for longer than the plan's own dark times make any, shape (frame,)."""
    few = rows.binned(ROWS)
    seen = few.spread > VARIES * few.spread.max()
    floor = np.percentile(few.value, FLOOR, axis=0)
    dark = np.abs((few.value - floor) / few.spread)[:, seen].mean(axis=1) < DARK
    found = _in_long_runs(plan, rows, dark)
    return found if (~found).mean() > LEAST_SHARE else np.zeros_like(found)


def still(plan: Plan, rows: Profiles) -> Mask:
    """Return the frames that look like those before them for longer than a strobe leaves any, shape (frame,).

    They show a picture that is frozen, or a scene without flashes that is brighter than where it is darkest.
    """
    return _in_long_runs(plan, rows, twins(rows.binned(ROWS)))


def _in_long_runs(plan: Plan, rows: Profiles, odd: Mask) -> Mask:
    """Return those of the odd frames (frame,) that are more in a row than repeated frames of one dark time are."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], odd.astype(np.int64), [0]])))
    longest = REPEATED_MOST * (int(_longest_dark_s(plan) / rows.period_s) + 1)
    found = np.zeros(len(odd), np.bool_)
    for first, last in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        found[first:last] = last - first > longest
    return found


def with_unlit(rows: Profiles, index: IntArray, unlit: Mask) -> IntArray:
    """Return the places in time of all frames (frame,) from those that are lit; others follow the ones before them."""
    every = np.arange(len(unlit))
    before = np.maximum.accumulate(np.where(unlit, -1, every))
    before = np.where(before < 0, int(np.argmin(unlit)), before)
    places = np.empty(len(unlit), np.int64)
    places[~unlit] = index
    found: IntArray = places[before] + rows.index - rows.index[before]
    return np.minimum.accumulate(found[::-1])[::-1]


def _longest_dark_s(plan: Plan) -> float:
    """Return the longest time in which the plan lights nothing, on the strobe's clock."""
    train = plan.train(0, 2 * len(plan.cycle_slots))
    lit = slot_unknowns(plan)[train.slot] > 0
    return float(np.max(train.start_s[lit][1:] - (train.start_s + train.duration_s)[lit][:-1], initial=plan.dark_s))
