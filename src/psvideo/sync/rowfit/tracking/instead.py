"""Flashes that never fired, or a black frame, beside a dark slot: what is dark looks repeated, and is not.

Taken for repeated, it leaves its own place in time empty, or the next frame's: repeats and holes that cancel within a
few frames. Where a few missing flashes in a row, or one black frame, explain these frames as well at the places that
numbering gives them, it is that.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from psvideo.model.arrays import Doubles, Integers
from psvideo.model.plan import Plan
from psvideo.sync.rowfit import row_model
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.compiled_profiles import brightnesses, compiled_flashes, compiled_rows
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.tracking.holes import MEMORY, NATURAL
from psvideo.sync.rowfit.tracking.losses import frame_losses
from psvideo.sync.rowfit.tracking.track import FrameTrack
from psvideo.sync.rowfit.unlit import lit_twins

LONGEST = 6
"""Frames at most that holes and repeats displace until they have cancelled one another."""
MOST_MISSING = 3
"""Flashes in a row that may all be missing, dark slots between them not counted."""
BESIDE = 2
"""Frames on either side that may see some of the same flash."""


def without_false_repeats(plan: Plan, rows: Profiles, tracked: FrameTrack) -> FrameTrack:
    """Return the track with frames that were taken for repeated at their own places where a flash that never fired,
    or a black frame, explains them as well. Lit ones that look exactly like those before them stay repeated."""
    index, again = tracked.index, lit_twins(rows)
    for stretch in _cancelled(index, rows.index):
        if again[stretch].any():
            continue
        own = rows.index[stretch] - rows.index[stretch.start - 1] + index[stretch.start - 1]
        moved = index.copy()
        moved[stretch] = own
        if _as_well(plan, rows, tracked.beat, index, moved, stretch):
            index = moved
    return replace(tracked, index=index)


def _cancelled(index: Integers, numbered: Integers) -> Iterator[slice]:
    """Yield the stretches of frames that are displaced between holes and repeats that cancel one another.

    ``more`` is by how much frames lie later than their numbers say. A dark slot and two flashes that never fired, all
    of it dark, taken for a hole of 2 and two frames that are repeated (below), or for two repeats and a hole of 2::

        frame     23  24  25  26  27  28
        numbered  23  24  25  26  27  28
        index     23  24  27  27  27  28
        more       0   0   2   1   0   0
                      [ 25, 26 ]            are displaced; from 27 on all is as before
    """
    more = index - numbered
    for before in np.flatnonzero(np.diff(more)).tolist():
        onward = slice(before + 1, before + 2 + LONGEST)
        back = np.flatnonzero(more[onward] == more[before])
        if len(back):
            stretch = slice(before + 1, before + 1 + int(back[0]))
            if (np.diff(index[before : stretch.stop + 1]) == 0).any():
                yield stretch


def _as_well(plan: Plan, rows: Profiles, beat: Beat, index: Integers, moved: Integers, stretch: slice) -> bool:
    """Return whether frames fit as well at the places ``moved`` once flashes in a row that they see, or a frame, are
    left out."""
    near = slice(max(stretch.start - MEMORY, 0), min(stretch.stop + MEMORY, len(index)))
    asked = slice(max(stretch.start - BESIDE, near.start), min(stretch.stop + BESIDE, near.stop))
    at = slice(asked.start - near.start, asked.stop - near.start)
    found, other = (replace(rows.one_window(), index=places).take(near) for places in (index, moved))
    trust = np.ones_like(found.value)
    trust[at] = 1e-6
    light = brightnesses(plan, found, beat, trust)
    flashes = compiled_flashes(plan, found, beat)
    left = _left(found, _shown(found, beat, flashes, light))[at].sum()
    lit = np.flatnonzero(flashes.unknown)
    first_s, last_s = other.frame_start_s[at][[0, -1]]
    seen = lit[(flashes.start_s[lit] > first_s - rows.period_s) & (flashes.start_s[lit] < last_s + 2 * rows.period_s)]
    runs = [seen[n : n + count] for count in range(1, MOST_MISSING + 1) for n in range(len(seen) + 1 - count)]
    tried = [_shown(other, beat, _dark(flashes, run), light) for run in runs]
    tried += [_black(_shown(other, beat, flashes, light), n) for n in range(at.start, at.stop)]
    return bool(min(_left(other, shown)[at].sum() for shown in tried) < left + NATURAL)


def _dark(flashes: row_model.Flashes, run: Integers) -> row_model.Flashes:
    unknown = flashes.unknown.copy()
    unknown[run] = 0
    return flashes._replace(unknown=unknown)


def _black(shown: Doubles, frame: int) -> Doubles:
    black = shown.copy()
    black[frame] = 0.0
    return black


def _shown(rows: Profiles, beat: Beat, flashes: row_model.Flashes, light: Doubles) -> Doubles:
    """Return what known brightnesses predict under some flashes, shape (frame, row)."""
    found = np.empty_like(rows.value)
    row_model.predictions(compiled_rows(rows, beat), flashes, light, 0, rows.value.shape[1], found)
    return found


def _left(rows: Profiles, shown: Doubles) -> Doubles:
    """Return how badly frames fit what was predicted, shape (frame,)."""
    return frame_losses(rows, rows.value - shown)
