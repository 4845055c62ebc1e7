"""Tracking: from frames whose times are known to all others, across dropped and repeated frames and a drifting clock.

Block by block away from frames that fit, the brightnesses found so far foretell the next frames at every place in time
that they may have; a Viterbi search picks the cheapest course, in which a step between frames other than the one that
the numbering gives costs something. Then the clock is sharpened on the latest frames and the next block follows.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from psvideo.model.camera import FloatArray
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.coarse.retime import Mask
from psvideo.sync.rowfit.coarse.retime import twins as twin_frames
from psvideo.sync.rowfit.coarse.search import ROBUST_STEEPNESS
from psvideo.sync.rowfit.profiles import Profiles, brightnesses, predictions, unexplained
from psvideo.sync.rowfit.refine import refined_beat
from psvideo.sync.rowfit.row_model import IntArray

BLOCK, LONG_BLOCK = 16, 64
LEAST, MOST = -6, 24
"""Frames that may be repeated (less than none) or missing at one place without a hole in the numbering."""
JUMP_COST = 2.0
"""What an unexpected step costs, in mean losses of a frame (a frame at a wrong time costs 1 to 3)."""
TWIN_COST = 0.2
"""What it costs to take a frame that looks exactly like the one before it for the same moment."""
SUSPICIOUS = 0.25
"""A frame's loss by which it must exceed what is usual before other places in time are tried for it."""
HOLDS = 1.0
"""A step is believed where it takes away so much of the frames' losses once brightnesses are fitted again."""
NATURAL = 0.1
"""A frame that looks like the one before it is repeated only where its own place in time fits worse by so much."""
LEAST_ANCHOR = 12
AGREEING = 4
"""Fits from which frames that stray from the others count less and less."""
MEMORY, NEAR = 24, 10
"""Frames on either side of a hole that show where it is, and how far from where it was found it may be."""


@dataclass(frozen=True, kw_only=True)
class FrameTrack:
    """Where a clip's frames are in time, ``index`` (frame,), and by how much flashes come later than ``beat`` says.

    ``late_s`` (anchor,) stands at the times ``at_s`` (anchor,) on the camera's clock. ``leaps`` are the first frames
    after the strobe began anew, where that was looked for: frames beyond are not followed.
    """

    index: IntArray
    beat: Beat
    at_s: FloatArray
    late_s: FloatArray
    leaps: tuple[int, ...] = ()

    @property
    def repeated(self) -> Mask:
        """Frames that show the same moment as the one before them, shape (frame,)."""
        return np.append(False, np.diff(self.index) == 0)


Leap = Callable[[Plan, Profiles, Beat, slice, slice, IntArray, int], int | None]
"""Returns at which frame the strobe began anew among frames ahead, if there: from the plan, the rows, the beat, frames
that are known, frames ahead, how many frames more than numbered each of those is away, and 1, or -1 towards the
clip's beginning."""


def track(plan: Plan, rows: Profiles, beat: Beat, seed: slice, *, memory: int, leap: Leap | None = None) -> FrameTrack:
    """Follow the strobe through the whole clip from the frames ``seed``, most of which ``beat`` fits.

    The latest ``memory`` frames foretell the next ones. Where a ``leap`` is found, frames beyond are not followed.
    """
    for _ in range(2):
        low, high = _anchor(plan, rows, beat, seed)
        beat = refined_beat(plan, rows.take(slice(low, high)), beat, steps=6, first_scale=0.1)
    index = rows.index.copy()
    twins = twin_frames(rows)
    late = [_lateness(beat, beat, float(rows.frame_start_s[low:high].mean()))]
    now, leaps = beat, list[int]()
    while high < len(index):
        block = slice(high, min(high + BLOCK, len(index)))
        known = slice(max(low, high - memory), high)
        extra = _course(plan, replace(rows, index=index), now, known, block, twins, 1)
        at = leap and leap(plan, replace(rows, index=index), now, known, slice(high, high + len(extra)), extra, 1)
        if at:
            leaps.append(at)
            break
        index[high : high + len(extra)] += extra
        index[high + len(extra) :] += extra[-1]
        high += len(extra)
        now, point = _sharpened(plan, replace(rows, index=index), now, beat, slice(max(low, high - memory), high))
        late.append(point)
    now = beat
    while low > 0:
        block = slice(max(low - BLOCK, 0), low)
        known = slice(low, min(low + memory, high))
        extra = _course(plan, replace(rows, index=index), now, known, block, twins, -1)
        at = leap and leap(plan, replace(rows, index=index), now, known, slice(low - len(extra), low), extra, -1)
        if at:
            leaps.append(at)
            break
        index[low - len(extra) : low] -= extra
        index[: low - len(extra)] -= extra[0]
        low -= len(extra)
        now, point = _sharpened(plan, replace(rows, index=index), now, beat, slice(low, min(low + memory, high)))
        late.append(point)
    points = np.array(sorted(late), np.float64)
    tracked = FrameTrack(index=index, beat=beat, at_s=points[:, 0], late_s=points[:, 1], leaps=tuple(leaps))
    return from_first_frame(rows, tracked)


