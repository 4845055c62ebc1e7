"""The frames of a take, or of a part of one, with the strobe that was found in them: their Timing."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from psvideo.model.plan import Plan
from psvideo.model.timing import DroppedFrames, Timing
from psvideo.sync.black_frames import remarks_on_black
from psvideo.sync.flashes_seen import timing_of_fit
from psvideo.sync.marks import marks_of
from psvideo.sync.named_strobe import FoundStrobe
from psvideo.sync.unfired import only_fired
from psvideo.sync.unfired_words import remarks_on_unfired
from psvideo.sync.verdict.frame_remarks import remarks_on_frames
from psvideo.sync.verdict.light_remarks import remarks_on_lights
from psvideo.sync.verdict.remarks import remarks
from psvideo.sync.verdict.split_flashes import half_flash
from psvideo.sync.verdict.swinging import swing_of


@dataclass(frozen=True, kw_only=True)
class FramesTaken:
    """The frames (frame,) that were looked at, by their places in time and their numbers, and what is known of them."""

    plan: Plan
    clip: str
    indices: NDArray[np.int64]
    numbers: NDArray[np.int64]
    dropped: tuple[DroppedFrames, ...]

    def only(self, frames: slice) -> "FramesTaken":
        """Return some consecutive frames of the take, with the holes that their numbers show."""
        numbers = self.numbers[frames]
        dropped = tuple(hole for hole in self.dropped if numbers[0] <= hole.after < numbers[-1])
        return replace(self, indices=self.indices[frames], numbers=numbers, dropped=dropped)

    def breaks(self, frames: slice) -> tuple[bool, bool]:
        """Return whether some consecutive frames begin, and whether they end, elsewhere than the take."""
        return frames.start > 0, frames.stop < len(self.numbers)

    def outside(self, parts: Sequence[slice]) -> list[tuple[int, int]]:
        """Return the first and last numbers of the stretches of frames that lie in none of some parts, in order."""
        edges = [0, *(edge for part in parts for edge in (part.start, part.stop)), len(self.numbers)]
        gaps = zip(edges[::2], edges[1::2], strict=True)
        return [(int(self.numbers[first]), int(self.numbers[end - 1])) for first, end in gaps if end > first]


def timing_of_take(take: FramesTaken, strobe: FoundStrobe, *, breaks: tuple[bool, bool] = (False, False)) -> Timing:
    """Return the timing of a take, or of a part of one; ``breaks``: whether it begins and ends where the strobe did."""
    plan, found, beat = take.plan, strobe.found, strobe.found.fit.beat
    timing = timing_of_fit(
        plan,
        found,
        order=strobe.order,
        clip=take.clip,
        dropped=_all_dropped(take.dropped, take.numbers, take.indices, found.track.index),
        repeated=tuple(int(number) for number in take.numbers[found.track.repeated]),
    )
    marks = marks_of(plan, found, timing.flashes, take.indices, breaks)
    black, seen, unfired, fired = marks.black, marks.seen, marks.unfired, marks.fired
    only = only_fired(found, seen, unfired)
    swing, half = swing_of(plan, only), half_flash(plan, only)
    notes = (
        *remarks(plan, found, swing=swing, half=half),
        *remarks_on_lights(plan, found, beat, named=strobe.order != "guess"),
        *remarks_on_frames(plan, found, take.numbers),
        *remarks_on_black(found, black, take.numbers),
        *remarks_on_unfired(found, seen, fired, take.numbers),
    )
    return replace(timing, flashes=fired, swing=swing, half=half, notes=notes)


def _all_dropped(
    holes: Sequence[DroppedFrames], numbers: NDArray[np.int64], indices: NDArray[np.int64], index: NDArray[np.int64]
) -> tuple[DroppedFrames, ...]:
    """Return the holes that the numbering shows with those that only the picture shows."""
    counts = {hole.after: hole.count for hole in holes}
    for n in np.flatnonzero(np.diff(index) > np.maximum(np.diff(indices), 1)):
        more = int(index[n + 1] - index[n] - max(indices[n + 1] - indices[n], 1))
        counts[int(numbers[n])] = counts.get(int(numbers[n]), 0) + more
    return tuple(DroppedFrames(after=after, count=count) for after, count in sorted(counts.items()))
