"""Pictures for eyes on disk: PNG, which says that psvideo drew it, and JPEG; whole or not at all."""

from pathlib import Path

import cv2

from psvideo.errors import PsvideoError
from psvideo.formats.whole_files import marked_png, whole_file
from psvideo.model.arrays import Pixels

WHOLE_COLOUR = (cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444)
"""Colour as fine as brightness: JPEG usually halves it."""


def write_png(path: Path, picture: Pixels) -> None:
    """Write a picture of R, G, B pixels (row, col, 3) as PNG."""
    _write(path, marked_png(_encoded(path, ".png", picture)))


def write_jpeg(path: Path, picture: Pixels, *, quality: int) -> None:
    """Write a picture of R, G, B pixels (row, col, 3) as JPEG of a quality from 0 to 100."""
    _write(path, _encoded(path, ".jpg", picture, cv2.IMWRITE_JPEG_QUALITY, quality, *WHOLE_COLOUR))


def _encoded(path: Path, ending: str, picture: Pixels, *how: int) -> bytes:
    done, data = cv2.imencode(ending, picture[..., ::-1], how)
    if not done:
        raise PsvideoError(f"{path}: the picture of shape {picture.shape} cannot be encoded as {ending[1:].upper()}.")
    return data.tobytes()


def _write(path: Path, data: bytes) -> None:
    with whole_file(path) as beside:
        beside.write_bytes(data)