def from_first_frame(rows: Profiles, tracked: FrameTrack) -> FrameTrack:
    """Count time from the clip's first frame again, wherever frames after it turned out to be missing."""
    shift = int(tracked.index[0] - rows.index[0])
    shift_s, clock = shift * rows.period_s, tracked.beat.clock
    knot_s = tuple(at_s - shift_s for at_s in clock.knot_s)
    moved = replace(tracked.beat, clock=replace(clock, phase_s=clock.phase_s - shift_s, knot_s=knot_s))
    return replace(tracked, index=tracked.index - shift, beat=moved, at_s=tracked.at_s - shift_s)


def _anchor(plan: Plan, rows: Profiles, beat: Beat, seed: slice) -> tuple[int, int]:
    """Return the longest run of frames in the seed that fit as well as most; all of it where there is none, as among
    dark frames, which are twins of each other."""
    part = rows.take(seed)
    loss = _losses_of_most(plan, part, beat)
    calm = np.array([np.median(loss[max(n - 1, 0) : n + 2]) for n in range(len(loss))])
    good = calm < np.median(loss) + max(SUSPICIOUS, float(np.median(loss)))
    good &= ~twin_frames(rows)[seed]
    edges = np.flatnonzero(np.diff(np.concatenate([[0], good.astype(np.int64), [0]])))
    runs = [(int(b - a), int(a)) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    length, first = max(runs, default=(0, 0))
    if length < min(LEAST_ANCHOR, len(loss)):
        return seed.start, seed.stop
    return seed.start + first, seed.start + first + length


def _losses_of_most(plan: Plan, rows: Profiles, beat: Beat) -> FloatArray:
    """Return every frame's loss under brightnesses that most frames agree on, shape (frame,).

    Two frames at wrong places in time spoil brightnesses so much that frames at right ones look as odd.
    """
    trust = np.ones_like(rows.value)
    for _ in range(AGREEING):
        loss = frame_losses(rows, unexplained(plan, rows, beat, trust))
        trust = np.ascontiguousarray(np.broadcast_to(1.0 / (1.0 + (loss / SUSPICIOUS) ** 2)[:, None], trust.shape))
    return loss


def frame_losses(rows: Profiles, rest: FloatArray) -> FloatArray:
    """Return every frame's mean robust loss over the rows that change, shape (frame,)."""
    spread = rows.spread
    lit = spread > 0.03 * spread.max()
    losses: FloatArray = np.log1p(ROBUST_STEEPNESS * (rest[:, lit] / spread[lit]) ** 2).mean(axis=1)
    return losses


def _course(plan: Plan, rows: Profiles, beat: Beat, known: slice, block: slice, twins: Mask, sign: int) -> IntArray:
    """Return by how many frames more than the numbering says the next frames are away, shape (frame,).

    Where all is as usual, this is for the whole block; where not, for its nearer half, so that the other half is looked
    at again with more known.
    """
    learnt = rows.take(known)
    nearness = np.linspace(0.1, 1.0, len(learnt.value))[:: 1 if sign > 0 else -1, None]
    light = brightnesses(plan, learnt, beat, np.ascontiguousarray(np.broadcast_to(nearness, learnt.value.shape)))
    usual = float(np.median(losses_of(plan, learnt, learnt, beat, light)))
    ahead = rows.take(block)
    loss = losses_of(plan, learnt, ahead, beat, light)
    same = twins[block] if sign > 0 else np.append(twins[block][1:], twins[block.stop])
    odd = np.convolve(loss, [0.5, 0.5], mode="same") if len(loss) > 1 else loss
    if odd.max() < usual + SUSPICIOUS and not same.any():
        return np.zeros(len(loss), np.int64)
    extras = np.arange(LEAST, MOST + 1)
    shifted = [replace(ahead, index=ahead.index + sign * int(extra)) for extra in extras]
    table = np.stack([losses_of(plan, learnt, one, beat, light) for one in shifted], axis=1)
    course = _cheapest(table, same) if sign > 0 else _cheapest(table[::-1], same[::-1])[::-1]
    if course.any() and not _holds(plan, rows, beat, known, block, course, sign):
        course = np.zeros(len(loss), np.int64)
    nearer = max(len(loss) // 2, min(len(loss), 4))
    return course[:nearer] if sign > 0 else course[-nearer:]


def _holds(plan: Plan, rows: Profiles, beat: Beat, known: slice, block: slice, course: IntArray, sign: int) -> bool:
    """Return whether a course still wins when brightnesses are fitted again to all frames from the known ones on.

    Frames that move are foretold badly; fitted along a wrong course they stay bad, along the right one they do not.
    """
    count = len(rows.value)
    span = (
        slice(known.start, min(block.stop + BLOCK, count))
        if sign > 0
        else slice(max(block.start - BLOCK, 0), known.stop)
    )
    index = rows.index.copy()
    index[block] += sign * course
    if sign > 0:
        index[block.stop :] += course[-1]
    else:
        index[: block.start] -= course[0]
    stayed, went = rows.take(span), replace(rows, index=index).take(span)
    gain = frame_losses(stayed, unexplained(plan, stayed, beat)) - frame_losses(went, unexplained(plan, went, beat))
    return float(gain.sum()) > HOLDS


def losses_of(plan: Plan, reference: Profiles, rows: Profiles, beat: Beat, light: FloatArray) -> FloatArray:
    """Return how badly known brightnesses foretell frames, shape (frame,), on the scale of the reference's spreads."""
    rest = rows.value - predictions(plan, rows, beat, light)
    spread = reference.spread
    lit = spread > 0.03 * spread.max()
    losses: FloatArray = np.log1p(ROBUST_STEEPNESS * (rest[:, lit] / spread[lit]) ** 2).mean(axis=1)
    return losses


def _cheapest(table: FloatArray, twin: Mask) -> IntArray:
    """Return the course of least cost through a table (frame, extra); no frame comes before the one before it."""
    extras = np.arange(LEAST, MOST + 1)
    step = extras[None, :] - extras[:, None]  # from the row's state to the column's
    usual = np.where(step == 0, 0.0, np.where(step < -1, np.inf, JUMP_COST + 0.05 * np.abs(step)))
    after_twin = np.where(step == 1, TWIN_COST, usual)
    to_twin = np.where(step == -1, 0.0, usual + TWIN_COST)
    cost = np.where(extras == 0, 0.0, np.inf)
    back = np.zeros(table.shape, np.int64)
    for n in range(len(table)):
        price = to_twin if twin[n] else after_twin if n and twin[n - 1] else usual
        whole = cost[:, None] + price
        back[n] = whole.argmin(axis=0)
        cost = whole.min(axis=0) + table[n]
    state = int(cost.argmin())
    course = np.empty(len(table), np.int64)
    for n in range(len(table) - 1, -1, -1):
        course[n] = extras[state]
        state = int(back[n, state])
    return course


def _sharpened(plan: Plan, rows: Profiles, now: Beat, base: Beat, frames: slice) -> tuple[Beat, tuple[float, float]]:
    """Fit the clock again to the latest frames, and return how late it is there against the base's clock."""
    part = rows.take(frames).one_window()
    now = refined_beat(plan, part, now, steps=2, first_scale=0.03)
    return now, _lateness(base, now, float(part.frame_start_s.mean()))


def _lateness(base: Beat, now: Beat, at_s: float) -> tuple[float, float]:
    strobe_s = (at_s - base.clock.phase_s) / base.clock.rate
    return at_s, now.clock.phase_s + strobe_s * now.clock.rate - at_s


def settled(plan: Plan, rows: Profiles, index: IntArray, beat: Beat) -> tuple[IntArray, Mask]:
    """Return the frames' places with every hole moved to where it explains the frames around it best, and the frames
    (frame,) that may as well lie on the other side of one.

    While tracking, frames beside a hole are judged by brightnesses from one side only; here from both.
    """
    index, unsure = index.copy(), np.zeros(len(index), np.bool_)
    numbered = np.diff(rows.index)
    for place in np.flatnonzero(np.diff(index) > numbered).tolist():
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
    slots that follow one another look alike, too.
    """
    if kept.all():
        return tracked
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
            index[block] = np.where(natural, own[block], index[block])
    return replace(tracked, index=np.maximum.accumulate(index))


def _fits(plan: Plan, rows: Profiles, tracked: FrameTrack, kept: Mask, block: slice, places: IntArray) -> FloatArray:
    """Return how badly frames fit at some places in time, shape (frame of the block,), by the frames around them."""
    near = slice(max(block.start - MEMORY, 0), min(block.stop + MEMORY, len(kept)))
    known = np.cumsum(kept)[near][kept[near]] - 1
    learnt = replace(
        rows.one_window(), value=np.ascontiguousarray(rows.value[near][kept[near]]), index=tracked.index[known]
    )
    light = brightnesses(plan, learnt, tracked.beat)
    asked = replace(rows.one_window(), value=rows.value[block], index=places[block])
    return losses_of(plan, learnt, asked, tracked.beat, light)
