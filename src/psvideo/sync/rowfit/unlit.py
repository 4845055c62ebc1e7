"""Frames that no flash lights: a strobe that starts after the camera, stops before it, or is covered for a while.

They look alike as repeated frames do, and fit no place in time. So they are left out before anything is searched for,
and keep the places in time that their numbering gives them.
"""

from collections.abc import Iterator

import numpy as np

from psvideo.model.arrays import Doubles, Integers, Mask
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.coarse.retime import REPEATED_MOST, twins
from psvideo.sync.rowfit.compiled_profiles import slot_unknowns
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.quiet import loud_part

DARK, FLOOR = 0.02, 0.02
"""A frame is dark whose rows lie above their darkest, a quantile of each, by less than half this share of their spreads
on an average: as much as noise on either side comes to. What lies below is no light, but a frame that was lost."""
STRAY = 0.5
"""Darker frames, up to this share of the shortest run that is looked for, make no floor."""
REPEATED_LEAST = 2
"""A frame in the dark may be shown this often where no lit one is."""
VARIES = 0.03
"""Rows whose spread is below this share of the largest show nothing of the strobe."""
ROWS = 60
"""Averaged to this many rows, noise hides less of it."""
LIT = 0.1
"""A frame is lit whose rows lie above their darkest by this share of their spreads on an average."""
OFTEN = 0.05
"""Lit frames of which this share look alike may do so because lights are alike."""
NOISY = 0.7
"""Where more than this share of lit frames that look alike are the same, frames may have no noise, and lights be alike.
"""
LEAST_SHARE = 0.1
"""Where fewer frames than that are lit, it may be the subject that is dark."""


def unlit(plan: Plan, rows: Profiles) -> Mask:
    """Return the frames that are dark for longer than the plan's own dark times make any, shape (frame,)."""
    few = rows.binned(ROWS)
    dark = _above_floor(few, max(FLOOR * len(few.value), STRAY * _longest_run(plan, rows, REPEATED_LEAST))) < DARK / 2
    times = np.clip(1 + _longest(twins(few) & ~dark), REPEATED_LEAST, REPEATED_MOST)
    found = _in_long_runs(dark | _quiet_ends(rows), _longest_run(plan, rows, int(times)))
    return found if (~found).mean() > LEAST_SHARE else np.zeros_like(found)


def _quiet_ends(rows: Profiles) -> Mask:
    """Return the frames at either end that change by noise alone, shape (frame,): where lights are weak, it is more
    than ``DARK`` of what rows change by."""
    found = np.ones(len(rows.value), np.bool_)
    found[loud_part(rows)] = False
    return found


def lit_twins(rows: Profiles) -> Mask:
    """Return the frames that look exactly like those before them and are lit, shape (frame,): unlike two in the dark,
    they show the same moment wherever another flash was due. Where many do, as where lights are alike, only ``copies``
    count."""
    few = rows.binned(ROWS)
    found = twins(few) & (_above_floor(few, FLOOR * len(few.value)) > LIT)
    return found if found.mean() < OFTEN else copies(rows)


def copies(rows: Profiles) -> Mask:
    """Return the lit frames that are those before them to the last bit, shape (frame,): noise makes any others differ.
    None where nothing shows that there is noise: all that look alike are the same."""
    few = rows.binned(ROWS)
    alike = twins(few) & (_above_floor(few, FLOOR * len(few.value)) > LIT)
    same = alike & np.append(False, (np.diff(rows.value, axis=0) == 0.0).all(axis=1))
    return same if same.sum() < NOISY * alike.sum() else np.zeros_like(same)


def _above_floor(rows: Profiles, rank: float) -> Doubles:
    """Return by how much frames lie above the darkest (that of a ``rank``, from 0) row by row, shape (frame,), in rows'
    spreads."""
    seen = rows.spread > VARIES * rows.spread.max()
    floor = np.quantile(rows.value, min(rank / len(rows.value), 1.0), axis=0)
    above: Doubles = np.maximum((rows.value - floor) / rows.spread, 0.0)[:, seen].mean(axis=1)
    return above


def still(plan: Plan, rows: Profiles) -> Mask:
    """Return the frames that look like those before them for longer than a strobe leaves any, shape (frame,).

    They show a picture that is frozen, or a scene without flashes that is brighter than where it is darkest.
    """
    return _in_long_runs(twins(rows.binned(ROWS)), _longest_run(plan, rows, REPEATED_MOST))


def _in_long_runs(odd: Mask, longest: int) -> Mask:
    """Return those of the odd frames (frame,) that are more in a row than ``longest``."""
    found = np.zeros(len(odd), np.bool_)
    for first, last in _runs(odd):
        found[first:last] = last - first > longest
    return found


def _longest(odd: Mask) -> int:
    return max((last - first for first, last in _runs(odd)), default=0)


def _runs(odd: Mask) -> Iterator[tuple[int, int]]:
    """Yield the first and the end of every run of odd frames (frame,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], odd.astype(np.int64), [0]])))
    return zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)


def _longest_run(plan: Plan, rows: Profiles, times: int) -> int:
    """Return how many frames in a row one dark time makes where each is shown so many times."""
    return times * (int(_longest_dark_s(plan) / rows.period_s) + 1)


def with_unlit(rows: Profiles, index: Integers, unlit: Mask) -> Integers:
    """Return the places in time of all frames (frame,) from those that are lit; others follow the ones before them.

    Where there are more of them than places until the next lit frame, the last ones count as repeated: that frame is
    none.
    """
    every = np.arange(len(unlit))
    lit = np.flatnonzero(~unlit)
    before = np.maximum.accumulate(np.where(unlit, -1, every))
    before = np.where(before < 0, lit[0], before)
    behind = np.minimum(np.searchsorted(lit, every), len(lit) - 1)
    places = np.empty(len(unlit), np.int64)
    places[lit] = index
    found: Integers = places[before] + rows.index - rows.index[before]
    most = np.maximum(index[behind] - 1, places[before])
    between = unlit & (every > lit[0]) & (every < lit[-1])
    return np.where(between, np.minimum(found, most), found)


def _longest_dark_s(plan: Plan) -> float:
    """Return the longest time in which the plan lights nothing, on the strobe's clock."""
    train = plan.train(0, 2 * len(plan.cycle_slots))
    lit = slot_unknowns(plan)[train.slot] > 0
    return float(np.max(train.start_s[lit][1:] - (train.start_s + train.duration_s)[lit][:-1], initial=plan.dark_s))
