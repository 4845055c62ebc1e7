"""OpenEXR: half or float, grey (Y) or R, G, B, read as they are: EXR holds linear light.

Channels may stand in a layer (``key.R``), or in a later part of a file whose first part shows none, as renderers and
compositors write them; an alpha channel is left out. A picture whose data window is narrower than
its display window is put in its place with 0 around it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import OpenEXR
from numpy.typing import NDArray

from psvideo.clip.decode.exr_channels import Choose, picture_channels
from psvideo.clip.decode.exr_chunks import is_cut_short
from psvideo.clip.decoded import CodedPicture, Header, shot_of
from psvideo.errors import PsvideoError
from psvideo.formats.paths import check_file

LUMINANCE = "the EXR files hold colour as differences (RY, BY), which are left out: they are read as grey (Y)"
OF_THE_CONTAINER = ("type", "name", "chunkCount", "pixelAspectRatio", "screenWindowWidth")


def header(path: Path) -> Header:
    """Read what the file says without decoding its pixels."""
    return header_of(path, partial(picture_channels, path))


def header_of(path: Path, choose: Choose) -> Header:
    """Read what the file says of the channels that ``choose`` takes, without decoding its pixels."""
    with _open(path, header_only=True) as file:
        return _header(file, *choose(_names(file)))


def decode(path: Path) -> CodedPicture:
    """Decode a whole picture."""
    return decode_channels(path, partial(picture_channels, path))


def decode_channels(path: Path, choose: Choose) -> CodedPicture:
    """Decode the channels that ``choose`` takes from the names of all, one or three: half floats, where all are."""
    header_of(path, choose)
    with _open(path, header_only=False) as file:
        part, names = choose(_names(file))
        channels = file.channels(part)
        planes = [channels[name].pixels for name in names]
        head = _header(file, part, names)
        return CodedPicture(header=head, codes=_in_display_window(_side_by_side(planes), file.header(part), head))


def _side_by_side(planes: list[NDArray[Any]]) -> NDArray[Any]:
    """Return planes as one picture, (row, col) or (row, col, channel), in half floats if all of them are."""
    if any(plane.dtype != np.float16 for plane in planes):
        planes = [plane.astype(np.float32, copy=False) for plane in planes]
    if len(planes) == 1:
        return planes[0]
    if planes[0].dtype == np.float16:  # merged as bits, which takes a fifth of numpy's time
        return np.asarray(cv2.merge([plane.view(np.uint16) for plane in planes])).view(np.float16)
    return np.stack(planes, axis=-1)


@dataclass(frozen=True, kw_only=True)
class Stored:
    """A picture as its file stores it: one plane (row, col) per channel (R, G, B, or Y), float16 or float32, and the
    header's attributes that can be written in a line."""

    planes: tuple[NDArray[np.floating], ...]
    attributes: Mapping[str, str | int | float | None]


def read_halves(path: Path) -> Stored:
    """Read a picture without making floats of its halves, for showing it: a third of the time that ``decode`` takes.

    What lies outside the data window is 0. Raises PsvideoError where the file is damaged or holds no one picture.
    """
    with _open(path, header_only=False) as file:
        part, names = picture_channels(path, _names(file))
        channels, head = file.channels(part), _header(file, part, names)
        planes = tuple(_in_display_window(channels[name].pixels, file.header(part), head) for name in names)
        return Stored(planes=planes, attributes=_lines(dict(file.header(part))))


def contents(path: Path, *, header_only: bool = True) -> tuple[list[str], dict[str, str | int | float | None]]:
    """Return the names of all channels, and the attributes that can be written in a line, with the picture's size.

    The channels of a file of several parts are named ``part.channel``; attributes are the first part's. Without
    ``header_only`` the pixels are decoded too, which shows whether the file is whole.
    """
    with _open(path, header_only=header_only) as file:
        parts = [dict(part.header) for part in file.parts]
    names = [
        f"{part['name']}.{channel.name}" if len(parts) > 1 else channel.name
        for part in parts
        for channel in sorted(part["channels"], key=_usual_order)
    ]
    width_px, height_px = _size(parts[0]["displayWindow"])
    return names, {"width_px": width_px, "height_px": height_px} | _lines(parts[0])


