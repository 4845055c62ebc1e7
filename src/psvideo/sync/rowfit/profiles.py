"""Row profiles laid out for fitting."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles, Integers

HIDDEN = 0.01
"""Clipped pixels that may hide this share of what a row changes by halve what its sample counts for."""


@dataclass(frozen=True, kw_only=True)
class Profiles:
    """Row profiles of a clip: ``value`` (frame, row) in the order in which rows open, ``index`` (frame,) in time.

    ``place`` (row,) counts sensor rows from the one that opens first; ``window_start`` (window,) are the frames at
    which windows begin, in each of which a row has brightnesses of its own. ``doubt`` (frame, row) is by how much a
    value may be wrong beyond noise, as where pixels saturate. ``restless`` (row,) is by how much the flashes of a light
    differ in each row, as variance over the noise's; none: all are alike.
    """

    value: Doubles
    index: Integers
    period_s: float
    place: Doubles
    window_start: Integers
    doubt: Doubles | None = None
    restless: Doubles | None = None

    @property
    def frame_start_s(self) -> Doubles:
        """When each frame's first row opens, shape (frame,)."""
        start_s: Doubles = np.asarray(self.index, np.float64) * self.period_s
        return start_s

    def take(self, frames: slice) -> "Profiles":
        """Return some consecutive frames, with the windows that lie in them."""
        count = len(range(*frames.indices(len(self.value))))
        starts = self.window_start - (frames.start or 0)
        inside = starts[(starts > 0) & (starts < count)]
        return replace(
            self,
            value=self.value[frames],
            index=self.index[frames],
            window_start=np.concatenate([[0], inside]).astype(np.int64),
            doubt=None if self.doubt is None else self.doubt[frames],
        )

    def only_rows(self, rows: slice | NDArray[np.bool_]) -> "Profiles":
        """Return some of the rows of all frames."""
        return replace(
            self,
            value=np.ascontiguousarray(self.value[:, rows]),
            place=np.ascontiguousarray(self.place[rows]),  # else loops were compiled for it once more
            doubt=None if self.doubt is None else self.doubt[:, rows],
            restless=None if self.restless is None else np.ascontiguousarray(self.restless[rows]),
        )

    def one_window(self) -> "Profiles":
        """Return the same profiles with brightnesses that hold for all frames."""
        return replace(self, window_start=np.zeros(1, np.int64))

    def windowed(self, frames_each: int) -> "Profiles":
        """Return the same profiles in windows of about this many frames.

        Where more are missing, a window ends, and the frame before is one by itself: the clock may bend there. Of 50
        frames in windows of 25, with 40 missing behind the 31st::

            place in time   0 ... 24 | 25 ... 29 | 30 | 71 ... 89
            window               0         1        2       3

        The clock runs straight within a window, from its first frame to the next one's. Window 2 takes up the whole
        gap, so that windows 1 and 3 are held only by frames that lie close together.
        """
        count = max(len(self.value) // max(frames_each, 1), 1)
        starts = np.linspace(0, len(self.value), count, endpoint=False).astype(np.int64)
        after = np.flatnonzero(np.diff(self.index) > max(frames_each, 1)) + 1
        return replace(self, window_start=np.union1d(starts, np.concatenate([after - 1, after])))

    @property
    def window_frames(self) -> int:
        """How many frames a window usually has."""
        return int(np.median(np.diff(self.window_start, append=len(self.value))))

    def binned(self, bins: int) -> "Profiles":
        """Average neighbouring rows, so that at most ``bins`` are left."""
        height = self.value.shape[1]
        if height <= bins:
            return self
        edges = np.linspace(0, height, bins + 1).astype(np.int64)[:-1]
        counts = np.diff(np.append(edges, height))
        return replace(
            self,
            value=np.ascontiguousarray(np.add.reduceat(self.value, edges, axis=1) / counts),
            place=np.add.reduceat(self.place, edges) / counts,
            doubt=None if self.doubt is None else np.add.reduceat(self.doubt, edges, axis=1) / counts,
            restless=None,
        )

    def turned(self) -> "Profiles":
        """Return the profiles of the same picture read from the other end."""
        return replace(
            self,
            value=np.ascontiguousarray(self.value[:, ::-1]),
            place=np.ascontiguousarray(self.place.max() + self.place.min() - self.place[::-1]),
            doubt=None if self.doubt is None else np.ascontiguousarray(self.doubt[:, ::-1]),
            restless=None if self.restless is None else np.ascontiguousarray(self.restless[::-1]),
        )

    @property
    def spread(self) -> Doubles:
        """How much each row changes over time, shape (row,); rows in the dark are held at a thousandth."""
        spread = self.value.std(axis=0)
        held: Doubles = np.maximum(spread, 1e-3 * spread.max() + 1e-12)
        return held

    @property
    def clipped_share(self) -> float:
        """Share of the rows' changes that is of pixels which clip, 0 to 1 and more."""
        return 0.0 if self.doubt is None else float(self.doubt.std(axis=0).mean() / self.spread.mean())

    @property
    def unclipped(self) -> Doubles:
        """How far each sample shows the light that fell, shape (frame, row): 1 where no pixel clips, and the less the
        more clipped ones may hide of what its row usually changes by."""
        if self.doubt is None:
            return np.ones_like(self.value)
        share: Doubles = 1.0 / (1.0 + (self.doubt / (HIDDEN * self.spread)) ** 2)
        return share

    @property
    def ends_s(self) -> Doubles:
        """Where each window begins and the last one ends, shape (window + 1,)."""
        start_s = self.frame_start_s
        return np.append(start_s[self.window_start], start_s[-1] + self.period_s)
