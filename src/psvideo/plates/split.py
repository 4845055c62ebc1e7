"""Rolling-flash reconstruction: frames and their Timing in, one plate for every flash out.

Each plate is a picture by its recipe (``model.rows.recipe``), which says what of which frame's rows makes it up;
nothing is added up before somebody wants to see it. It still holds the ambient light of every exposure in it;
``ambient_off`` takes it off.
"""

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles, Image
from psvideo.model.camera import Camera
from psvideo.model.coded import Coded, CodedFrame
from psvideo.model.rows.recipe import flash_recipe, frames_of
from psvideo.model.timing import Flash, Timing
from psvideo.plates.mixing.mixture import Mixture


@dataclass(frozen=True, kw_only=True)
class Plate:
    """The scene as one flash showed it: linear light, (row, col[, channel]); 1.0 where a sample was clipped.

    ``shares`` (frame, row) is what the picture holds of the rows of every frame that the flash touched, and with it of
    the ambient light of their exposures, whose middles are ``middles_s`` (frame, row). ``seen`` (row,) is False where
    no frame saw enough of the flash (the picture is 0 there).
    """

    flash: Flash
    picture: Mixture
    shares: Doubles
    middles_s: Doubles
    seen: NDArray[np.bool_]

    @property
    def image(self) -> Image:
        """The picture, made when it is asked for."""
        return self.picture.image()

    @property
    def time_s(self) -> float:
        """The instant that the plate shows: the middle of its flash, on the camera's clock."""
        return self.flash.start_s + self.flash.duration_s / 2

    @property
    def exposures(self) -> Doubles:
        """How many exposures' worth of ambient light the image holds, shape (row,)."""
        total: Doubles = self.shares.sum(axis=0)
        return total


def split(frames: Iterable[CodedFrame], camera: Camera, timing: Timing, *, unseen: bool = False) -> Iterator[Plate]:
    """Yield one plate for every complete flash that any frame saw, in order, dark slots included.

    ``unseen`` yields a plate of no rows for flashes that fell between two exposures of all rows.
    ``frames`` come in order; a hole in their indices is a dropped frame. Only the few frames that the current flash
    touches are held. The plates still hold ambient light, as ``Plate.shares`` says.
    """
    stream = _Window(iter(frames))

    def rebuilt(flash: Flash) -> Plate | None:
        touched = frames_of(camera, timing, flash)
        if unseen and not touched:  # the frames around give no more than their size
            touched = range(touched.start - 1, touched.start + 1)
        images = stream.between(touched) if flash.complete and touched else {}
        return _rebuild(camera, timing, flash, images) if images else None

    # map and filter hold neither frames nor plates while the next one is rebuilt, as a loop's variables would
    return filter(None, map(rebuilt, timing.flashes))


def plate_of(flash: Flash, frames: Iterable[CodedFrame], camera: Camera, timing: Timing) -> Plate | None:
    """Return the plate of one flash of the timing from the frames that it touches, None where there is none of them."""
    touched = frames_of(camera, timing, flash)
    images = {frame.index: frame.coded for frame in frames if frame.index in touched}
    return _rebuild(camera, timing, flash, images) if images else None


class _Window:
    """The few frames of a stream that the current flash needs."""

    def __init__(self, frames: Iterator[CodedFrame]) -> None:
        self._frames = frames
        self._held: deque[CodedFrame] = deque()

    def between(self, indices: range) -> dict[int, Coded]:
        """Return the frames with these indices, as far as the stream has them; frames before are released."""
        while self._held and self._held[0].index < indices.start:
            self._held.popleft()
        while not self._held or self._held[-1].index < indices.stop - 1:
            frame = next(self._frames, None)
            if frame is None:
                break
            if frame.index >= indices.start:
                self._held.append(frame)
        return {frame.index: frame.coded for frame in self._held if frame.index in indices}


def _rebuild(camera: Camera, timing: Timing, flash: Flash, images: dict[int, Coded]) -> Plate:
    """Combine the frames that saw one flash, each row with its own coefficients."""
    if frames_of(camera, timing, flash):
        recipe = flash_recipe(camera, timing, flash, frozenset(images))
        frames, coefficients, seen = recipe.frames, recipe.coefficients, recipe.seen
    else:
        frames, seen = (), np.zeros(camera.height_px, np.bool_)
    if not frames:  # none of them saw it: all rows are unseen
        frames, coefficients = (next(iter(images)),), np.zeros((1, camera.height_px))
    return Plate(
        flash=flash,
        picture=Mixture(frames=tuple(images[index] for index in frames), coefficients=coefficients),
        shares=coefficients,
        middles_s=_opens_s(camera, frames) + camera.exposure_s / 2,
        seen=seen,
    )


def _opens_s(camera: Camera, frames: Sequence[int]) -> Doubles:
    """Return when each row of each frame begins to expose, shape (frame, row)."""
    opens_s: Doubles = np.array(frames)[:, None] * camera.frame_period_s + camera.row_offsets_s()
    return opens_s
