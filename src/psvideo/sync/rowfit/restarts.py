"""Restarts: between two frames the strobe jumps in its cycle, by a time that missing frames do not explain.

A camera that drops frames moves time by whole frames; a strobe that is started again, skips a flash, or waits for one
that was late moves by anything. What frames on both sides show tells the two apart, unless the strobe happens to move
by whole frames: then the picture is the same, and so are all flashes within it. A clip that holds a restart is two
clips, each with a phase of its own; ``chapters`` says where to cut.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from psvideo.model.arrays import Doubles, Mask
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.coarse.retime import stood_in
from psvideo.sync.rowfit.coarse.seed import Seed, renumbered
from psvideo.sync.rowfit.coarse.seed_choice import find_seed
from psvideo.sync.rowfit.compiled_profiles import brightnesses, unexplained
from psvideo.sync.rowfit.fit import ClipFit
from psvideo.sync.rowfit.leaps import FINE_PARTS, LEAST_AFTER, leap
from psvideo.sync.rowfit.moved_at_breaks import TICKS, moved
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import refined_beat
from psvideo.sync.rowfit.strobed import lost_somewhere, shows_strobe
from psvideo.sync.rowfit.tracking.course import TRACK_ROWS, memory_frames
from psvideo.sync.rowfit.tracking.holes import MEMORY, settled
from psvideo.sync.rowfit.tracking.losses import SUSPICIOUS, frame_losses, losses_of
from psvideo.sync.rowfit.tracking.steps_ahead import HOLDS
from psvideo.sync.rowfit.tracking.track import FrameTrack, track
from psvideo.sync.rowfit.unlit import still, unlit

MOST_RESTARTS = 3
"""Where a strobe seems to restart more often than this, the plan is another one, or the subject moves."""
APART = 0.1
"""Beside a hole, flashes that come earlier or later than it says by this share of the shortest one have moved."""
HALVES = 0.5
"""The move must leave less than this share of the frames' losses where the clock is fitted to all of them again."""
FORETOLD = 0.25
"""A fit that leaves less than this share of the squared changes of a picture that hardly changes foretells them: of
mere noise it leaves nearly half."""
ODD_RUN = 8
"""The strobe may have restarted where the median loss of this many frames in a row is odd."""


def may_restart(plan: Plan, rows: Profiles, found: ClipFit) -> bool:
    """Return whether a clip stands still for long, or its fit needs holes, or leaves frames in a row as only a strobe
    elsewhere in its cycle or none at all does."""
    if found.steps > 0 or _stands_still(plan, rows, found) or lost_somewhere(plan, found):
        return True
    return odd_somewhere(found)


def dark_within(found: ClipFit) -> bool:
    """Return whether frames that no flash lights stand between others: the strobe may go on elsewhere after them."""
    lit = np.flatnonzero(~found.unlit)
    return bool(found.unlit[lit[0] : lit[-1]].any())


def odd_somewhere(found: ClipFit) -> bool:
    """Return whether a fit leaves much more in some frames in a row than in most."""
    loss = frame_losses(found.rows, found.fit.rest)
    if len(loss) < 2 * ODD_RUN:
        return False
    runs = np.median(np.lib.stride_tricks.sliding_window_view(loss, ODD_RUN), axis=1)
    return bool(runs.max() > float(np.percentile(runs, 25)) + SUSPICIOUS)


def chapters(plan: Plan, rows: Profiles, seed: Seed) -> tuple[slice, ...]:
    """Return the stretches of frames between which the strobe started again or stopped, all frames as one where it did
    neither. ``seed`` is the whole clip's."""
    left, done = _moving_and_still(plan, rows)
    most = MOST_RESTARTS + len(left) + len(done)
    while left:
        part = left.pop()
        is_whole = part == slice(0, len(rows.value))
        at = _restart_in(plan, rows.take(part).one_window(), seed if is_whole else None)
        if at is None:
            done.append(part)
        else:
            left += [slice(part.start, part.start + at), slice(part.start + at, part.stop)]
        if len(left) + len(done) > most:
            return (slice(0, len(rows.value)),)
    return tuple(sorted(done, key=lambda one: one.start))


def lit_stretches(plan: Plan, rows: Profiles) -> tuple[slice, ...]:
    """Return the stretches of frames that flashes light and those that none does, all frames as one where none is dark
    for longer than the plan is: what stopped there may go on elsewhere in its cycle."""
    return tuple(_runs_alike(unlit(plan, rows)))


def _runs_alike(mask: Mask) -> list[slice]:
    edges = [0, *(np.flatnonzero(np.diff(mask)) + 1).tolist(), len(mask)]
    return [slice(first, end) for first, end in pairwise(edges)]


def _moving_and_still(plan: Plan, rows: Profiles) -> tuple[list[slice], list[slice]]:
    """Return the stretches of frames that change, and those in which the picture stands still in flashes' stead."""
    stands = _stands(plan, rows)
    parts = _runs_alike(stands)
    return [one for one in parts if not stands[one.start]], [one for one in parts if stands[one.start]]


