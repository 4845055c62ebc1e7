"""One EXR file: named channels with their attributes, losslessly compressed, whole or not at all."""

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np
import OpenEXR
from numpy.typing import NDArray

from psvideo.compute.spilled import let_go
from psvideo.formats.exr_stream import write_streamed
from psvideo.formats.whole_files import whole_file
from psvideo.model.choices import USUAL_COMPRESSION, Compression

_INT32_MAX = 2**31 - 1
AT_ONCE_ROWS = 256
"""What lies in files is let go after this many rows that were looked at."""
CHUNK_LINES: dict[Compression, int] = {"zip": 16, "zips": 1, "piz": 32, "rle": 1, "none": 1}
"""So many lines are packed, and written, together."""

_COMPRESSIONS: dict[Compression, object] = {
    "zip": OpenEXR.ZIP_COMPRESSION,
    "zips": OpenEXR.ZIPS_COMPRESSION,
    "piz": OpenEXR.PIZ_COMPRESSION,
    "rle": OpenEXR.RLE_COMPRESSION,
    "none": OpenEXR.NO_COMPRESSION,
}

Channels = Mapping[str, NDArray[np.floating]]
Attribute = str | int | float | Fraction | tuple[float, ...]


SHARED = ("chromaticities",)
"""Attributes that must be alike in all parts of a file (OpenEXR, multi-part files)."""


@dataclass(frozen=True, kw_only=True)
class Crop:
    """Where a cut-out picture lies in the whole one: its top left pixel, and the whole picture's size."""

    row: int
    col: int
    full_height_px: int
    full_width_px: int


def write_exr(
    path: Path,
    channels: Channels,
    *,
    half: bool = True,
    attributes: Mapping[str, Attribute] | None = None,
    fps: Fraction | None = None,
    time_code: str | None = None,
    crop: Crop | None = None,
    compression: Compression = USUAL_COMPRESSION,
) -> None:
    """Write one picture; the file appears under its name when it is whole, and folders are made as needed.

    ``channels`` maps names ("R", "G", "B", "Y", "valid") to planes of one shape (row, col). ``half`` stores 16-bit
    floats, and values beyond ±65504 as ±65504, the largest it has; otherwise 32-bit. ``attributes`` go into the header
    as text, int or float (32-bit: EXR's readers in Python give other numbers as arrays). ``fps`` becomes the standard
    attribute framesPerSecond, ``time_code`` ("01:02:03:04", or ";04" for drop frame) timeCode. With ``crop`` the
    planes are a part of a larger picture: displayWindow stays whole, dataWindow is the part.

    Raises PsvideoError where the file cannot be written, and ValueError for what must never be in a file: NaN,
    infinity, planes of different shapes.
    """
    planes = {name: _plane(name, values, half) for name, values in channels.items()}
    shapes = {plane.shape for plane in planes.values()}
    if len(shapes) != 1:
        raise ValueError(f"{path}: the channels' planes differ in shape or there are none: {sorted(shapes)}")
    header = dict(attributes or {}) | _header(shapes.pop(), fps, time_code, crop, compression)
    with whole_file(path) as beside:
        stored, lines = tuple(planes.values()), CHUNK_LINES[compression]
        write_streamed(path, beside, lambda stream: OpenEXR.File(header, planes).write(stream), stored, lines)


def _plane(name: str, values: NDArray[np.floating], half: bool) -> NDArray[np.floating]:
    """The channel as it is stored. OpenEXR takes every array for contiguous, and writes strided ones garbled."""
    if values.ndim != 2:
        raise ValueError(f"channel {name!r} has shape {values.shape}; expected (row, col)")
    if values.dtype == np.float16:
        stored = np.ascontiguousarray(values)
        finite = all(_finite(stored[first : first + AT_ONCE_ROWS]) for first in range(0, len(stored), AT_ONCE_ROWS))
    elif half:
        from psvideo.compute.halves import halves_of  # loads the compiler, which reading and help do without

        stored, finite = halves_of(values.astype(np.float32, copy=False))
    else:
        stored = values.astype(np.float32, order="C", copy=False)
        finite = all(_finite(stored[first : first + AT_ONCE_ROWS]) for first in range(0, len(stored), AT_ONCE_ROWS))
    if not finite:
        raise ValueError(f"channel {name!r} holds NaN or infinity; missing pixels are 0 and marked in 'valid'")
    return np.asarray(stored if half else np.ascontiguousarray(stored, np.float32))


