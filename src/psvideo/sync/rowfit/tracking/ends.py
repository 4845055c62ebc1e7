"""The clip's first and last frames, beyond which nothing shows where they are: a hole there gets a search of its own.

Tracking believes in a hole once the frames on either side of it agree. A few frames at an end are too few for that, but
they still fit one place in time, or none; where they fit none, the flashes in them are not to be trusted.
"""

from dataclasses import dataclass, replace

import numpy as np

from psvideo.model.arrays import Doubles, Integers
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.compiled_profiles import brightnesses
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.tracking.holes import MEMORY
from psvideo.sync.rowfit.tracking.losses import SUSPICIOUS, losses_of
from psvideo.sync.rowfit.tracking.misfires import losses_but_for_misfires
from psvideo.sync.rowfit.tracking.steps_ahead import MOST

AT_END = 6
"""Frames at either end that are looked at."""
BEFORE = 4
"""Frames before those, by which it is judged how well frames are predicted at all."""
LEAST_KNOWN = 12
"""Fewer frames than this predict nothing; nor do fewer than two for every light."""
ODD = 2.0
"""An end is odd where its frames are predicted this many times worse than those before it, and worse by ``SUSPICIOUS``.
A place is the right one where all others fit this many times worse, and nearer ones also this many times worse than
usual: short holes are likelier than long ones."""


@dataclass(frozen=True, kw_only=True)
class ClipEnds:
    """Where the frames are in time, ``index`` (frame,), and how many at either end fit no place at all."""

    index: Integers
    lost_first: int
    lost_last: int


def ends(plan: Plan, rows: Profiles, index: Integers, beat: Beat) -> ClipEnds:
    """Return the places in time (frame,) with holes beside the first and the last frames found."""
    last, lost_last = _end(plan, rows, index, beat)
    turned = replace(rows, value=np.ascontiguousarray(rows.value[::-1]))
    first, lost_first = _end(plan, turned, last[::-1], beat)
    return ClipEnds(index=first[::-1].copy(), lost_first=lost_first, lost_last=lost_last)


def _end(plan: Plan, rows: Profiles, index: Integers, beat: Beat) -> tuple[Integers, int]:
    """Return the places with the end of the arrays put where it fits, and how many frames there fit nowhere.

    From the inside outwards, so that nothing is predicted from frames that are odd themselves. A frame in the dark that
    was taken for a repeat of the one before it may as well be a later one in the dark.
    """
    onward = int(np.sign(index[-1] - index[0]))
    room = len(index) - BEFORE - max(LEAST_KNOWN, 2 * (len(plan.lit_slots) + 1))
    for count in range(min(AT_END, room), 0, -1):
        known = slice(max(len(index) - count - MEMORY, 0), len(index) - count)
        usual = _usual(plan, rows, index, beat, known)
        bar = max(ODD * usual, usual + SUSPICIOUS)
        own = _fits_as_numbered(plan, rows, index, beat, known)
        repeated = bool(index[-count] == index[-count - 1])
        if own[0] < bar and not repeated:
            continue
        places = [index[-count:] + onward * extra for extra in range(1, MOST + 1)]
        worst = np.array([own.max(), *(_fits(plan, rows, index, beat, known, place).max() for place in places)])
        best = int(worst.argmin())
        nearer, farther = worst[:best], worst[best + 1 :]
        if worst[best] < bar and (nearer > ODD * max(worst[best], usual)).all() and (farther > ODD * worst[best]).all():
            moved = index.copy()
            moved[-count:] += onward * best
            return moved, 0
        if repeated or (own >= bar).all():
            return index, count
    return index, 0


def _usual(plan: Plan, rows: Profiles, index: Integers, beat: Beat, known: slice) -> float:
    """Return how badly the last of the known frames are predicted by those before them."""
    learnt = slice(known.start, known.stop - BEFORE)
    return float(_fits(plan, rows, index, beat, learnt, index[known.stop - BEFORE : known.stop]).max())


def _fits_as_numbered(plan: Plan, rows: Profiles, index: Integers, beat: Beat, known: slice) -> Doubles:
    """Return how badly all frames after the known ones fit their own places, shape (frame,), but for flashes that did
    not fire while later ones did."""
    learnt = _ordered(rows, index, known)
    light, onward = brightnesses(plan, learnt, beat), index[-1] > index[0]
    asked = _ordered(rows, index, slice(known.stop, len(index)))
    found = np.empty(len(asked.value))
    order = np.argsort(index[known.stop :], kind="stable")
    found[order] = losses_but_for_misfires(plan, learnt, asked, beat, light, beyond=(bool(onward), not onward))
    return found


def _fits(plan: Plan, rows: Profiles, index: Integers, beat: Beat, known: slice, places: Integers) -> Doubles:
    """Return how badly the frames after the known ones fit some places in time, shape (place,)."""
    learnt = _ordered(rows, index, known)
    light = brightnesses(plan, learnt, beat)
    after = replace(rows.one_window(), value=rows.value[known.stop : known.stop + len(places)])
    found = np.empty(len(places))
    for n, place in enumerate(places):
        asked = replace(after, value=np.ascontiguousarray(after.value[n : n + 1]), index=np.array([place], np.int64))
        found[n] = losses_of(plan, learnt, asked, beat, light)[0]
    return found


def _ordered(rows: Profiles, index: Integers, frames: slice) -> Profiles:
    """Return some frames in the order of time."""
    order = np.argsort(index[frames], kind="stable")
    value = np.ascontiguousarray(rows.value[frames][order])
    return replace(rows.one_window(), value=value, index=index[frames][order], doubt=None)
