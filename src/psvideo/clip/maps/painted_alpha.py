"""The alpha channel of a painted picture, which frames have no use for, and in which masks are often cut out."""

import contextlib
from pathlib import Path
from typing import Any

import imagecodecs
import numpy as np
import tifffile
from numpy.typing import NDArray
from PIL import Image

from psvideo.clip.decode import exr, png
from psvideo.errors import PsvideoError
from psvideo.model.arrays import Floats


def alpha_of(kind: str, path: Path) -> Floats | None:
    """Return a picture's alpha channel, (row, col) from 0 to 1, as the file stores its rows; None where it has none, or
    one that is the same everywhere. ``kind`` is one of ``clip.folder.KINDS``. What cannot be read has none.

    A TIFF's first extra channel is taken for alpha, in an EXR that of the first part.
    """
    read = {"png": _of_png, "tiff": _of_tiff, "exr": exr.alpha}.get(kind)
    codes = None
    with contextlib.suppress(
        OSError, ValueError, RuntimeError, PsvideoError
    ):  # who reads the picture says what is wrong
        codes = None if read is None else read(path)
    if codes is None or codes.size == 0 or codes.min() == codes.max():
        return None
    most = np.iinfo(codes.dtype).max if codes.dtype.kind == "u" else 1
    return np.asarray(codes, np.float32) / np.float32(most)


def _of_png(path: Path) -> NDArray[Any] | None:
    data = path.read_bytes()
    if len(data) <= png.COLOUR_TYPE_AT:
        return None
    if data[png.COLOUR_TYPE_AT] == png.PALETTE:
        with Image.open(path) as painted:
            return np.asarray(painted.convert("RGBA"))[..., -1] if "transparency" in painted.info else None
    return imagecodecs.png_decode(data)[..., -1] if data[png.COLOUR_TYPE_AT] in png.ALPHA_TYPES else None


def _of_tiff(path: Path) -> NDArray[Any] | None:
    with tifffile.TiffFile(path) as file:
        page = file.pages.first
        if not page.extrasamples:
            return None
        codes, place = page.asarray(), page.samplesperpixel - len(page.extrasamples)
        return np.asarray(codes[place] if page.planarconfig == 2 else codes[..., place])  # 2: one plane after another
