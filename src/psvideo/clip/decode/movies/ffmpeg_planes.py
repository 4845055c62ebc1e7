"""The planes of a frame that FFmpeg decoded, at full depth, with no conversion of colours on the way."""

import re
from pathlib import Path
from typing import Any

import av
import numpy as np
from numpy.typing import NDArray

from psvideo.errors import PsvideoError

REPACKED = {
    "rgb24": "gbrp",
    "bgr24": "gbrp",
    "rgba": "gbrap",
    "bgra": "gbrap",
    "argb": "gbrap",
    "abgr": "gbrap",
    "bgr0": "gbrp",
    "rgb0": "gbrp",
    "0rgb": "gbrp",
    "0bgr": "gbrp",
    "x2rgb10le": "gbrp10le",
    "rgb48le": "gbrp16le",
    "rgb48be": "gbrp16le",
    "bgr48le": "gbrp16le",
    "rgba64le": "gbrap16le",
    "rgba64be": "gbrap16le",
    "nv12": "yuv420p",
    "nv16": "yuv422p",
    "yuyv422": "yuv422p",
    "uyvy422": "yuv422p",
    "p010le": "yuv420p10le",
    "p210le": "yuv422p10le",
    "y210le": "yuv422p10le",
}
"""Interleaved layouts, and the planar one of the same depth, subsampling and colours."""

ONE_THREAD = 1
"""FFmpeg writes some rows a few pixels too long, over what another thread has written of the next one."""

PLANAR = ("gray", "yuv", "gbr")
UNREAD = re.compile(r"f16|f32|32[bl]e|41[01]p")
"""Floats, which are no codes; codes of more than 16 bits; and colour for every fourth pixel alone."""


def planes(path: Path, frame: av.VideoFrame) -> list[NDArray[Any]]:
    """Return a frame's components as 2D arrays, in its own memory where that can be: R, G, B or Y, U, V (or Y alone),
    alpha last.

    Raises PsvideoError for a layout that is not read here.
    """
    name = frame.format.name
    if name in REPACKED:
        frame = frame.reformat(format=REPACKED[name], threads=ONE_THREAD)
    parts = frame.format.components
    known = (name.startswith(PLANAR) and not UNREAD.search(name)) or name in REPACKED
    if not known or len({part.plane for part in parts}) != len(parts):
        raise PsvideoError(
            f"{path}: its pixel format, {name}, is not read; expected YUV, RGB or grey. Export it as such."
        )
    return [_plane(frame, part) for part in parts]


def _plane(frame: av.VideoFrame, part: Any) -> NDArray[Any]:
    plane = frame.planes[part.plane]
    order = ">" if frame.format.name.endswith("be") else "<"
    code = np.dtype("u1") if part.bits <= 8 else np.dtype(f"{order}u2")
    rows = np.frombuffer(plane, code).reshape(-1, plane.line_size // code.itemsize)
    return rows[: part.height, : part.width].astype(code.newbyteorder("="), copy=False)