def _finite(rows: NDArray[np.floating]) -> bool:
    if rows.dtype == np.float16:
        # the bits of positive infinity and, as unsigned ones, of negative infinity; NaN's are above
        finite = int(rows.view(np.int16).max()) < 0x7C00 and int(rows.view(np.uint16).max()) < 0xFC00
    else:
        finite = bool(np.isfinite(rows).all())
    let_go(rows)
    return finite


def _header(
    shape: tuple[int, ...],
    fps: Fraction | None,
    time_code: str | None,
    crop: Crop | None,
    compression: Compression,
) -> dict[str, object]:
    rows, cols = shape
    whole = crop or Crop(row=0, col=0, full_height_px=rows, full_width_px=cols)
    if not (0 <= whole.row <= whole.full_height_px - rows and 0 <= whole.col <= whole.full_width_px - cols):
        raise ValueError(f"a part of {rows} x {cols} pixels does not lie inside {whole}")
    header: dict[str, object] = {
        "type": OpenEXR.scanlineimage,
        "compression": _COMPRESSIONS[compression],
        "dataWindow": _box(whole.row, whole.col, rows, cols),
        "displayWindow": _box(0, 0, whole.full_height_px, whole.full_width_px),
    }
    if fps is not None:
        header["framesPerSecond"] = _rational(fps)
    if time_code is not None:
        header["timeCode"] = _time_code(time_code)
    return header


def _box(row: int, col: int, rows: int, cols: int) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    return np.array([col, row], np.int32), np.array([col + cols - 1, row + rows - 1], np.int32)


def _rational(fps: Fraction) -> Fraction:
    """The rate as EXR stores it: numerator and denominator of 32 bits."""
    for limit in (_INT32_MAX, 1_000_000, 1_001):
        near = fps.limit_denominator(limit)
        if 0 < near.numerator <= _INT32_MAX:
            return near
    raise ValueError(f"{fps} is no frame rate")


def _time_code(text: str) -> "OpenEXR.TimeCode":
    """SMPTE time code: hours, minutes, seconds and frame (0 to 29) of ``01:02:03:04``."""
    code = OpenEXR.TimeCode()
    head, separator, frame = text.rpartition(";") if ";" in text else text.rpartition(":")
    hours, minutes, seconds = (int(part) for part in head.split(":"))
    code.hours, code.minutes, code.seconds, code.frame = hours, minutes, seconds, int(frame)
    code.dropFrame = separator == ";"
    return code


def write_exr_parts(
    path: Path,
    parts: Mapping[str, Channels],
    *,
    half: bool | Mapping[str, bool] = True,
    attributes: Mapping[str, Mapping[str, Attribute]],
    fps: Fraction | None = None,
    time_code: str | None = None,
    compression: Compression = USUAL_COMPRESSION,
) -> None:
    """Write one file with a part per name; each has its own channels and ``attributes``, else as ``write_exr``.

    ``half`` may be given part by part. What the standard has all parts share is that of the first one which has it.
    """
    built, every = [], list[NDArray[np.floating]]()
    shared = {key: one[key] for one in reversed([*attributes.values()]) for key in SHARED if key in one}
    for name, channels in parts.items():
        short = half if isinstance(half, bool) else half[name]
        planes = {channel: _plane(channel, values, short) for channel, values in channels.items()}
        header = (
            dict(attributes[name])
            | shared
            | _header(next(iter(planes.values())).shape, fps, time_code, None, compression)
        )
        every += planes.values()  # which Part replaces by channels of its own
        built.append(OpenEXR.Part(header, planes, name))
    with whole_file(path) as beside:
        lines = CHUNK_LINES[compression]
        write_streamed(path, beside, lambda stream: OpenEXR.File(built).write(stream), every, lines)
