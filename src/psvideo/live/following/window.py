"""The latest frames' row profiles, laid out as the finder's fit takes them, and when the light changed.

From a change on every row has brightnesses of its own: an aperture that is closed, a lamp that is switched off, a
camera that is moved, all change how bright rows are and not when flashes come.
"""

from collections import deque
from dataclasses import dataclass, field, replace

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.fit import FLASH_ROWS
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.tracking.course import window_frames
from psvideo.sync.rowfit.tracking.steps_ahead import BLOCK

MOST_ROWS = 96
"""Rows to which profiles are averaged; more where a flash would not span ``FLASH_ROWS`` of them."""


@dataclass(frozen=True, kw_only=True)
class HeldFrame:
    """One frame: its place in time, its row means (row,) and by how much these may be wrong (None: not)."""

    place: int
    value: Doubles
    doubt: Doubles | None = None


@dataclass(kw_only=True)
class Window:
    """The latest ``memory`` frames of a camera; ``bins`` rows are kept of each, in the order in which they open."""

    period_s: float
    memory: int
    bins: int
    upward: bool
    frames: deque[HeldFrame] = field(default_factory=deque)
    changes: list[int] = field(default_factory=list)

    def add(self, frame: HeldFrame) -> None:
        """Take in one more frame, as the camera gave it, and let the oldest go."""
        rows = self._laid_out([frame])
        doubt = None if rows.doubt is None else rows.doubt[0]
        self.frames.append(HeldFrame(place=frame.place, value=rows.value[0], doubt=doubt))
        while len(self.frames) > self.memory:
            self.frames.popleft()
        self.changes = [at for at in self.changes if at > self.frames[0].place]

    def moved(self, first: int, extra: int) -> None:
        """Put the frames from the place ``first`` on by this many frames later."""
        for at, frame in enumerate(self.frames):
            if frame.place >= first:
                self.frames[at] = replace(frame, place=frame.place + extra)
        self.changes = [at + extra if at >= first else at for at in self.changes]

    def since_change(self) -> int:
        """Return how many of the frames came after the last change of light."""
        if not self.changes:
            return len(self.frames)
        return self.count_from(self.changes[-1])

    def count_from(self, first: int) -> int:
        """Return how many of the frames stand at a place or later."""
        return sum(frame.place >= first for frame in self.frames)

    def profiles(self, latest: int | None = None) -> Profiles:
        """Return the frames, or the last ``latest`` of them, each stretch of equal light a window of its own."""
        frames = list(self.frames)[-(latest or len(self.frames)) :]
        index = np.array([frame.place for frame in frames], np.int64)
        starts = np.searchsorted(index, [at for at in self.changes if at > index[0]])
        doubts = [np.zeros_like(frame.value) if frame.doubt is None else frame.doubt for frame in frames]
        return Profiles(
            value=np.stack([frame.value for frame in frames]),
            index=index,
            period_s=self.period_s,
            place=self._place,
            window_start=np.unique(np.concatenate([[0], starts])).astype(np.int64),
            doubt=np.stack(doubts) if any(frame.doubt is not None for frame in frames) else None,
        )

    def _laid_out(self, frames: list[HeldFrame]) -> Profiles:
        value = np.stack([frame.value for frame in frames])
        doubt = None if frames[0].doubt is None else np.stack([np.asarray(frame.doubt) for frame in frames])
        rows = Profiles(
            value=value,
            index=np.array([frame.place for frame in frames], np.int64),
            period_s=self.period_s,
            place=np.arange(value.shape[1], dtype=np.float64),
            window_start=np.zeros(1, np.int64),
            doubt=doubt,
        )
        rows = (rows.turned() if self.upward else rows).binned(self.bins)
        self._place = rows.place
        return rows

    _place: Doubles = field(default_factory=lambda: np.empty(0))


def window_of(plan: Plan, beat: Beat) -> Window:
    """Return an empty window that holds what predicts the next frames: every light several times, and the marker."""
    period_s = plan.camera.frame_period_s
    shortest_s = plan.shortest_flash_s
    sharp = int(FLASH_ROWS * beat.row_time_s * plan.camera.height_px / shortest_s)
    return Window(
        period_s=period_s,
        memory=max(window_frames(plan), int(1.2 * plan.marker_s / period_s), 2 * BLOCK),
        bins=max(MOST_ROWS, sharp),
        upward=beat.upward,
    )
