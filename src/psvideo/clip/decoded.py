"""What a decoder hands over before light is made of it: what the file says of itself, and its codes."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from psvideo.clip.in_file import RowsInFile
from psvideo.model.turn import UPRIGHT, Turn

MOST_PIXELS = 1 << 29
"""Headers that claim more pixels count as damaged, before memory is asked for: the largest cameras' composites have 400
megapixels."""
Levels = tuple[tuple[float, ...], ...]
"""Black levels by position, a pattern that repeats over rows and columns from the picture's top left on."""
SHOT = ("cameraMake", "cameraModel", "cameraSerialNumber", "lensMake", "lensModel", "reelName")
"""OpenEXR's standard attributes on what took a picture."""


def shot_of(found: Mapping[str, object]) -> tuple[tuple[str, str], ...]:
    """Return what is known of camera, lens and reel: the texts among ``found`` that say something, by SHOT's names."""
    known = ((name, str(found[name]).strip(" \0") if isinstance(found.get(name), str) else "") for name in SHOT)
    return tuple((name, text) for name, text in known if text)


@dataclass(frozen=True, kw_only=True)
class Header:
    """What a picture's file says about itself. ``bits`` None: floating point; None elsewhere: the file does not say.

    ``width_px`` and ``height_px`` are those of the picture that is delivered, after the crop that the file asks for;
    ``cfa`` is the filter pattern at its top left pixel. Code 0 stands for the signal ``signal_at_0`` and each
    further code adds ``signal_per_code``, where 0 to 1 is what the transfer curve is defined on; None: the largest code
    is 1. ``video_range``: the file's codes of signal 0 and 1 were 16 and 235 (of 8 bits). ``turn`` is how the file
    wants the picture turned; the sizes are those before. ``transfer`` is the curve that the file is tagged with.
    ``shot`` is what the file says of camera, lens and reel, by the names of SHOT. ``warnings`` say what may cost
    accuracy, ``notes`` what is left out and costs none.

    Raises ValueError where the size is none that a picture has.
    """

    width_px: int
    height_px: int
    channels: int
    bits: int | None
    black: Levels | None = None
    white: float | None = None
    cfa: str | None = None
    colour: str | None = None
    time_code: str | None = None
    signal_at_0: float = 0.0
    signal_per_code: float | None = None
    video_range: bool = False
    turn: Turn = UPRIGHT
    transfer: str | None = None
    shot: tuple[tuple[str, str], ...] = ()
    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """See that the size can be one of a picture."""
        width_px, height_px = self.width_px, self.height_px
        if min(width_px, height_px) < 1 or width_px * height_px > MOST_PIXELS:
            raise ValueError(f"it says that it is {width_px} x {height_px} pixels")


@dataclass(frozen=True, kw_only=True)
class CodedPicture:
    """One decoded picture as the file codes it: (row, col) or (row, col, 3) as R, G, B; uint8, uint16 or float."""

    header: Header
    codes: NDArray[Any]


@dataclass(frozen=True, kw_only=True)
class PictureInFile:
    """One picture that is left in its file, of which rows are read when somebody wants them."""

    header: Header
    codes: RowsInFile