def _lines(attributes: Mapping[str, Any]) -> dict[str, str | int | float | None]:
    """Return the attributes that can be written in a line."""
    found: dict[str, str | int | float | None] = {}
    for name, value in attributes.items():
        if name == "timeCode":
            found[name] = _time_code(value)
        elif isinstance(value, str | int | float) and name not in OF_THE_CONTAINER:
            found[name] = value
        elif isinstance(value, Fraction):
            found[name] = str(value)
    return found


def _usual_order(channel: Any) -> tuple[str, int, str]:
    """R, G, B, A of one layer stay together in this order; EXR itself sorts by name."""
    layer, _, name = channel.name.rpartition(".")
    return layer, "RGBA".find(name) if name in "RGBA" else 4, name


def _open(path: Path, *, header_only: bool) -> Any:
    """Open a file; OpenEXR reports damage in several ways, which all end here."""
    try:
        check_file(path)
        cut_short = is_cut_short(path)
    except OSError as fault:
        raise PsvideoError(
            f"{path}: cannot be read ({fault.strerror or fault}). Check the file and its disk."
        ) from fault
    if cut_short:
        raise PsvideoError(f"{path}: ends before its last rows: it is truncated. Copy it again.")
    try:
        file = OpenEXR.File(str(path), separate_channels=True, header_only=header_only)
        if not file.parts:  # pixels that cannot be decoded are no error to it, but a file of nothing
            raise ValueError("its pixels cannot be decoded")
        file.header()
    except MemoryError:
        raise
    except Exception as fault:  # of attributes that make no sense too: a rate of 0/0 divides by zero
        raise PsvideoError(
            f"{path}: cannot be read as OpenEXR; it is truncated, damaged or of another kind ({fault}). Copy it again."
        ) from fault
    return file


def _names(file: Any) -> list[list[str]]:
    return [[channel.name for channel in part.header["channels"]] for part in file.parts]


def _header(file: Any, part: int, names: tuple[str, ...]) -> Header:
    attributes = file.header(part)
    width_px, height_px = _size(attributes["displayWindow"])
    kinds = {channel.name.rpartition(".")[2] for channel in attributes["channels"]}
    alpha = ("the EXR files' alpha channel is left out",) if "A" in kinds else ()
    chroma = (LUMINANCE,) if {"RY", "BY"} <= kinds and len(names) == 1 else ()
    return Header(
        width_px=width_px,
        height_px=height_px,
        channels=len(names),
        bits=None,
        colour=attributes.get("colorInteropID"),
        time_code=_time_code(attributes.get("timeCode")),
        shot=shot_of(attributes),
        warnings=chroma,
        notes=alpha,
    )


def _size(window: tuple[NDArray[np.int32], NDArray[np.int32]]) -> tuple[int, int]:
    corner, far_corner = window
    return int(far_corner[0] - corner[0] + 1), int(far_corner[1] - corner[1] + 1)


def _time_code(code: Any) -> str | None:
    if code is None:
        return None
    mark = ";" if code.dropFrame else ":"
    return f"{code.hours:02d}:{code.minutes:02d}:{code.seconds:02d}{mark}{code.frame:02d}"


def alpha(path: Path) -> NDArray[np.floating] | None:
    """Return the first part's alpha channel, (row, col), 0 outside its data window; None where it has none."""
    with _open(path, header_only=False) as file:
        plane, attributes = file.channels().get("A"), file.header()
        if plane is None:
            return None
        width_px, height_px = _size(attributes["displayWindow"])
        head = Header(width_px=width_px, height_px=height_px, channels=1, bits=None)
        return _in_display_window(plane.pixels, attributes, head)


def _in_display_window(codes: NDArray[Any], attributes: Any, head: Header) -> NDArray[Any]:
    display, data = attributes["displayWindow"], attributes["dataWindow"]
    if codes.shape[:2] == (head.height_px, head.width_px) and np.array_equal(display[0], data[0]):
        return codes
    canvas = np.zeros((head.height_px, head.width_px, *codes.shape[2:]), codes.dtype)
    col, row = (int(data[0][axis] - display[0][axis]) for axis in (0, 1))
    top, left = max(row, 0), max(col, 0)
    part = codes[top - row : max(head.height_px - row, 0), left - col : max(head.width_px - col, 0)]
    canvas[top : top + part.shape[0], left : left + part.shape[1]] = part
    return canvas
