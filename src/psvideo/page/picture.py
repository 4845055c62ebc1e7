"""One picture on its way to the browser: averaged down to the width that is shown, and packed as a block of bytes.

A block is the letters PSVB, the length of a JSON text as 32 bits (little endian), that text, padded with spaces so that
the pixels begin at a multiple of 8 bytes, and the pixels: row 0 at the top, channels side by side, little endian halves
or floats. Where a picture cannot be read, the text holds ``missing``, a sentence, and no pixels follow.
"""

import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.halves import halves_of
from psvideo.compute.memory import HALF_MAX
from psvideo.pictures.on_screen import smaller

MAGIC = b"PSVB"
Plane = NDArray[np.floating]
Number = TypeVar("Number", bound=np.generic)


@dataclass(frozen=True, kw_only=True)
class PagePicture:
    """Pixels (row, col, channel), float16 or float32, and facts about them for the browser."""

    pixels: NDArray[np.floating]
    facts: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Look:
    """How a picture is to be looked at: at most this wide; ``quick`` leaves pixels out instead of averaging them."""

    width_px: int
    quick: bool = False


def shown(planes: Sequence[Plane], look: Look, *, directions: bool = False, full: bool = False) -> NDArray[np.floating]:
    """Return planes (row, col) as pixels (row, col, channel) no wider than is looked at, averaged down by area.

    ``directions``: the planes are unit vectors, and what comes of averaging them is made unit again; (0, 0, 0), which
    is no direction, weighs nothing. ``full`` keeps 32 bits. What is no number becomes 0.
    """
    if look.quick and planes[0].shape[1] > look.width_px:
        planes = [picked(plane, look.width_px) for plane in planes]
    if planes[0].shape[1] <= look.width_px and all(plane.dtype == np.float16 for plane in planes) and not full:
        return _finite(np.stack(planes, axis=-1))
    small = np.stack([_smaller(plane, look.width_px) for plane in planes], axis=-1)
    if directions and small.shape[1] < planes[0].shape[1]:
        length = np.sqrt((small * small).sum(axis=-1, keepdims=True))
        small = np.where(length > 1e-3, small / np.maximum(length, 1e-3), 0).astype(np.float32)
    small = _finite(small)
    return small.astype(np.float32) if full else np.clip(small, -HALF_MAX, HALF_MAX).astype(np.float16)


def halves(image: NDArray[np.float32]) -> NDArray[np.float16]:
    """Return a picture (row, col[, channel]) of finite numbers as pixels (row, col, channel) in half floats."""
    rows, cols = image.shape[:2]
    return halves_of(image.reshape(rows, -1))[0].reshape(rows, cols, -1)


def picked(plane: NDArray[Number], width_px: int) -> NDArray[Number]:
    """Return every second, third or so pixel of a picture (row, col[, channel]), as many as fit the width."""
    rows, cols = plane.shape[:2]
    height_px = max(round(rows * width_px / cols), 1)
    row = ((np.arange(height_px) + 0.5) * rows / height_px).astype(np.intp)
    step = cols // width_px
    if step * width_px == cols:  # a slice is much faster than a list of columns
        return np.asarray(plane[row][:, step // 2 :: step])
    return np.asarray(plane[row][:, ((np.arange(width_px) + 0.5) * cols / width_px).astype(np.intp)])


def _finite(pixels: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return pixels with 0 for what is no number."""
    bad = ~np.isfinite(pixels)
    return np.where(bad, pixels.dtype.type(0), pixels) if bad.any() else pixels


def _smaller(plane: Plane, width_px: int) -> NDArray[np.float32]:
    return smaller(plane, width_px) if plane.shape[1] > width_px else plane.astype(np.float32)


def picture_block(picture: PagePicture) -> bytes:
    """Return a picture as a block of bytes."""
    pixels = picture.pixels
    facts = {
        "height": pixels.shape[0],
        "width": pixels.shape[1],
        "channels": pixels.shape[2],
        "type": "half" if pixels.dtype == np.float16 else "float",
    }
    order = "<f2" if pixels.dtype == np.float16 else "<f4"
    return _head(facts | dict(picture.facts)) + np.ascontiguousarray(pixels, order).tobytes()


def missing_block(message: str) -> bytes:
    """Return the block of a picture that cannot be shown; ``message`` says why."""
    return _head({"missing": message})


def _head(facts: Mapping[str, object]) -> bytes:
    text = json.dumps(facts).encode()
    text += b" " * (-(len(text) + 8) % 8)
    return MAGIC + struct.pack("<I", len(text)) + text
