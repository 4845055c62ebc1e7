"""The coarse search where a code says which rounds are dark: the round first, then the place in the code.

A coded cycle has hundreds of flashes, and a grid over it as many places. A few rounds look the same in any code: a
short stretch is searched against the shortest code, and against rounds without dark slots, and only the places at which
the plan's own code has a round like those that were found are held against the whole stretch.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.model.maximal_length import TAPS
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat, train_between
from psvideo.sync.rowfit.coarse.search import GridPlace, clock_ratios_ppm, losses, search, turned_clocks
from psvideo.sync.rowfit.profiles import Profiles

SHORT_ROUNDS = 3
"""Rounds of the short stretch: the shortest code holds every pattern of this many rounds but the one without a dark
slot.
"""
ROUGH = 6
"""Places of either short search that are held against the code."""


def search_coded(
    plan: Plan, rows: Profiles, *, range_ppm: float, start: Beat, readout_known: bool, keep: int
) -> list[GridPlace]:
    """Return the best places of a coded plan, best first; parameters as ``search`` takes them."""
    round_s = plan.cycle_s / len(plan.dark_rounds)
    short = rows.take(slice(0, min(len(rows.value), int(SHORT_ROUNDS * round_s / rows.period_s) + 1)))
    lit = tuple(plan.flashes[slot] for slot in plan.lit_slots)
    found: list[GridPlace] = []
    for like in (replace(plan, dark_code=min(TAPS)), replace(plan, dark_code=0, flashes=lit)):
        rough = search(like, short, range_ppm=range_ppm, start=start, readout_known=readout_known, keep=ROUGH)
        for place in rough:
            found += _in_code(plan, like, rows, place.beat, range_ppm, turned=place.beat.upward and not readout_known)
    return sorted(found, key=lambda place: place.loss)[:keep]


def _in_code(
    plan: Plan, like: Plan, rows: Profiles, beat: Beat, range_ppm: float, *, turned: bool
) -> Iterator[GridPlace]:
    """Yield the places in the code at which a round begins where a beat of a likeness of the plan has one."""
    until_s = float(rows.frame_start_s[-1])
    seen = train_between(like, beat.clock, 0.0, until_s)
    round_starts_s = seen.start_s[seen.slot == like.lit_slots[0]]
    begins_s = float(round_starts_s[np.argmin(np.abs(round_starts_s - _middle_s(plan, rows)))])
    cycle = plan.train(0, len(plan.cycle_slots))
    places_s = cycle.start_s[cycle.slot == plan.lit_slots[0]]
    clocks = turned_clocks(begins_s - places_s, clock_ratios_ppm(plan, rows, range_ppm), begins_s)
    height = rows.place.max() + rows.place.min() + 1
    loss = losses(plan, rows, clocks, beat, place=height - 1 - rows.place if turned else rows.place)
    each = (loss.mean(axis=1) / len(rows.value)).reshape(-1, len(places_s))
    best = each.argmin(axis=0)
    for k in np.argsort(each.min(axis=0), kind="stable")[:2]:
        clock = clocks.at(int(best[k]) * len(places_s) + int(k))
        yield GridPlace(beat=replace(beat, clock=clock), loss=float(each[best[k], k]))


def _middle_s(plan: Plan, rows: Profiles) -> float:
    """Return the middle of the short stretch."""
    first: Doubles = rows.frame_start_s[:1]
    return float(first[0]) + 0.5 * SHORT_ROUNDS * plan.cycle_s / len(plan.dark_rounds)
