"""Pictures in the codes in which they were read, and what light their codes stand for.

Codes take half the memory of their light or less, and a recipe's coefficients reach them as they are:
``light = gain * (curve(code) - zero)``, where black and white levels make zero and gain, and the transfer curve is a
table.
"""

from dataclasses import dataclass, field
from typing import Any, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Image


@dataclass(frozen=True, kw_only=True, eq=False)
class Tone:
    """What light codes stand for: 0 at the black level, 1.0 = sensor saturation.

    table: what every code that its type can hold becomes first; empty where light is linear in the code. zero, gain:
    (row, col), by position, a pattern that repeats from the picture's top left on: each filter colour of a mosaic may
    have its own black level, and each row of what was packed its own range. most: codes above this count as it. halves:
    codes are the bits of half floats, and the table gives these as they are.
    """

    table: Image = field(default_factory=lambda: np.empty(0, np.float32))
    zero: NDArray[np.float64] = field(default_factory=lambda: np.zeros((1, 1)))
    gain: NDArray[np.float64] = field(default_factory=lambda: np.ones((1, 1)))
    most: float = np.inf
    halves: bool = False

    @property
    def is_identity(self) -> bool:
        """Whether codes are light already."""
        return not self.table.size and bool((self.gain == 1).all() and (self.zero == 0).all() and self.most == np.inf)


IDENTITY = Tone()
"""Codes that are light."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Coded:
    """A picture in codes: (row, col) or (row, col, channel); uint8, uint16 or float32, C-contiguous.

    Half floats are held as their 16 bits, and the tone's table says what each stands for. Large pictures may stay in
    their files, and rows of them are read when they are wanted.
    """

    codes: "NDArray[Any] | StoredCodes"
    tone: Tone = IDENTITY

    @property
    def shape(self) -> tuple[int, ...]:
        """The picture's shape."""
        return self.codes.shape

    def light(self, rows: slice = slice(None)) -> Image:
        """Return linear light, same shape; ``rows`` chooses some."""
        codes, tone = self.codes[rows], self.tone
        if tone.is_identity:
            return np.asarray(codes, np.float32)
        if tone.table.size:
            light = np.asarray(cv2.LUT(np.ascontiguousarray(codes), tone.table), np.float32).reshape(codes.shape)
        else:
            light = np.minimum(codes, tone.most, dtype=np.float32) if tone.most < np.inf else codes.astype(np.float32)
        places = np.array(range(len(self.codes))[rows], np.intp) % len(tone.gain)
        zero, gain = (np.asarray(plane[places], np.float32) for plane in (tone.zero, tone.gain))
        for col in range(gain.shape[1]):
            own = light[:, col :: gain.shape[1]]
            off, scale = (plane[:, col].reshape(-1, *(1,) * (own.ndim - 1)) for plane in (zero, gain))
            own -= off  # in place: a frame in light is large
            own *= scale
        return light


class StoredCodes(Protocol):
    """Codes that do not lie in memory."""

    @property
    def shape(self) -> tuple[int, ...]:
        """The picture's shape."""

    @property
    def dtype(self) -> np.dtype[Any]:
        """The codes' type."""

    def __len__(self) -> int:
        """How many rows there are."""

    def __getitem__(self, rows: slice) -> NDArray[Any]:
        """Read some rows that follow each other."""

    def opened(self) -> tuple[int, int] | None:
        """Return the open file in which they lie as they would in memory, and the byte at which they begin; None where
        rows are read by ``some`` only."""

    def some(self, rows: NDArray[np.intp]) -> NDArray[Any]:
        """Read rows, which rise: returned are all from the first to the last, of which only these hold anything."""

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        """Read the whole picture."""


class CodedFrame(Protocol):
    """A frame as timing and plates need it: its place in time and its picture in codes."""

    @property
    def index(self) -> int:
        """The frame's place in time, counted from the clip's first frame, holes included."""

    @property
    def coded(self) -> Coded:
        """The picture, (row, col) or (row, col, channel)."""


class LinearFrame(Protocol):
    """A frame as a step needs it that works on light."""

    @property
    def index(self) -> int:
        """The frame's place in time, counted from the clip's first frame, holes included."""

    @property
    def image(self) -> Image:
        """Linear light, (row, col) or (row, col, channel)."""
