"""Breaks that a fit bridges by missing or repeated frames or by the dark, though the strobe moved there.

With enough missing frames nearly any move can be told as one, but for a rest of a few rows, which a clock that bends
takes up. Under a clock that runs straight across the break the rest shows: the frames of one side then fit better a
little earlier or later than whole frames put them, and by far more than these times may be wrong.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from psvideo.model.arrays import Doubles, Integers
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.compiled_profiles import unexplained
from psvideo.sync.rowfit.fit import ClipFit
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import Fit, refine, refined_beat, robust_loss
from psvideo.sync.rowfit.tracking.course import TRACK_ROWS
from psvideo.sync.rowfit.tracking.losses import frame_losses

FEW = 3
"""More frames that are missing (or repeated) in one place can stand for nearly any move."""
PAUSE = 2
"""So many, of which some are repeated, can stand for a strobe that paused: its frames in the dark look alike."""
LONE = 2
"""Up to this many frames beyond such a place may fit somewhere by chance."""
LEAST, NEAR = 6, 36
"""Frames between two breaks that show where they are in time, and how many beside a break are asked."""
MOST_BREAKS = 6
"""Where more breaks are, the camera loses frames, or nothing is right."""
PARTS = 24
"""Moves are tried in steps of the shortest flash over this, up to a flash either way: farther off, whole frames fit
no better than any place does."""
FAR_PARTS = 3
"""After a pause they are tried all over the cycle, in steps of the shortest flash over this, and then near."""
CLOSER, TURNS = 4.0, 5
"""Then nearer, each time in steps that are smaller by the first, as often as the second says."""
CLEARLY, LESS = 50.0, 0.87
"""A move is believed that leaves this much less of the robust loss, and less than this share of it,"""
SURE = 10.0
"""and that is larger than this many standard errors of the times, which it makes up from two sides."""
TICKS = 1_000_000
"""Places in time between frames are counted in this many parts of a frame."""


def moved(rows: Profiles, shift_s: float, frames: slice = slice(None)) -> Profiles:
    """Return the profiles as if some of their frames had come later."""
    index = rows.index * TICKS
    index[frames] += round(shift_s / rows.period_s * TICKS)
    return replace(rows, index=index, period_s=rows.period_s / TICKS)


@dataclass(frozen=True, kw_only=True)
class _Break:
    """Two runs of frames that follow one another, by their places among those that were fitted, with a break or some
    near one another between them. ``paused``: no flash was seen there for a while, so that the strobe may go on
    anywhere in its cycle."""

    before: slice
    after: slice
    paused: bool


def moved_at_breaks(plan: Plan, found: ClipFit, silent: Sequence[tuple[int, int]] = ()) -> list[int]:
    """Return the first frames, in order, after those of a clip at which the strobe moved by what no missing frames
    explain, though the fit has many missing or repeated there, or goes on across a pause.

    ``silent`` are the first and last places in time of frames in which the fit's flashes did not fire.
    """
    fitted = np.flatnonzero(~found.track.repeated & ~found.unlit)
    if len(fitted) != len(found.rows.value):
        return []
    breaks = list(_breaks(found, fitted, silent))
    if len(breaks) > MOST_BREAKS:
        return []
    rows = replace(found.rows.one_window(), restless=None)
    return [int(fitted[one.before.stop - 1]) + 1 for one in breaks if _moved_there(plan, rows, found.fit.beat, one)]


def between_lone_ends(found: ClipFit) -> slice | None:
    """Return a clip's frames but for one or two lit ones at an end, with those in the dark beyond, that many missing
    frames part from the others; None where there are none.

    A strobe that stops within a frame leaves one that fits somewhere by chance. Where many frames
    within are told as repeated ones, they show something else, and nothing is said of the ends.
    """
    index = found.track.index
    fitted = np.flatnonzero(~found.track.repeated & ~found.unlit)
    holes = np.flatnonzero(np.diff(index[fitted]) - np.diff(fitted) > FEW) + 1
    early, late = holes[holes <= LONE], holes[holes >= len(fitted) - LONE]
    first = int(fitted[early[-1]]) if len(early) else 0
    end = int(fitted[late[0]]) if len(late) else len(index)
    nothing = end - first == len(index) or np.count_nonzero(found.track.repeated[first:end]) > FEW
    return None if nothing else slice(first, end)


def _breaks(found: ClipFit, fitted: Integers, silent: Sequence[tuple[int, int]]) -> Iterator[_Break]:
    """Yield the breaks that many missing or repeated frames bridge, or the dark; ``fitted`` (frame,) are the frames
    that were fitted."""
    index = found.track.index[fitted]
    jumps = np.diff(index - fitted)
    dark = np.diff(np.cumsum(found.unlit)[fitted]) > 0
    lost = np.zeros(len(fitted), np.bool_)
    for first, last in silent:
        lost |= (index >= first) & (index <= last)
    dark |= lost[1:] | lost[:-1]
    edges = [0, *(np.flatnonzero((jumps != 0) | dark) + 1).tolist(), len(fitted)]
    runs = [slice(a, b) for a, b in pairwise(edges) if b - a >= LEAST and not lost[a]]
    for before, after in pairwise(runs):
        between = slice(before.stop - 1, after.start)
        moves = np.abs(jumps[between])
        paused = dark[between].any() or (jumps[between].min() < 0 and moves.sum() >= PAUSE)
        if paused or moves.max() > FEW:
            yield _Break(
                before=slice(max(before.start, before.stop - NEAR), before.stop),
                after=slice(after.start, min(after.stop, after.start + NEAR)),
                paused=bool(paused),
            )


def _moved_there(plan: Plan, rows: Profiles, beat: Beat, at: _Break) -> bool:
    """Return whether the frames of one side fit clearly better earlier or later, under a clock that runs straight."""
    part = _both_sides(rows, at)
    cut, count = at.before.stop - at.before.start, len(part.value)
    late = slice(cut, count) if cut >= count - cut else slice(0, cut)
    straight = replace(beat, clock=replace(beat.clock, knot_s=(), bend_s=()))
    few = part.binned(TRACK_ROWS)
    known = slice(0, cut) if late.start else slice(cut, count)
    near = refined_beat(plan, few.take(known), straight, steps=4, first_scale=0.1)
    shift_s, apart = _best_move(plan, part, few, late, near, _tried_s(plan, near, anywhere=at.paused))
    whole = refine(plan, moved(part, 0.0), straight, steps=8, first_scale=0.1)
    left, leaves = (robust_loss(part, one.rest, apart.rest) for one in (whole, apart))
    clearly = leaves < min(left - CLEARLY, LESS * left)
    return clearly and abs(shift_s) > SURE * max(apart.shift_error_s, 0.0)


def _both_sides(rows: Profiles, at: _Break) -> Profiles:
    frames = np.r_[at.before, at.after]
    doubt = None if rows.doubt is None else np.ascontiguousarray(rows.doubt[frames])
    return replace(rows, value=np.ascontiguousarray(rows.value[frames]), index=rows.index[frames], doubt=doubt)


def _tried_s(plan: Plan, beat: Beat, *, anywhere: bool) -> Doubles:
    """Return the moves to try first: up to a flash either way, or all over the cycle."""
    flash_s = plan.shortest_flash_s
    near_s = np.arange(-PARTS, PARTS + 1) / PARTS * flash_s
    return (
        np.append(near_s, np.arange(0.0, plan.cycle_s * beat.clock.rate, flash_s / FAR_PARTS)) if anywhere else near_s
    )


def _best_move(
    plan: Plan, rows: Profiles, few: Profiles, late: slice, near: Beat, tried_s: Doubles
) -> tuple[float, Fit]:
    """Return by how much later the frames ``late`` fit best, of some moves and what is near, and the fit then. ``near``
    is the others' beat, and ``few`` are the rows averaged to fewer."""
    flash_s = plan.shortest_flash_s

    def left(shift_s: float) -> float:
        return float(frame_losses(few, unexplained(plan, moved(few, shift_s, late), near)).sum())

    far_s = min(tried_s.tolist(), key=left)
    shift_s = min((far_s + np.arange(-PARTS, PARTS + 1) / PARTS / FAR_PARTS * flash_s).tolist(), key=left)
    fit = refine(plan, moved(rows, shift_s, late), near, steps=6, first_scale=0.1)
    step_s = flash_s / PARTS / FAR_PARTS
    for _ in range(TURNS):
        losses = [_loss_at(plan, moved(rows, shift_s + one, late), fit) for one in (-step_s, 0.0, step_s)]
        curve = losses[0] - 2 * losses[1] + losses[2]
        pull = 0.5 * (losses[0] - losses[2]) / curve if curve > 0 else float(np.sign(losses[0] - losses[2]))
        shift_s += float(np.clip(pull, -1.0, 1.0)) * step_s
        fit = refine(plan, moved(rows, shift_s, late), fit.beat, steps=4, first_scale=0.01)
        step_s /= CLOSER
    return shift_s, fit


def _loss_at(plan: Plan, rows: Profiles, fit: Fit) -> float:
    beat = refined_beat(plan, rows, fit.beat, steps=4, first_scale=0.01)
    return robust_loss(rows, unexplained(plan, rows, beat), fit.rest)
