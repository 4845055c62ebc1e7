"""What is followed, and what comes of it: plates of a light in pairs, and one velocity for every pixel."""

import functools
from dataclasses import dataclass, field, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Flags, Floats
from psvideo.plates.align.velocity.flow import Sketch


@dataclass(frozen=True, kw_only=True)
class Pair:
    """The sketches of a light before and after an instant, in the same brightness."""

    before: Sketch
    after: Sketch


@dataclass(frozen=True, kw_only=True)
class Followed:
    """``velocity`` (2, row, col) is x right, y down, in its own pixels per second, 0 where not ``moves``. ``rests``
    (row, col) is what clearly stands beside that; the rest looks alike either way. ``unchanged`` (row, col) is
    under how many of all lights a pixel that does not move shows the same before and after. Each of these pixels is
    ``step`` by ``step`` of the sketches'. ``carried`` is how fast a camera that shakes shifts all of the picture, x and
    y in its own pixels per second, None where it does not; the velocity is what comes on top. ``arc_deg`` (row, col) is
    by how much normals may be off because what moves turns between two plates of a light; None where nobody knows."""

    time_s: float
    velocity: Floats
    moves: Flags
    rests: Flags
    unchanged: NDArray[np.int16] = field(default_factory=lambda: np.zeros((1, 1), np.int16))
    step: int = 1
    carried: tuple[float, float] | None = None
    arc_deg: Floats | None = None

    @functools.cached_property
    def nearby(self) -> Floats:
        """The velocity of what moves nearest to every pixel, (2, row, col)."""
        if not self.moves.any():
            return self.velocity
        still = (~self.moves).astype(np.uint8)
        labels = cv2.distanceTransformWithLabels(still, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)[1]
        of_label = np.zeros((2, int(labels.max()) + 1), np.float32)
        of_label[:, labels[self.moves]] = self.velocity[:, self.moves]
        return of_label[:, labels]

    @property
    def steadied(self) -> bool:
        """Whether plates were brought together by one shift of the whole picture, beside what moves in it."""
        return self.carried is not None

    def without(self, still: Flags) -> "Followed":
        """Return the same with nothing that moves where ``still`` (row, col)."""
        return replace(self, velocity=self.velocity * ~still, moves=self.moves & ~still)

    def way(self, span_s: float) -> Floats:
        """Return how far every pixel goes in a time, shape (2, row, col)."""
        return np.float32(span_s) * self.velocity


def odd_width(window_px: int, step: int) -> int:
    """Return the width of a window of ``window_px`` in pixels of ``step`` of the sketches': an odd number, 3 or more (1
    stays 1)."""
    return max(window_px // step | 1, min(window_px, 3))


def mean_over(values: Floats, window_px: int) -> Floats:
    """Return means over windows of this many of the values' own pixels."""
    return np.asarray(cv2.blur(values, (window_px, window_px)), np.float32)
