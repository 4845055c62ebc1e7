"""Where holes are and which frames repeat, decided again when frames on both sides of them are known."""

from dataclasses import replace

import numpy as np

from psvideo.model.arrays import Doubles, Integers, Mask
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.compiled_profiles import brightnesses, unexplained
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.tracking.losses import SUSPICIOUS, frame_losses, losses_of
from psvideo.sync.rowfit.tracking.steps_ahead import due
from psvideo.sync.rowfit.tracking.track import FrameTrack
from psvideo.sync.rowfit.unlit import copies, lit_twins

NATURAL = 0.1
"""A frame that looks like the one before it is repeated only where its own place in time fits worse by this much."""
LONG_BLOCK = 64
"""Frames whose repeats are decided at a time."""
MEMORY, NEAR = 24, 10
"""Frames on either side of a hole that show where it is, and how far from where it was found it may be."""


def settled(plan: Plan, rows: Profiles, index: Integers, beat: Beat) -> tuple[Integers, Mask]:
    """Return the frames' places with every hole moved to where it explains the frames around it best, and the frames
    (frame,) that may as well lie on the other side of one.

    While tracking, frames beside a hole are judged by brightnesses from one side only; here from both. Behind a lit
    frame that looks like the one before it a hole stays where it is: that frame stands in for the missing one.
    """
    index, unsure = index.copy(), np.zeros(len(index), np.bool_)
    numbered, again = np.diff(rows.index), lit_twins(rows)[:-1]
    for place in np.flatnonzero((np.diff(index) > numbered) & ~again).tolist():
        extra = int(index[place + 1] - index[place] - numbered[place])
        first, last = max(place + 1 - MEMORY, 0), min(place + 1 + MEMORY, len(index))
        tried = {}
        for start in range(max(place + 1 - NEAR, first + 1), min(place + 1 + NEAR, last - 1) + 1):
            moved = index.copy()
            moved[min(start, place + 1) : max(start, place + 1)] += extra * int(np.sign(place + 1 - start))
            if (np.diff(moved) < 0).any():
                continue
            part = replace(rows, index=moved).take(slice(first, last)).one_window()
            tried[start] = (float(frame_losses(part, unexplained(plan, part, beat)).sum()), moved)
        least, index = min(tried.values(), key=lambda pair: pair[0])
        alike = [start for start, (loss, _) in tried.items() if loss < least + SUSPICIOUS]
        unsure[min(alike) : max(alike)] = True
    return index, unsure


def with_repeats(plan: Plan, rows: Profiles, tracked: FrameTrack, kept: Mask) -> FrameTrack:
    """Return the track of all frames from that of those that were ``kept`` (frame,).

    A frame that was left out takes the place of the one before it, unless its own place is free and fits as well: dark
    slots that follow one another look alike, too. A copy of the frame before it is one wherever another flash was due:
    lights may be alike in all rows but those that hold a flash's beginning.
    """
    if kept.all():
        return tracked
    again = copies(rows)
    last = np.maximum.accumulate(np.where(kept, np.arange(len(kept)), 0))
    index = tracked.index[np.cumsum(kept) - 1]
    own = index + rows.index - rows.index[last]
    following = np.append(tracked.index[1:], own[-1] + 1)[np.cumsum(kept) - 1]
    for first in range(0, len(kept), LONG_BLOCK):
        block = slice(first, min(first + LONG_BLOCK, len(kept)))
        open_places = ~kept[block] & (own[block] < following[block])
        if open_places.any():
            there, here = (_fits(plan, rows, tracked, kept, block, places) for places in (own, index))
            natural = open_places & (there < here + NATURAL)
            natural &= ~(again[block] & due(plan, replace(rows, index=own).take(block), tracked.beat, 1))
            index[block] = np.where(natural, own[block], index[block])
    return replace(tracked, index=np.maximum.accumulate(index))


def _fits(plan: Plan, rows: Profiles, tracked: FrameTrack, kept: Mask, block: slice, places: Integers) -> Doubles:
    """Return how badly frames fit at some places in time, shape (frame of the block,), by the frames around them."""
    near = slice(max(block.start - MEMORY, 0), min(block.stop + MEMORY, len(kept)))
    known = np.cumsum(kept)[near][kept[near]] - 1
    learnt = replace(
        rows.one_window(), value=np.ascontiguousarray(rows.value[near][kept[near]]), index=tracked.index[known]
    )
    light = brightnesses(plan, learnt, tracked.beat)
    asked = replace(rows.one_window(), value=rows.value[block], index=places[block])
    return losses_of(plan, learnt, asked, tracked.beat, light)
