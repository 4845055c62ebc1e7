"""16-bit PNG maps of 0 to 1, tagged as linear, so that no program that reads tags takes numbers for sRGB colours.

A PNG cannot say "data". What it can say (PNG, third edition): gAMA 1.0, and cICP with the transfer function linear,
primaries of BT.709, full range. A program that honours either converts from linear to its linear working space, which
changes nothing. Text chunks name the space and direction of y, as the attributes of the EXR files do.
"""

import struct
import zlib
from collections.abc import Mapping
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.errors import PsvideoError
from psvideo.formats.whole_files import whole_file

PNG_MAX = 65535
GAMMA_1 = struct.pack(">I", 100_000)  # in hundred-thousandths
BT709, LINEAR, RGB_MATRIX, FULL_RANGE = 1, 8, 0, 1  # ITU-T H.273
NOT_COMPRESSED_NO_LANGUAGE = bytes(5)
"""What stands between keyword and text of an iTXt chunk: the keyword's end, flag, method, language, translation."""
_HEADER_END = 33  # signature 8, IHDR 4 + 4 + 13 + 4


def encode_normals(normals: NDArray[np.floating]) -> NDArray[np.uint16]:
    """Return unit normals as 16-bit codes, 0.5 + 0.5 n over 0 to 65535; (0, 0, 0) becomes the middle."""
    codes = np.empty(normals.shape, np.uint16)
    for axis in range(normals.shape[-1]):  # one by one: float64 of whole pictures is large
        codes[..., axis] = np.clip(0.5 + 0.5 * normals[..., axis].astype(np.float64), 0, 1) * PNG_MAX + 0.5
    return codes


def decode_normals(codes: NDArray[np.uint16]) -> NDArray[np.float32]:
    """Return normals from their 16-bit codes, made unit again; what lies about the middle is (0, 0, 0)."""
    normals = codes.astype(np.float64) / PNG_MAX * 2 - 1
    length = np.linalg.norm(normals, axis=-1, keepdims=True)
    unit = np.where(length > 0.5, normals / np.maximum(length, 1e-9), 0.0)
    return unit.astype(np.float32)


def write_png16(path: Path, codes: NDArray[np.uint16], *, texts: Mapping[str, str] | None = None) -> None:
    """Write a 16-bit PNG, grey or R, G, B, tagged as linear, with ``texts`` by keyword; whole or not at all.

    OpenCV's own choice for PNG (fastest deflate of differences along rows) takes a third of what any level that is
    named takes, and its files are smaller.
    """
    done, data = cv2.imencode(".png", codes if codes.ndim == 2 else codes[..., ::-1])
    if not done:
        raise PsvideoError(f"{path}: the picture of shape {codes.shape} cannot be encoded as PNG.")
    with whole_file(path) as beside:
        beside.write_bytes(_tagged(data.tobytes(), texts or {}))


def _tagged(png: bytes, texts: Mapping[str, str]) -> bytes:
    """Return a PNG with its tags put in before the pixels, where they have to stand."""
    colour = _chunk(b"cICP", bytes([BT709, LINEAR, RGB_MATRIX, FULL_RANGE])) + _chunk(b"gAMA", GAMMA_1)
    words = [_text(key, text) for key, text in texts.items()]
    return png[:_HEADER_END] + colour + b"".join(words) + png[_HEADER_END:]


def _text(key: str, text: str) -> bytes:
    """Return a chunk that holds a text: in UTF-8 where Latin-1, which more programs read, does not hold it."""
    try:
        return _chunk(b"tEXt", key.encode("latin-1") + b"\0" + text.encode("latin-1"))
    except UnicodeEncodeError:
        return _chunk(b"iTXt", key.encode("latin-1") + NOT_COMPRESSED_NO_LANGUAGE + text.encode("utf-8"))


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
