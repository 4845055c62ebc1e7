"""Holes that only a subject that moves speaks for: brightnesses from before them no longer hold, so other lights fit.

Where frames are truly missing, flashes behind the hole light other rows or bear other names, however short the stretch
is in which brightnesses are held to be constant. So a hole must explain frames on both sides of it in short stretches,
too, each of which has brightnesses of its own.
"""

from dataclasses import replace

import numpy as np

from psvideo.model.arrays import Integers
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.compiled_profiles import unexplained
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import refined_beat
from psvideo.sync.rowfit.tracking.holes import MEMORY
from psvideo.sync.rowfit.tracking.losses import frame_losses
from psvideo.sync.rowfit.tracking.track import FrameTrack
from psvideo.sync.rowfit.unlit import lit_twins

SHORT, EACH = 12, 1.4
"""Frames of a short stretch, and how many there are at least for every brightness of a row."""
NEEDED = 0.8
"""A hole leaves less than this share of what frames leave without it: true ones left 0.02 to 0.36, and 0.57 to 0.78
before a wall that turned fast, false ones 1.3 to 1.8."""


def without_false_holes(plan: Plan, rows: Profiles, tracked: FrameTrack, seed: slice) -> FrameTrack:
    """Return the track without the holes that short stretches do not show, the nearest to the ``seed`` first.

    What was found of the clock behind such a hole is forgotten. Behind a lit frame that looks like the one before it a
    hole stays: that frame stands in for the missing one.
    """
    numbered, again = np.diff(rows.index), lit_twins(rows)[:-1]
    holes = np.flatnonzero((np.diff(tracked.index) > numbered) & ~again)
    middle = (seed.start + seed.stop) // 2
    for place in holes[np.argsort(np.abs(holes - middle), kind="stable")].tolist():
        extra = int(tracked.index[place + 1] - tracked.index[place] - numbered[place])
        whole = tracked.index.copy()
        if place >= middle:  # the seed's frames stay, which the clock fits
            whole[place + 1 :] -= extra
        else:
            whole[: place + 1] += extra
        parts = [_near(plan, rows, one, place) for one in (tracked.index, whole)]
        if min(float(np.diff(part.ends_s).min()) for part in parts) <= 0.0:
            continue  # a stretch of frames that all show one moment
        with_it, without = (_left(plan, part, tracked.beat) for part in parts)
        if with_it < NEEDED * without:
            continue
        at = tracked.at_s / rows.period_s
        known = at <= tracked.index[place] if place >= middle else at >= tracked.index[place + 1]
        tracked = replace(tracked, index=whole, at_s=tracked.at_s[known], late_s=tracked.late_s[known])
    return tracked


def _near(plan: Plan, rows: Profiles, index: Integers, place: int) -> Profiles:
    """Return the frames around a place in short stretches, each of which is where ``index`` (frame,) says."""
    near = slice(max(place + 1 - MEMORY, 0), place + 1 + MEMORY)
    length = max(SHORT, int(np.ceil(EACH * (len(plan.lit_slots) + 1))))
    return replace(rows, index=index).take(near).windowed(length)


def _left(plan: Plan, part: Profiles, beat: Beat) -> float:
    """Return how badly frames fit in their stretches."""
    there = refined_beat(plan, part, beat, steps=4, first_scale=0.1)
    return float(frame_losses(part, unexplained(plan, part, there)).sum())
