"""The clip's first and last frames, beyond which nothing shows where they are: a hole there gets a search of its own.

Tracking believes in a hole once the frames on either side of it agree. One or two frames at an end are too few for
that, but they still fit one place in time, or none; where they fit none, the flashes in them are not to be trusted.
"""

from dataclasses import dataclass, replace

import numpy as np

from psvideo.model.camera import FloatArray
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.profiles import Profiles, brightnesses
from psvideo.sync.rowfit.row_model import IntArray
from psvideo.sync.rowfit.track import MEMORY, MOST, SUSPICIOUS, losses_of

AT_END = 2
"""Frames at either end that are looked at."""
BEFORE = 4
"""Frames before those, by which it is judged how well frames are foretold at all."""
ODD = 2.0
"""An end is odd where it is foretold so many times worse than the frames before it, and worse by ``SUSPICIOUS``."""


@dataclass(frozen=True, kw_only=True)
class ClipEnds:
    """Where the frames are in time, ``index`` (frame,), and how many at either end fit no place at all."""

    index: IntArray
    lost_first: int
    lost_last: int


def ends(plan: Plan, rows: Profiles, index: IntArray, beat: Beat) -> ClipEnds:
    """Return the places in time (frame,) with holes beside the first and the last frames found."""
    if len(index) < MEMORY + BEFORE + AT_END:
        return ClipEnds(index=index, lost_first=0, lost_last=0)
    last, lost_last = _end(plan, rows, index, beat)
    turned = replace(rows, value=np.ascontiguousarray(rows.value[::-1]))
    first, lost_first = _end(plan, turned, last[::-1], beat)
    return ClipEnds(index=first[::-1].copy(), lost_first=lost_first, lost_last=lost_last)


def _end(plan: Plan, rows: Profiles, index: IntArray, beat: Beat) -> tuple[IntArray, int]:
    """Return the places with the end of the arrays put where it fits, and how many frames there fit nowhere."""
    onward = int(np.sign(index[-1] - index[0]))
    odd = 0
    for count in range(1, AT_END + 1):
        known = slice(len(index) - count - MEMORY, len(index) - count)
        bar = _bar(plan, rows, index, beat, known)
        if (_fits(plan, rows, index, beat, known, index[-count:]) < bar).any():
            break
        odd = count
    if not odd:
        return index, 0
    known = slice(len(index) - odd - MEMORY, len(index) - odd)
    bar = _bar(plan, rows, index, beat, known)
    tried = np.array(
        [_fits(plan, rows, index, beat, known, index[-odd:] + onward * extra).max() for extra in range(1, MOST + 1)]
    )
    if (tried < bar).sum() != 1:
        return index, odd
    moved = index.copy()
    moved[-odd:] += onward * (1 + int(tried.argmin()))
    return moved, 0


def _bar(plan: Plan, rows: Profiles, index: IntArray, beat: Beat, known: slice) -> float:
    """Return the loss from which on frames after the known ones are odd, by how the last of those are foretold."""
    learnt = slice(known.start, known.stop - BEFORE)
    usual = float(_fits(plan, rows, index, beat, learnt, index[known.stop - BEFORE : known.stop]).max())
    return max(ODD * usual, usual + SUSPICIOUS)


def _fits(plan: Plan, rows: Profiles, index: IntArray, beat: Beat, known: slice, places: IntArray) -> FloatArray:
    """Return how badly the frames after the known ones fit some places in time, shape (place,)."""
    learnt = _ordered(rows, index, known)
    light = brightnesses(plan, learnt, beat)
    after = replace(rows.one_window(), value=rows.value[known.stop : known.stop + len(places)])
    found = np.empty(len(places))
    for n, place in enumerate(places):
        asked = replace(after, value=np.ascontiguousarray(after.value[n : n + 1]), index=np.array([place], np.int64))
        found[n] = losses_of(plan, learnt, asked, beat, light)[0]
    return found


def _ordered(rows: Profiles, index: IntArray, frames: slice) -> Profiles:
    """Return some frames in the order of time."""
    order = np.argsort(index[frames], kind="stable")
    value = np.ascontiguousarray(rows.value[frames][order])
    return replace(rows.one_window(), value=value, index=index[frames][order], doubt=None)
