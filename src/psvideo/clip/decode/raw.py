"""Cameras' own raw files (CR2, CR3, NEF, ARW, RAF, ORF, RW2, PEF …): the sensor's values, decoded by LibRaw.

Levels and colour filters are those that LibRaw reads from the file or knows of the camera. The picture is cut to the
area that sees light. White balance, colour matrices and corrections of the lens are not applied.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import rawpy
from numpy.typing import NDArray

from psvideo.clip.decoded import CodedPicture, Header, Levels
from psvideo.errors import PsvideoError
from psvideo.model.turn import EXIF, UPRIGHT, Turn

EXIF_OF_FLIP = {3: 3, 5: 8, 6: 6}
"""EXIF's orientations of LibRaw's: upside down, turned to the left, to the right."""


def header(path: Path) -> Header:
    """Read what the file says without decoding the pixels."""
    with _opened(path) as raw:
        return _header(path, raw)


def decode(path: Path) -> CodedPicture:
    """Decode a whole picture: the sensor's values, black not yet taken off."""
    with _opened(path) as raw:
        head = _header(path, raw)
        codes: NDArray[np.uint16] = np.array(raw.raw_image_visible)[: head.height_px, : head.width_px]
    if not codes.any(axis=1).all():
        raise PsvideoError(
            f"{path}: holds rows of nothing: it is damaged, or compressed in a way that LibRaw does not decode whole. "
            "Copy it again, or convert the pictures to DNG."
        )
    return CodedPicture(header=head, codes=codes)


def relative_exposure(path: Path) -> float | None:
    """Return the light gathered, seconds times ISO over the f-number squared, where LibRaw reads them."""
    with _opened(path) as raw:
        said = raw.other
    if min(said.shutter_speed, said.iso_speed, said.aperture) <= 0:
        return None
    return float(said.shutter_speed * said.iso_speed / said.aperture**2)


@contextmanager
def _opened(path: Path) -> Iterator[rawpy.RawPy]:
    try:
        with rawpy.imread(str(path)) as raw:
            yield raw
    except rawpy.LibRawError as fault:
        said = fault.args[0] if fault.args else ""
        words = said.decode() if isinstance(said, bytes) else str(said)
        raise PsvideoError(
            f"{path}: LibRaw {'.'.join(map(str, rawpy.libraw_version))} cannot read it ({words}): it is truncated, "
            "damaged or of a camera that it does not know. Copy it again from the card, or convert the pictures to DNG."
        ) from fault


def _header(path: Path, raw: rawpy.RawPy) -> Header:
    sizes, filters = raw.sizes, _filters(path, raw)
    white = min([raw.white_level, *(one for one in raw.camera_white_level_per_channel or () if one > 0)])
    return Header(
        width_px=sizes.width,
        height_px=sizes.height,
        channels=1,
        bits=int(white).bit_length(),
        black=_black(raw),
        white=float(white),
        cfa=filters,
        colour="unknown",
        turn=_turn(sizes.flip),
    )


def _turn(flip: int) -> Turn:
    return EXIF.get(EXIF_OF_FLIP.get(flip, 1), UPRIGHT)


def _filters(path: Path, raw: rawpy.RawPy) -> str:
    """Return the colour filters of the picture's top left 2 x 2 pixels, row by row."""
    pattern, names = raw.raw_pattern, raw.color_desc.decode()
    found = "" if pattern is None or pattern.shape != (2, 2) else "".join(names[int(one)] for one in pattern.ravel())
    if sorted(found) != sorted("RGGB"):
        raise PsvideoError(
            f"{path}: its colour filters are not a Bayer pattern of red, green and blue ({found or names}), which is "
            "needed. Develop the pictures with the camera maker's program, as linear 16-bit TIFF."
        )
    return found


def _black(raw: rawpy.RawPy) -> Levels:
    """Return the black levels by position, from the picture's top left pixel on."""
    levels = raw.black_level_per_channel
    return tuple(tuple(float(levels[int(one)]) for one in row) for row in np.asarray(raw.raw_pattern))
