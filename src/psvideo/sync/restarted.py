"""A clip in which the strobe started again, or stopped: every part between is found as a clip by itself.

Where parts are cut is known roughly at first, by frames that no longer fit. Once a part is found, its strobe predicts
the frames beyond its ends, which shows where the cut belongs, and which frames beside it fit on either side.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from psvideo.model.plan import Plan
from psvideo.sync.rowfit.coarse.seed import Seed, gain_of
from psvideo.sync.rowfit.fit import ClipFit
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.restarts import chapters, lit_stretches, reach
from psvideo.sync.rowfit.tracking.course import window_frames
from psvideo.sync.verdict.believed import believed_fit, doubtful
from psvideo.sync.verdict.refusal import nothing_to_find

RECUTS = 2
"""How often parts are cut again."""
BESIDE = 2
"""Parts are cut again where the strobe of one predicts this many frames of the next."""
MOST_TIMED = 0.5
"""A clip in parts is timed where this share of its frames lies in parts in which the strobe is found,"""
MIXED = 6
"""A hole in this many of a part's frames beside a cut is none: they may show either strobe, or some of both."""
BEYOND_DOUBT = 0.9
"""or where the strobe takes away this share of these parts' robust loss, and leaves nothing to doubt in the plan."""

Part = tuple[slice, ClipFit | None]
"""A stretch of frames, and its fit where the strobe is found in it."""


def found_in_parts(plan: Plan, rows: Profiles, seed: Seed) -> list[tuple[slice, ClipFit]]:
    """Return the frames of every part of a clip in which the strobe is found, and its fit; nothing where the strobe
    neither started again nor stopped, or is not found for sure. ``rows`` are laid out from the picture's top row;
    ``seed`` is the whole clip's."""
    return _found(plan, rows, chapters(plan, rows, seed))


def found_beside_dark(plan: Plan, rows: Profiles) -> list[tuple[slice, ClipFit]]:
    """Return the same of the stretches of frames between which no flash lights any, nothing where all are lit."""
    return _found(plan, rows, lit_stretches(plan, rows))


def found_apart(plan: Plan, rows: Profiles, cuts: Sequence[int]) -> list[tuple[slice, ClipFit]]:
    """Return the same of the parts of a clip that begin at some frames, in order."""
    return _found(plan, rows, [slice(a, b) for a, b in pairwise([0, *cuts, len(rows.value)])])


def found_within(plan: Plan, rows: Profiles, frames: slice) -> list[tuple[slice, ClipFit]]:
    """Return some consecutive frames of a clip and their fit, nothing where the strobe is not found in them."""
    found = _judged_one(plan, rows, frames)
    return [(frames, found)] if found else []


def _found(plan: Plan, rows: Profiles, cuts: Sequence[slice]) -> list[tuple[slice, ClipFit]]:
    if len(cuts) < 2:
        return []
    parts = _judged(plan, rows, cuts)
    for _ in range(RECUTS):
        again = recut(plan, rows, parts)
        if again == [cut for cut, _ in parts]:
            break
        parts = _judged(plan, rows, again)
    sure = _trusted(plan, rows, [_shorn(plan, rows, part) for part in parts])
    if sum(cut.stop - cut.start for cut, _ in sure) < MOST_TIMED * len(rows.value):
        sure = [one for one in sure if beyond_doubt(plan, one[1])]
    return sure


def beyond_doubt(plan: Plan, found: ClipFit) -> bool:
    """Return whether the strobe takes nearly all of the robust loss away and leaves nothing to doubt in the plan."""
    return gain_of(found.rows, found.fit.rest) > BEYOND_DOUBT and not doubtful(plan, found)


def _judged(plan: Plan, rows: Profiles, cuts: Sequence[slice]) -> list[Part]:
    """Return the parts with the fits of those that are believed."""

    return [(cut, _judged_one(plan, rows, cut)) for cut in cuts]


def _judged_one(plan: Plan, rows: Profiles, cut: slice) -> ClipFit | None:
    part = rows.take(cut).windowed(window_frames(plan))
    verdict = None if nothing_to_find(plan, part) else believed_fit(plan, part)
    return verdict.found if verdict and verdict.believed else None


def _shorn(plan: Plan, rows: Profiles, part: Part) -> Part:
    """Return a part without its frames between a cut and a hole or a repeat near it, and the fit of the others.

    The frame in which one strobe ends and the other begins fits neither, but somewhere among all places that missing
    frames allow it fits by chance.
    """
    for _ in range(MIXED):
        cut, found = part
        if found is None:
            break
        kept = _between_holes(rows, cut, found)
        if kept == cut:
            break
        part = kept, _judged_one(plan, rows, kept)
    return part


def _between_holes(rows: Profiles, cut: slice, found: ClipFit) -> slice:
    """Return a part's frames but for those that holes or repeats separate from it near a cut."""
    numbered = np.diff(rows.index[cut])
    holes = (cut.start + 1 + np.flatnonzero(np.diff(found.track.index) != numbered)).tolist()
    early = [one for one in holes if cut.start > 0 and one <= cut.start + MIXED]
    late = [one for one in holes if cut.stop < len(rows.value) and one >= cut.stop - MIXED]
    return slice(max(early, default=cut.start), min(late, default=cut.stop))


def recut(plan: Plan, rows: Profiles, parts: Sequence[Part]) -> list[slice]:
    """Return the parts' frames with each cut moved to where the strobe of the part before no longer predicts the
    picture, or that of the part after begins to. ``rows`` are all of the clip's."""
    at = [cut.start for cut, _ in parts[1:]]
    for n, (one, other) in enumerate(pairwise(parts)):
        (before, _), (after, _) = one, other
        onward, back = _foretold(plan, rows, one, sign=1), _foretold(plan, rows, other, sign=-1)
        if onward >= BESIDE:
            at[n] += min(onward, after.stop - after.start - 1)
        elif back >= BESIDE:
            at[n] -= min(back, before.stop - before.start - 1)
    bounds = [0, *sorted(set(at)), len(rows.value)]
    return [slice(first, last) for first, last in pairwise(bounds)]


def _foretold(plan: Plan, rows: Profiles, part: Part, *, sign: int) -> int:
    """Return how many frames beyond a part's end, or before its beginning, its strobe predicts; 0 without one."""
    cut, found = part
    return reach(plan, rows, found, cut, sign=sign) if found else 0


def _trusted(plan: Plan, rows: Profiles, parts: Sequence[Part]) -> list[tuple[slice, ClipFit]]:
    """Return the parts in which a strobe was found, without trust in frames beside a cut that fit on either side."""
    sure = []
    for n, (cut, found) in enumerate(parts):
        if found is None:
            continue
        before, after = (parts[k] if 0 <= k < len(parts) else None for k in (n - 1, n + 1))
        first = _foretold(plan, rows, before, sign=1) - (cut.start - before[0].stop) if before else 0
        last = _foretold(plan, rows, after, sign=-1) - (after[0].start - cut.stop) if after else 0
        places = found.track.index
        trusted = (
            max(found.trusted[0], int(places[min(max(first, 0), len(places) - 1)])),
            min(found.trusted[1], int(places[max(len(places) - 1 - max(last, 0), 0)])),
        )
        sure.append((cut, replace(found, trusted=trusted)))
    return sure
