"""Tracking: from frames whose times are known to all others, across dropped and repeated frames and a drifting clock.

Block by block away from frames that fit, the brightnesses found so far predict the next frames at every place in time
that they may have; a Viterbi search picks the cheapest course, in which a step between frames other than the one that
the numbering gives costs something. Then the clock is sharpened on the latest frames and the next block follows.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from psvideo.model.arrays import Doubles, Integers, Mask
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.coarse.retime import twins as twin_frames
from psvideo.sync.rowfit.compiled_profiles import unexplained
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import refined_beat
from psvideo.sync.rowfit.tracking.losses import SUSPICIOUS, frame_losses
from psvideo.sync.rowfit.tracking.steps_ahead import BLOCK, Twins, steps_ahead, with_steps
from psvideo.sync.rowfit.unlit import lit_twins

LEAST_ANCHOR = 12
AGREEING = 4
"""Fits from which frames that stray from the others count less and less."""


@dataclass(frozen=True, kw_only=True)
class FrameTrack:
    """Where a clip's frames are in time, ``index`` (frame,), and by how much flashes come later than ``beat`` says.

    ``late_s`` (anchor,) stands at the times ``at_s`` (anchor,) on the camera's clock. ``leaps`` are the first frames
    after the strobe started again, where that was looked for: frames beyond are not followed.
    """

    index: Integers
    beat: Beat
    at_s: Doubles
    late_s: Doubles
    leaps: tuple[int, ...] = ()

    @property
    def repeated(self) -> Mask:
        """Frames that show the same moment as the one before them, shape (frame,)."""
        return np.append(False, np.diff(self.index) == 0)


Leap = Callable[[Plan, Profiles, Beat, slice, slice, Integers, int], int | None]
"""Returns at which frame the strobe started again among frames ahead, if it did: from the plan, the rows, the beat,
frames that are known, frames ahead, how many frames more than numbered each of those is away, and 1, or -1 towards the
clip's beginning."""


def track(plan: Plan, rows: Profiles, beat: Beat, seed: slice, *, memory: int, leap: Leap | None = None) -> FrameTrack:
    """Follow the strobe through the whole clip from the frames ``seed``, most of which ``beat`` fits.

    The latest ``memory`` frames predict the next ones. Where a ``leap`` is found, frames beyond are not followed.
    """
    for _ in range(2):
        low, high = _anchor(plan, rows, beat, seed)
        beat = refined_beat(plan, rows.take(slice(low, high)), beat, steps=6, first_scale=0.1)
    onward = _follow(plan, rows, beat, slice(low, high), 1, memory=memory, leap=leap)
    back = _follow(plan, replace(rows, index=onward.index), beat, onward.span, -1, memory=memory, leap=leap)
    late = [_lateness(beat, beat, float(rows.frame_start_s[low:high].mean())), *onward.late, *back.late]
    points = np.array(sorted(late), np.float64)
    leaps = (*onward.leaps, *back.leaps)
    tracked = FrameTrack(index=back.index, beat=beat, at_s=points[:, 0], late_s=points[:, 1], leaps=leaps)
    return from_first_frame(rows, tracked)


@dataclass(frozen=True, kw_only=True)
class _Followed:
    """One way through the clip: every frame's place in time, the frames that were followed, ``(at_s, late_s)`` after
    each block, and the frame at which the strobe started again, if it did."""

    index: Integers
    span: slice
    late: list[tuple[float, float]]
    leaps: tuple[int, ...] = ()


