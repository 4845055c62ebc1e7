"""Rolling-flash reconstruction: frames and their Timing in, one plate for every flash out.

Flash by flash, never frame by frame: the row weights say which frames saw which share of a flash in each row. Where
one frame holds all of it, that frame is taken alone, because the others would add only noise. Where a row is split
over two frames, they are summed (eq. 10) and divided by the share that both saw together, which is 1 at 360 degrees.
The sum still holds the ambient light of every exposure in it; ``ambient.subtract`` takes it off.
"""

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.compiled import compiled
from psvideo.model.camera import Camera, FloatArray
from psvideo.model.row_profiles import LinearFrame
from psvideo.model.shutter import frames_touched, row_weights
from psvideo.model.timing import Flash, Timing

FULL = 1.0 - 1e-9
"""A row that saw this share of a flash saw all of it."""
LEAST_SHARE = 0.05
"""A row that saw less of a flash than this is taken as unseen: dividing by so little would bring up only noise."""
MOST_FOREIGN = 0.01
"""A row into which more of another flash was mixed than this (a dark time that is too short) is taken as unseen."""
SATURATED = 0.998
"""A sample from here on is clipped."""
CLIPPED = 1e6
"""Where any sample of a plate's pixel was clipped, this is added: no sum of light reaches it, and ``ambient.subtract``
makes 1.0 of it, by which every later step knows saturation."""

Image = NDArray[np.float32]


@dataclass(frozen=True, kw_only=True)
class Plate:
    """The scene as one flash showed it: linear light, 1.0 = sensor saturation, (row, col) or (row, col, channel).

    Pixels of which a sample was clipped are ``CLIPPED`` or more until ambient light is taken off, 1.0 from then on.
    ``shares`` (frame, row) is what the image holds of the rows of every frame that the flash touched, and with it of
    the ambient light of their exposures, whose middles are ``middles_s`` (frame, row). ``seen`` (row,) is False where
    no frame saw enough of the flash (the image is 0 there).
    """

    flash: Flash
    image: Image
    shares: FloatArray
    middles_s: FloatArray
    seen: NDArray[np.bool_]

    @property
    def time_s(self) -> float:
        """The instant that the plate shows: the middle of its flash, on the camera's clock."""
        return self.flash.start_s + self.flash.duration_s / 2

    @property
    def exposures(self) -> FloatArray:
        """How many exposures' worth of ambient light the image holds, shape (row,)."""
        total: FloatArray = self.shares.sum(axis=0)
        return total


def split(frames: Iterable[LinearFrame], camera: Camera, timing: Timing) -> Iterator[Plate]:
    """Yield one plate for every complete flash that any frame saw, in order, dark slots included.

    ``frames`` come in order; a hole in their indices is a dropped frame. Only the two or three frames that the current
    flash touches are held. The plates still hold ambient light, as ``Plate.shares`` says.
    """
    stream = _Window(iter(frames))
    first, last = frames_touched(camera, timing.start_s, timing.duration_s)

    def rebuilt(flash: Flash) -> Plate | None:
        touched = range(int(first[flash.index]), int(last[flash.index]) + 1)
        images = stream.between(touched) if flash.complete and touched else {}
        return _rebuild(camera, timing, flash, images, touched) if images else None

    # map and filter hold neither frames nor plates while the next one is rebuilt, as a loop's variables would
    return filter(None, map(rebuilt, timing.flashes))


def plate_of(flash: Flash, frames: Iterable[LinearFrame], camera: Camera, timing: Timing) -> Plate | None:
    """Return the plate of one flash of the timing from the frames that it touches, None where there is none of them."""
    first, last = frames_touched(camera, np.array([flash.start_s]), np.array([flash.duration_s]))
    touched = range(int(first[0]), int(last[0]) + 1)
    images = {frame.index: frame.image for frame in frames if frame.index in touched}
    return _rebuild(camera, timing, flash, images, touched) if images else None


