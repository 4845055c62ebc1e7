"""Rolling-flash reconstruction: frames and their Timing in, one plate for every flash out.

Each plate is made by its recipe (``model.recipe``), which says what of which frame's rows makes it up. The sum still
holds the ambient light of every exposure in it; ``ambient.subtract`` takes it off.
"""

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.compiled import EXACT
from psvideo.model.camera import Camera, FloatArray
from psvideo.model.clipping import SATURATED
from psvideo.model.recipe import flash_recipe, frames_of
from psvideo.model.row_profiles import LinearFrame
from psvideo.model.timing import Flash, Timing

COUNTS = 0.02
"""A clipped sample clips the plate where so much of it counts; less is a neighbour's tail that is taken off."""

Image = NDArray[np.float32]


@dataclass(frozen=True, kw_only=True)
class Plate:
    """The scene as one flash showed it: linear light, 1.0 = sensor saturation, (row, col) or (row, col, channel).

    ``clipped``, of the image's shape, marks the pixels of which a sample was clipped, None where there is none. They
    lack that sample's light until ``ambient.subtract`` makes 1.0 of them, by which every later step knows saturation.
    ``shares`` (frame, row) is what the image holds of the rows of every frame that the flash touched, and with it of
    the ambient light of their exposures, whose middles are ``middles_s`` (frame, row). ``seen`` (row,) is False where
    no frame saw enough of the flash (the image is 0 there).
    """

    flash: Flash
    image: Image
    shares: FloatArray
    middles_s: FloatArray
    seen: NDArray[np.bool_]
    clipped: NDArray[np.bool_] | None = None

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

    ``frames`` come in order; a hole in their indices is a dropped frame. Only the few frames that the current flash
    touches are held. The plates still hold ambient light, as ``Plate.shares`` says.
    """
    stream = _Window(iter(frames))

    def rebuilt(flash: Flash) -> Plate | None:
        touched = frames_of(camera, timing, flash)
        images = stream.between(touched) if flash.complete and touched else {}
        return _rebuild(camera, timing, flash, images) if images else None

    # map and filter hold neither frames nor plates while the next one is rebuilt, as a loop's variables would
    return filter(None, map(rebuilt, timing.flashes))


def plate_of(flash: Flash, frames: Iterable[LinearFrame], camera: Camera, timing: Timing) -> Plate | None:
    """Return the plate of one flash of the timing from the frames that it touches, None where there is none of them."""
    touched = frames_of(camera, timing, flash)
    images = {frame.index: frame.image for frame in frames if frame.index in touched}
    return _rebuild(camera, timing, flash, images) if images else None


class _Window:
    """The few frames of a stream that the current flash needs."""

    def __init__(self, frames: Iterator[LinearFrame]) -> None:
        self._frames = frames
        self._held: deque[LinearFrame] = deque()

    def between(self, indices: range) -> dict[int, Image]:
        """Return the frames with these indices, as far as the stream has them; frames before are released."""
        while self._held and self._held[0].index < indices.start:
            self._held.popleft()
        while not self._held or self._held[-1].index < indices.stop - 1:
            frame = next(self._frames, None)
            if frame is None:
                break
            if frame.index >= indices.start:
                self._held.append(frame)
        return {frame.index: frame.image for frame in self._held if frame.index in indices}


def _rebuild(camera: Camera, timing: Timing, flash: Flash, images: dict[int, Image]) -> Plate:
    """Combine the frames that saw one flash, each row with its own coefficients."""
    recipe = flash_recipe(camera, timing, flash, frozenset(images))
    shape = next(iter(images.values())).shape
    plate = np.empty(shape, np.float32)
    rows = len(plate)
    begun, holds_clipped = np.zeros(rows, np.bool_), np.zeros(rows, np.bool_)
    parts = [
        (images[index].reshape(rows, -1), share.astype(np.float32))
        for index, share in zip(recipe.frames, recipe.coefficients, strict=True)
    ]
    for frame, share in parts:
        _add_rows(plate.reshape(rows, -1), frame, share, begun, holds_clipped)
    plate[~begun] = 0
    middles_s = _opens_s(camera, recipe.frames) + camera.exposure_s / 2
    return Plate(
        flash=flash,
        image=plate,
        shares=recipe.coefficients,
        middles_s=middles_s,
        seen=recipe.seen,
        clipped=_clipped(parts, shape) if holds_clipped.any() else None,
    )


def _clipped(parts: Sequence[tuple[Image, Image]], shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Return where any sample that counts was clipped; ``parts`` are frames (row, sample) and their shares (row,)."""
    clipped = np.zeros(shape, np.bool_)
    for frame, share in parts:
        counts = share > COUNTS
        clipped[counts] |= (frame[counts] >= np.float32(SATURATED)).reshape(-1, *shape[1:])
    return clipped


def _opens_s(camera: Camera, frames: Sequence[int]) -> FloatArray:
    """Return when each row of each frame begins to expose, shape (frame, row)."""
    opens_s: FloatArray = np.array(frames)[:, None] * camera.frame_period_s + camera.row_offsets_s()
    return opens_s


@EXACT.kept
def _add_rows(
    plate: Image, frame: Image, share: Image, begun: NDArray[np.bool_], holds_clipped: NDArray[np.bool_]
) -> None:
    """Add a frame's rows, each times its share, and note which rows have begun and which hold a clipped sample.

    One loop over memory: a row that has not begun is written and not read.
    """
    for row in range(plate.shape[0]):
        factor = share[row]
        if factor == 0:
            continue
        clipped = np.int32(0)
        if begun[row]:
            for sample in range(plate.shape[1]):
                value = frame[row, sample]
                plate[row, sample] += factor * value
                clipped += np.int32(value >= np.float32(SATURATED))
        else:
            for sample in range(plate.shape[1]):
                value = frame[row, sample]
                plate[row, sample] = factor * value
                clipped += np.int32(value >= np.float32(SATURATED))
            begun[row] = True
        if clipped > 0 and factor > np.float32(COUNTS):
            holds_clipped[row] = True
