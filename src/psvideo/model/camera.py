"""The camera: its size, its clock, and when each of its rows opens and closes.

Frame n exposes its row i over ``[n * frame_period_s + row_offset_s[i], + exposure_s)``; the row offset grows by
``row_time_s`` from row to row. A camera whose bottom row comes first has a negative row time, counted from its last
row, so that time zero is always the moment at which the first frame's first row begins to expose.
"""

from dataclasses import dataclass, field
from fractions import Fraction
from typing import Literal, get_args

import numpy as np

from psvideo.errors import PsvideoError
from psvideo.model.arrays import Doubles

CfaPattern = Literal["RGGB", "BGGR", "GRBG", "GBRG"]
"""The colour filters of the top left 2 x 2 pixels, row by row."""
CFA_PATTERNS: tuple[CfaPattern, ...] = get_args(CfaPattern)


@dataclass(frozen=True, kw_only=True)
class Encoding:
    """How the camera's files encode light: transfer curve, code values of black and of saturation, colour filters."""

    transfer: str = "linear"
    black_level: float | None = None
    white_level: float | None = None
    cfa: str | None = None


def exposure_of(fps: Fraction, *, shutter_deg: float | None = None, exposure_s: float | None = None) -> float:
    """Return the exposure in seconds where a shutter angle or the exposure itself is given; else the whole period.

    >>> exposure_of(Fraction(100), shutter_deg=180.0)
    0.005
    """
    return exposure_s or (shutter_deg or 360.0) / 360.0 * float(1 / fps)


@dataclass(frozen=True, kw_only=True)
class Camera:
    """One camera in one mode. ``readout_s`` is None where it is unknown, 0 for a global shutter, negative bottom-up.

    ``rows_each``: a row is the mean of this many rows of the sensor that open one after the other, as in a picture that
    was made smaller; its own time is their mean's.
    """

    width_px: int
    height_px: int
    fps: Fraction
    exposure_s: float
    readout_s: float | None
    name: str = "camera"
    encoding: Encoding = field(default_factory=Encoding)
    rows_each: int = 1

    @property
    def frame_period_s(self) -> float:
        """Seconds from one frame's first row to the next frame's first row."""
        return float(1 / self.fps)

    @property
    def shutter_deg(self) -> float:
        """The exposure as an angle: 360 degrees is the whole frame period."""
        return 360.0 * self.exposure_s / self.frame_period_s

    @property
    def middle_s(self) -> float:
        """The middle of the first frame: of its middle row's exposure; of its first row's where no readout is known."""
        return 0.5 * (self.exposure_s + abs(self.readout_s or 0.0))

    @property
    def row_time_s(self) -> float:
        """Seconds from one row's opening to the next one's; negative where the bottom row comes first.

        Raises PsvideoError where the readout time is unknown.
        """
        if self.readout_s is None:
            raise PsvideoError(
                f'The readout time of {self.name!r} is not known (readout_s is "unknown" in the plan), and this step '
                "needs it: write the measured readout time in seconds into the plan's [camera] table."
            )
        return self.readout_s / self.height_px

    def within_row_s(self) -> Doubles:
        """When the sensor's rows open of which a row is the mean, beside that row's own time, shape (rows_each,).

        >>> mean = Camera(width_px=2, height_px=3, fps=Fraction(100), exposure_s=0.01, readout_s=0.006, rows_each=2)
        >>> mean.within_row_s().round(6).tolist()
        [-0.0005, 0.0005]
        """
        if self.rows_each == 1:
            return np.zeros(1)
        each = np.arange(self.rows_each, dtype=np.float64) - 0.5 * (self.rows_each - 1)
        return each * (self.row_time_s / self.rows_each)

    def row_offsets_s(self) -> Doubles:
        """When each row opens after its frame has begun, shape (row,); 0 for the row that comes first.

        >>> up = Camera(width_px=2, height_px=3, fps=Fraction(100), exposure_s=0.01, readout_s=-0.003)
        >>> [round(float(offset), 6) for offset in up.row_offsets_s()]
        [0.002, 0.001, 0.0]
        """
        rows = np.arange(self.height_px, dtype=np.float64)
        first = 0 if self.row_time_s >= 0 else self.height_px - 1
        return (rows - first) * self.row_time_s + 0.0
