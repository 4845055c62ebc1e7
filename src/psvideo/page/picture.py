"""One picture on its way to the browser: averaged down to the width that is shown, and packed as a block of bytes.

A block is the letters PSVB, the length of a JSON text as 32 bits (little endian), that text, padded with spaces so that
the pixels begin at a multiple of 8 bytes, and the pixels: row 0 at the top, channels side by side, little endian halves
or floats. Where a picture cannot be read, the text holds ``missing``, a sentence, and no pixels follow.
"""

import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from psvideo.view.shading import smaller

MAGIC = b"PSVB"
HALF_MAX = 65504.0
Plane = NDArray[np.floating]


@dataclass(frozen=True, kw_only=True)
class Picture:
    """Pixels (row, col, channel), float16 or float32, and facts about them for the browser."""

    pixels: NDArray[np.floating]
    facts: Mapping[str, object] = field(default_factory=dict)


def shown(
    planes: Sequence[Plane], width_px: int, *, directions: bool = False, full: bool = False
) -> NDArray[np.floating]:
    """Return planes (row, col) as pixels (row, col, channel) at most so wide, averaged down by area.

    ``directions``: the planes are unit vectors, and what comes of averaging them is made unit again; (0, 0, 0), which
    is no direction, weighs nothing. ``full`` keeps 32 bits. What is no number becomes 0.
    """
    small = np.stack([_smaller(plane, width_px) for plane in planes], axis=-1)
    if directions and small.shape[1] < planes[0].shape[1]:
        length = np.sqrt((small * small).sum(axis=-1, keepdims=True))
        small = np.where(length > 1e-3, small / np.maximum(length, 1e-3), 0).astype(np.float32)
    if not np.isfinite(small.sum(dtype=np.float64)):
        small = np.nan_to_num(small, nan=0.0, posinf=0.0, neginf=0.0)
    return small.astype(np.float32) if full else np.clip(small, -HALF_MAX, HALF_MAX).astype(np.float16)


def _smaller(plane: Plane, width_px: int) -> NDArray[np.float32]:
    return smaller(plane, width_px) if plane.shape[1] > width_px else plane.astype(np.float32)


def block(picture: Picture) -> bytes:
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