def _follow(
    plan: Plan, rows: Profiles, base: Beat, span: slice, sign: int, *, memory: int, leap: Leap | None
) -> _Followed:
    """Follow the strobe from the frames ``span`` to the clip's end (``sign`` 1) or to its beginning (-1)."""
    index, now, late = rows.index, base, list[tuple[float, float]]()
    twins = Twins(alike=twin_frames(rows), lit=lit_twins(rows))
    low, high = span.start, span.stop
    while high < len(index) if sign > 0 else low > 0:
        block = slice(high, min(high + BLOCK, len(index))) if sign > 0 else slice(max(low - BLOCK, 0), low)
        known, there = _latest(low, high, memory, sign), replace(rows, index=index)
        extra = steps_ahead(plan, there, now, known, block, twins, sign)
        new = slice(high, high + len(extra)) if sign > 0 else slice(low - len(extra), low)
        at = leap and leap(plan, there, now, known, new, extra, sign)
        if at:
            return _Followed(index=index, span=slice(low, high), late=late, leaps=(at,))
        index = with_steps(index, new, extra, sign)
        low, high = min(low, new.start), max(high, new.stop)
        now, point = _sharpened(plan, replace(rows, index=index), now, base, _latest(low, high, memory, sign))
        late.append(point)
    return _Followed(index=index, span=slice(low, high), late=late)


def _latest(low: int, high: int, memory: int, sign: int) -> slice:
    """Return the ``memory`` followed frames that are nearest to those that come next."""
    return slice(max(low, high - memory), high) if sign > 0 else slice(low, min(low + memory, high))


def from_first_frame(rows: Profiles, tracked: FrameTrack) -> FrameTrack:
    """Count time from the clip's first frame again, wherever frames after it turned out to be missing."""
    shift = int(tracked.index[0] - rows.index[0])
    shift_s, clock = shift * rows.period_s, tracked.beat.clock
    knot_s = tuple(at_s - shift_s for at_s in clock.knot_s)
    moved = replace(tracked.beat, clock=replace(clock, phase_s=clock.phase_s - shift_s, knot_s=knot_s))
    return replace(tracked, index=tracked.index - shift, beat=moved, at_s=tracked.at_s - shift_s)


def _anchor(plan: Plan, rows: Profiles, beat: Beat, seed: slice) -> tuple[int, int]:
    """Return the longest run of frames in the seed that fit as well as most; where there is none, as among dark frames,
    which are twins of each other, the longest of which none shows a moment again."""
    part = rows.take(seed)
    loss = _losses_of_most(plan, part, beat)
    calm = np.array([np.median(loss[max(n - 1, 0) : n + 2]) for n in range(len(loss))])
    good = calm < np.median(loss) + max(SUSPICIOUS, float(np.median(loss)))
    good &= ~twin_frames(rows)[seed]
    for frames in (good, ~lit_twins(rows)[seed]):
        length, first = _longest_run(frames)
        if length >= min(LEAST_ANCHOR, len(loss)):
            return seed.start + first, seed.start + first + length
    return seed.start, seed.stop


def _longest_run(frames: Mask) -> tuple[int, int]:
    """Return how long the longest run of frames (frame,) is, and its first."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], frames.astype(np.int64), [0]])))
    runs = [(int(b - a), int(a)) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    return max(runs, default=(0, 0))


def _losses_of_most(plan: Plan, rows: Profiles, beat: Beat) -> Doubles:
    """Return every frame's loss under brightnesses that most frames agree on, shape (frame,).

    Two frames at wrong places in time spoil brightnesses so much that frames at right ones look as odd.
    """
    trust = np.ones_like(rows.value)
    for _ in range(AGREEING):
        loss = frame_losses(rows, unexplained(plan, rows, beat, trust))
        trust = np.ascontiguousarray(np.broadcast_to(1.0 / (1.0 + (loss / SUSPICIOUS) ** 2)[:, None], trust.shape))
    return loss


def _sharpened(plan: Plan, rows: Profiles, now: Beat, base: Beat, frames: slice) -> tuple[Beat, tuple[float, float]]:
    """Fit the clock again to the latest frames, and return how late it is there against the base's clock."""
    part = rows.take(frames).one_window()
    now = refined_beat(plan, part, now, steps=2, first_scale=0.03)
    return now, _lateness(base, now, float(part.frame_start_s.mean()))


def _lateness(base: Beat, now: Beat, at_s: float) -> tuple[float, float]:
    strobe_s = (at_s - base.clock.phase_s) / base.clock.rate
    return at_s, now.clock.phase_s + strobe_s * now.clock.rate - at_s
