"""The record of a plate: the scene under one light alone, at its full flash, at one instant."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Bytes, Doubles, Image
from psvideo.plates.mixing.mixture import Mixture


@dataclass(frozen=True, kw_only=True)
class LightPlate:
    """The scene under one light at its full flash, at one instant.

    ``seen`` (row,) is as in a Plate, or (row, col) where motion hid parts of the plate.

    ``saturation`` is the value from which on a pixel is clipped: 1.0, or more where the flash was weaker than full. It
    is so bright at least, or ``unmixed``: a difference of flashes, of which one was clipped, and may be anything.
    ``brightest_share`` is what the brightest flash of its light in a round gives of the full one.
    ``shown_s`` (row,) are the instants that the rows show, or (row, col) where the picture was turned, None where all
    show ``time_s``. ``sideways`` is a picture that was turned by a quarter: the sensor's rows are its columns.
    ``filled`` (row, col) is what ``clipped_flashes`` said of an ``unmixed`` plate before it was turned or given rows
    of others, which leaves nothing of its flashes; None while its picture still holds them.
    ``brought``: what rows of other flashes show was moved to ``time_s``; ``shown_s`` still says when these were.
    """

    light: str
    number: int
    time_s: float
    picture: Mixture
    seen: NDArray[np.bool_]
    saturation: float = 1.0
    unmixed: bool = False
    brightest_share: float = 1.0
    shown_s: Doubles | None = None
    sideways: bool = False
    filled: Bytes | None = None
    brought: bool = False

    @property
    def image(self) -> Image:
        """The picture, (row, col) or (row, col, channel), in linear light; made when it is asked for."""
        return self.picture.image()

    @property
    def shape(self) -> tuple[int, ...]:
        """The picture's shape."""
        return self.picture.shape

    @property
    def flashed_s(self) -> Doubles:
        """The instant that every row shows, shape (row,), or every pixel, (row, col), where the picture was turned."""
        return np.full(self.shape[0], self.time_s) if self.shown_s is None else self.shown_s

    @property
    def rows_seen(self) -> NDArray[np.bool_]:
        """Which rows any frame saw, also where motion hid something in them, shape (row,)."""
        return self.seen if self.seen.ndim == 1 else np.asarray(self.seen.any(axis=1))

    @property
    def lines_seen(self) -> NDArray[np.bool_]:
        """Which of the sensor's rows any frame saw, also where motion hid something in them: (row, 1), or (1, col)
        where they are columns."""
        if self.sideways:
            return np.asarray(self.pixels_seen.any(axis=0))[None]
        return self.rows_seen[:, None]

    @property
    def own(self) -> NDArray[np.bool_]:
        """What the plate's own flash showed, (row, 1), or (1, col) or (row, col) where the picture was turned; the rest
        comes from flashes before or after. All that is seen, where that was brought to its instant."""
        if self.brought:
            return self.pixels_seen if self.seen.ndim == 2 else self.lines_seen
        if self.shown_s is None:
            return self.lines_seen
        return np.asarray(self.lines_seen & (self.shown_s == self.time_s).reshape(self.shape[0], -1))

    @property
    def pixels_seen(self) -> NDArray[np.bool_]:
        """What is known of the plate, shape (row, col)."""
        known = self.seen if self.seen.ndim == 2 else self.seen[:, None]
        return np.broadcast_to(known, self.shape[:2])