def _stands_still(plan: Plan, rows: Profiles, found: ClipFit) -> bool:
    """Return whether the picture stands still for long, and not because lights are nearly alike there: then the fit
    explains what little changes."""
    shown = ~found.unlit & ~found.track.repeated
    stands = _stands(plan, rows)
    if not stands.any() or (stands & ~shown).any():
        return bool(stands.any())
    among = (stands[1:] & stands[:-1])[np.flatnonzero(shown)[1:] - 1]
    change = np.diff(found.rows.value, axis=0)[among]
    left: Doubles = found.fit.rest[1:][among]
    return float((left**2).sum()) > FORETOLD * float((change**2).sum())


def _stands(plan: Plan, rows: Profiles) -> Mask:
    stands = still(plan, rows) & ~unlit(plan, rows)
    stands[:-1] |= stands[1:]  # the frame that is repeated may be the first of them
    return stands


def _restart_in(plan: Plan, rows: Profiles, seed: Seed | None) -> int | None:
    """Return the first frame after a restart, nearest to where the strobe is seen best (the ``seed``, where that is
    known already); None where there is none."""
    if len(rows.value) < LEAST_AFTER + 3 * (len(plan.lit_slots) + 1):
        return None
    dark = unlit(plan, rows)
    lit = renumbered(rows, stood_in(rows, dark)) if dark.any() else rows
    seed = seed or find_seed(plan, lit)
    few = (lit.turned() if seed.beat.upward else lit).binned(TRACK_ROWS)
    kept = renumbered(few, seed.numbering)
    if not shows_strobe(plan, kept.take(seed.frames), seed.beat):
        return None
    frames = np.flatnonzero(~dark)[seed.numbering.kept]
    tracked = track(plan, kept, seed.beat, seed.frames, memory=memory_frames(plan, rows), leap=leap)
    at = tracked.leaps[0] if tracked.leaps else _beside_holes(plan, kept, tracked)
    return None if at is None else int(frames[at])


def _beside_holes(plan: Plan, rows: Profiles, tracked: FrameTrack) -> int | None:
    """Return the first frame after a hole that is none, as flashes beside it come earlier or later than it says."""
    index, _ = settled(plan, rows, tracked.index, tracked.beat)
    holes = np.flatnonzero(np.diff(index) != np.diff(rows.index)) + 1
    for n, at in enumerate(holes.tolist()):
        first = max(at - MEMORY, int(holes[n - 1]) if n else 0)
        last = min(at + MEMORY, int(holes[n + 1]) if n + 1 < len(holes) else len(index))
        if min(at - first, last - at) >= LEAST_AFTER and _apart(
            plan, replace(rows, index=index).take(slice(first, last)), at - first, tracked.beat
        ):
            return int(at)
    return None


def _apart(plan: Plan, rows: Profiles, at: int, beat: Beat) -> bool:
    """Return whether flashes from a frame on come clearly earlier or later than those before it predict.

    A few frames predict badly, so that the clock is fitted to all frames again, with the move and without.
    """
    rows = rows.one_window()
    near = refined_beat(plan, rows.take(slice(0, at)), beat, steps=4, first_scale=0.1)
    ticks = moved(rows, 0.0)

    def gone(shift_s: float) -> Profiles:
        index = ticks.index.copy()
        index[at:] += round(shift_s / rows.period_s * TICKS)
        return replace(ticks, index=index)

    def left(tried: Profiles, beat: Beat) -> float:
        return float(frame_losses(rows, unexplained(plan, tried, beat)).sum())

    def fitted_again(tried: Profiles) -> float:
        return left(tried, refined_beat(plan, tried, near, steps=4, first_scale=0.1))

    shifts_s = np.arange(-FINE_PARTS, FINE_PARTS + 1) / FINE_PARTS * 0.5 * plan.shortest_flash_s
    losses = np.array([left(gone(one), near) for one in shifts_s.tolist()])
    best = int(losses.argmin())
    best_s = float(shifts_s[best])
    if abs(best_s) <= APART * plan.shortest_flash_s or losses[FINE_PARTS] - losses[best] <= HOLDS:
        return False
    return fitted_again(gone(best_s)) < HALVES * fitted_again(ticks)


def reach(plan: Plan, rows: Profiles, found: ClipFit, frames: slice, *, sign: int) -> int:
    """Return how many frames beyond a chapter's end (``sign`` 1) or before its beginning (-1) its strobe predicts.

    ``frames`` are the chapter's among ``rows``, all of the clip's.
    """
    few = (rows.turned() if found.fit.beat.upward else rows).binned(TRACK_ROWS).one_window()
    beat = replace(found.fit.beat, beat_hz=(), blur_s=0.0)
    places, seen = found.track.index, ~found.track.repeated & ~found.unlit
    own = few.take(frames)
    learnt = replace(own, value=np.ascontiguousarray(own.value[seen]), index=places[seen], doubt=None)
    light = brightnesses(plan, learnt, beat)
    usual = float(np.median(losses_of(plan, learnt, learnt, beat, light)))
    if sign > 0:
        beyond = few.take(slice(frames.stop, len(rows.value)))
        index = places[-1] + beyond.index - own.index[-1]
    else:
        beyond = few.take(slice(0, frames.start))
        index = places[0] + beyond.index - own.index[0]
    if not len(index):
        return 0
    asked = replace(beyond, index=index, doubt=None)
    odd = (losses_of(plan, learnt, asked, beat, light) > usual + SUSPICIOUS)[::sign]
    ends = np.flatnonzero(odd & np.append(odd[1:], True))
    return int(ends[0]) if len(ends) else len(odd)