class _Window:
    """The few frames of a stream that the current flash needs."""

    def __init__(self, frames: Iterator[LinearFrame]) -> None:
        self._frames = frames
        self._held: deque[LinearFrame] = deque()

    def between(self, indices: range) -> dict[int, Image]:
        """Return the frames with these indices, as far as the stream has them; frames before are let go."""
        while self._held and self._held[0].index < indices.start:
            self._held.popleft()
        while not self._held or self._held[-1].index < indices.stop - 1:
            frame = next(self._frames, None)
            if frame is None:
                break
            if frame.index >= indices.start:
                self._held.append(frame)
        return {frame.index: frame.image for frame in self._held if frame.index in indices}


def _rebuild(camera: Camera, timing: Timing, flash: Flash, images: dict[int, Image], touched: range) -> Plate:
    """Combine the frames that saw one flash, each row with its own coefficients."""
    weights = row_weights(camera, np.array([flash.start_s]), np.array([flash.duration_s]), frames=touched)[0]
    weights[[index not in images for index in touched]] = 0.0
    clean = weights * (_foreign_light(camera, timing, flash, touched) <= MOST_FOREIGN)
    coefficients = _best_sum(clean) if any(flash.lights.values()) else _average_of(clean)
    seen = coefficients.sum(axis=0) > 0
    shape = next(iter(images.values())).shape
    plate = np.zeros(shape, np.float32)
    flat = plate.reshape(shape[0], -1)
    for index, coefficient in zip(touched, coefficients, strict=True):
        if index in images and coefficient.any():
            _add_rows(flat, images[index].reshape(shape[0], -1), coefficient.astype(np.float32), np.float32(SATURATED))
    middles_s = _opens_s(camera, touched) + camera.exposure_s / 2
    return Plate(flash=flash, image=plate, shares=coefficients, middles_s=middles_s, seen=seen)


def _opens_s(camera: Camera, frames: range) -> FloatArray:
    """Return when each row of each frame begins to expose, shape (frame, row)."""
    opens_s: FloatArray = np.array(frames)[:, None] * camera.frame_period_s + camera.row_offsets_s()
    return opens_s


def _best_sum(weights: FloatArray) -> FloatArray:
    """Return the share of each frame's row in a plate, (frame, row): one whole frame alone, else all that saw any."""
    whole = weights >= FULL
    alone = whole & (np.cumsum(whole, axis=0) == 1)
    used = np.where(whole.any(axis=0), alone, weights > 0)
    share = (weights * used).sum(axis=0)
    coefficients: FloatArray = used * np.where(share >= LEAST_SHARE, 1.0 / np.maximum(share, LEAST_SHARE), 0.0)
    return coefficients


def _average_of(weights: FloatArray) -> FloatArray:
    """Return coefficients that average every exposure that fell into a dark slot, (frame, row)."""
    used = weights > 0
    coefficients: FloatArray = used / np.maximum(used.sum(axis=0), 1)
    return coefficients


def _foreign_light(camera: Camera, timing: Timing, flash: Flash, frames: range) -> FloatArray:
    """Return how much of the neighbouring lit flashes each row of each frame saw, shape (frame, row)."""
    near = timing.flashes[max(flash.index - 2, 0) : flash.index + 3]
    others = [other for other in near if other.index != flash.index and any(other.lights.values())]
    if not others:
        return np.zeros((len(frames), camera.height_px))
    start_s = np.array([other.start_s for other in others])
    duration_s = np.array([other.duration_s for other in others])
    foreign: FloatArray = row_weights(camera, start_s, duration_s, frames=frames).sum(axis=0)
    return foreign


@compiled
def _add_rows(plate: Image, frame: Image, coefficient: Image, saturated: np.float32) -> None:
    """Add a frame's rows, each times its coefficient, and CLIPPED where a sample was clipped."""
    for row in range(plate.shape[0]):
        share = coefficient[row]
        if share > 0:
            for col in range(plate.shape[1]):
                value = frame[row, col]
                plate[row, col] += np.float32(CLIPPED) if value >= saturated else share * value
