"""From which frame on a strobe that was found is seen: frames before it, in the dark, may stand among those searched.

The finder counts time from the first frame that it is given. Where the strobe was started among these frames, its clock
runs backwards into the dark, and flashes of which no frame shows anything would be listed there.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from psvideo.live.following.lock import Lock
from psvideo.live.following.window import HeldFrame, window_of
from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.compiled_profiles import brightnesses
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.tracking.losses import SUSPICIOUS, losses_of


def first_shown(plan: Plan, lock: Lock, values: Sequence[Doubles], doubts: Sequence[Doubles | None]) -> int:
    """Return the place in time of the first frame that flashes explain better than darkness does.

    ``values`` and ``doubts`` are the profiles (row,) of the frames in which the lock was found, one for each of its
    places. Where no frame is explained so, the first one's place.
    """
    rows = _in_order(plan, lock, values, doubts)
    begin = int(np.searchsorted(rows.index, lock.trusted_from))
    learnt = rows.take(slice(begin, len(rows.index))).one_window()
    light = brightnesses(plan, learnt, lock.beat)
    dark = light.copy()
    dark[:, 1 : 1 + len(plan.lit_slots)] = 0.0
    shown, unlit = (losses_of(plan, learnt, rows, lock.beat, one) for one in (light, dark))
    explained = shown + SUSPICIOUS < unlit
    return int(rows.index[explained.argmax()])


def _in_order(plan: Plan, lock: Lock, values: Sequence[Doubles], doubts: Sequence[Doubles | None]) -> Profiles:
    """Return the profiles of the frames as the follower's window lays them out; of repeated ones the first."""
    window = replace(window_of(plan, lock.beat), memory=len(values), frames=deque(), changes=[])
    places = lock.places.tolist()
    for before, place, value, doubt in zip((None, *places), places, values, doubts, strict=False):
        if place != before:
            window.add(HeldFrame(place=place, value=value, doubt=doubt))
    return window.profiles()
