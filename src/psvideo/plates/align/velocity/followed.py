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
    ``step`` by ``step`` of the sketches'. ``bend`` (2, row, col) is how fast the velocity changes, in its own pixels
    per square second, None where all ways are straight. ``carried`` is how fast a camera that shakes shifts all of the
    picture, x and y in its own pixels per second, None where it does not; the velocity is what comes on top.
    ``arc_deg`` (row, col) is by how much normals may be off because what moves turns between two plates of a light;
    None where nobody knows."""

    time_s: float
    velocity: Floats
    moves: Flags
    rests: Flags
    unchanged: NDArray[np.int16] = field(default_factory=lambda: np.zeros((1, 1), np.int16))
    step: int = 1
    bend: Floats | None = None
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
    def bends(self) -> Floats:
        """How fast the velocity changes, 0 where ways are straight."""
        return np.zeros_like(self.velocity) if self.bend is None else self.bend

    @property
    def steadied(self) -> bool:
        """Whether plates were brought together by one shift of the whole picture, beside what moves in it."""
        return self.carried is not None

    def without(self, still: Flags) -> "Followed":
        """Return the same with nothing that moves where ``still`` (row, col)."""
        bend = None if self.bend is None else self.bend * ~still
        return replace(self, velocity=self.velocity * ~still, moves=self.moves & ~still, bend=bend)

    def mean_velocity(self, span_s: float) -> Floats:
        """Return the mean velocity of every pixel over the time until the instant, below 0 that from it on, shape (2,
        row, col)."""
        return mean_velocity(self.velocity, self.bend, span_s)

    def way(self, span_s: float) -> Floats:
        """Return how far every pixel came in a time until the instant, below 0 how far back from where it goes, shape
        (2, row, col)."""
        return np.float32(span_s) * self.mean_velocity(span_s)


def mean_velocity(velocity: Floats, bend: Floats | None, span_s: float) -> Floats:
    """Return the mean of a velocity over the time until an instant, below 0 that from it on, by its ``bend``: how fast
    it changes."""
    return velocity if bend is None else velocity - np.float32(span_s / 2) * bend


def odd_width(window_px: int, step: int) -> int:
    """Return the width of a window of ``window_px`` in pixels of ``step`` of the sketches': an odd number, 3 or more (1
    stays 1)."""
    return max(window_px // step | 1, min(window_px, 3))


def mean_over(values: Floats, window_px: int) -> Floats:
    """Return means over windows of this many of the values' own pixels."""
    return np.asarray(cv2.blur(values, (window_px, window_px)), np.float32)
