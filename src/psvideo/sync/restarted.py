"""A clip in which the strobe started again, or stopped: every part between is found as a clip by itself.

Where parts are cut is known roughly at first, by frames that no longer fit. Once a part is found, its strobe foretells
the frames beyond its ends, which shows where the cut belongs, and which frames beside it fit on either side.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

from psvideo.model.plan import Plan
from psvideo.sync.rowfit.coarse.seed import gain_of
from psvideo.sync.rowfit.fit import ClipFit
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.restarts import chapters, lit_stretches, reach
from psvideo.sync.rowfit.tracking.course import window_frames
from psvideo.sync.verdict.believed import believed_fit, doubtful
from psvideo.sync.verdict.refusal import nothing_to_find

RECUTS = 2
"""How often parts are cut again;"""
BESIDE = 2
"""they are where the strobe of one foretells this many frames of the next."""
MOST_TIMED = 0.5
"""A clip in parts is timed where this share of its frames lies in parts in which the strobe is found,"""
BEYOND_DOUBT = 0.9
"""or where the strobe takes away so much of these parts' robust loss, and leaves nothing to doubt in the plan."""

Part = tuple[slice, ClipFit | None]
"""A stretch of frames, and its fit where the strobe is found in it."""


def found_in_parts(plan: Plan, rows: Profiles) -> list[tuple[slice, ClipFit]]:
    """Return the frames of every part of a clip in which the strobe is found, and its fit; nothing where the strobe
    neither started again nor stopped, or is not found for sure. ``rows`` are laid out from the picture's top row."""
    return _found(plan, rows, chapters(plan, rows))


def found_beside_dark(plan: Plan, rows: Profiles) -> list[tuple[slice, ClipFit]]:
    """Return the same of the stretches of frames between which no flash lights any, nothing where all are lit."""
    return _found(plan, rows, lit_stretches(plan, rows))


def _found(plan: Plan, rows: Profiles, cuts: Sequence[slice]) -> list[tuple[slice, ClipFit]]:
    if len(cuts) < 2:
        return []
    parts = _judged(plan, rows, cuts)
    for _ in range(RECUTS):
        again = recut(plan, rows, parts)
        if again == [cut for cut, _ in parts]:
            break
        parts = _judged(plan, rows, again)
    sure = _trusted(plan, rows, parts)
    if sum(cut.stop - cut.start for cut, _ in sure) < MOST_TIMED * len(rows.value):
        sure = [one for one in sure if _beyond_doubt(plan, one[1])]
    return sure


def _beyond_doubt(plan: Plan, found: ClipFit) -> bool:
    return gain_of(found.rows, found.fit.rest) > BEYOND_DOUBT and not doubtful(plan, found)


def _judged(plan: Plan, rows: Profiles, cuts: Sequence[slice]) -> list[Part]:
    """Return the parts with the fits of those that are believed."""

    def found(cut: slice) -> ClipFit | None:
        part = rows.take(cut).windowed(window_frames(plan))
        verdict = None if nothing_to_find(plan, part) else believed_fit(plan, part)
        return verdict.found if verdict and verdict.believed else None

    return [(cut, found(cut)) for cut in cuts]


def recut(plan: Plan, rows: Profiles, parts: Sequence[Part]) -> list[slice]:
    """Return the parts' frames with each cut moved to where the strobe of the part before no longer foretells the
    picture, or that of the part after begins to. ``rows`` are all of the clip's."""
    at = [cut.start for cut, _ in parts[1:]]
    for n, ((before, one), (after, other)) in enumerate(pairwise(parts)):
        onward = reach(plan, rows, one, before, sign=1) if one else 0
        back = reach(plan, rows, other, after, sign=-1) if other else 0
        if onward >= BESIDE:
            at[n] += min(onward, after.stop - after.start - 1)
        elif back >= BESIDE:
            at[n] -= min(back, before.stop - before.start - 1)
    bounds = [0, *sorted(set(at)), len(rows.value)]
    return [slice(first, last) for first, last in pairwise(bounds)]


def _trusted(plan: Plan, rows: Profiles, parts: Sequence[Part]) -> list[tuple[slice, ClipFit]]:
    """Return the parts in which a strobe was found, without trust in frames beside a cut that fit on either side."""
    sure = []
    for n, (cut, found) in enumerate(parts):
        if found is None:
            continue
        before, after = (parts[k] if 0 <= k < len(parts) else None for k in (n - 1, n + 1))
        first = reach(plan, rows, before[1], before[0], sign=1) if before and before[1] else 0
        last = reach(plan, rows, after[1], after[0], sign=-1) if after and after[1] else 0
        places = found.track.index
        trusted = (
            max(found.trusted[0], int(places[min(first, len(places) - 1)])),
            min(found.trusted[1], int(places[max(len(places) - 1 - last, 0)])),
        )
        sure.append((cut, replace(found, trusted=trusted)))
    return sure
