"""DPX: grey or RGB of 8, 10, 12 or 16 bits. The header is read here, the pixels by FFmpeg, at full depth."""

import struct
from pathlib import Path

import av
import numpy as np

from psvideo.clip.decode.movies.ffmpeg_planes import planes
from psvideo.clip.decode.signatures import begins_like
from psvideo.clip.decoded import CodedPicture, Header
from psvideo.clip.transfer import LOGARITHMIC
from psvideo.errors import PsvideoError

BYTE_ORDERS = {b"SDPX": ">", b"XPDS": "<"}
CHANNELS = {6: 1, 50: 3, 51: 3}  # luma; RGB; RGBA
UNSET = 0xFFFFFFFF
TRANSFERS = {1: LOGARITHMIC, 3: LOGARITHMIC, 5: "rec709", 6: "rec709", 7: "rec709", 8: "rec709"}
"""Codes of SMPTE 268M, table 5A: 1 is printing density, as film scanners write it. 2 is linear, and says nothing, as
FFmpeg writes it into every file.
"""


def header(path: Path) -> Header:
    """Read the generic header (SMPTE 268M), and see that the file is as long as it says."""
    with path.open("rb") as file:
        head, end = _parse_header(path, file.read(2048))
    if path.stat().st_size < end:
        raise PsvideoError(f"{path}: is {path.stat().st_size} bytes, expected {end}: it is truncated. Copy it again.")
    return head


def decode(path: Path) -> CodedPicture:
    """Decode a whole picture."""
    head = header(path)
    try:
        with av.open(str(path), format="dpx_pipe") as container:
            found = planes(path, next(container.decode(video=0)))
    except av.FFmpegError as fault:
        raise PsvideoError(f"{path}: cannot be decoded ({fault.strerror}). Copy it again.") from fault
    codes = found[0].copy() if head.channels == 1 else np.stack(found[:3], axis=-1)
    return CodedPicture(header=head, codes=codes)


def _parse_header(path: Path, data: bytes) -> tuple[Header, int]:
    """Return what the header says, and where the picture's data end."""
    order = BYTE_ORDERS.get(data[:4])
    if order is None or len(data) < 2048:
        raise PsvideoError(f"{path}: does not begin like a DPX file{begins_like(data)}.")
    offset, width_px, height_px = (struct.unpack_from(order + "I", data, at)[0] for at in (4, 772, 776))
    descriptor, bits = data[800], data[803]
    packing, encoding = struct.unpack_from(order + "HH", data, 804)
    if descriptor not in CHANNELS or bits not in (8, 10, 12, 16) or encoding != 0 or (bits, packing) == (10, 0):
        raise PsvideoError(
            f"{path}: holds image element {descriptor} of {bits} bits, packing {packing}, encoding {encoding}; "
            "expected grey (6) or RGB (50, 51) of 8, 10 (filled), 12 or 16 bits, not run-length encoded. Export such."
        )
    samples = CHANNELS[descriptor] + (descriptor == 51)
    head = Header(
        width_px=width_px,
        height_px=height_px,
        channels=CHANNELS[descriptor],
        bits=bits,
        transfer=TRANSFERS.get(data[801]),
        time_code=_time_code(struct.unpack_from(order + "I", data, 1920)[0]),
        notes=("the DPX files' alpha channel is left out",) if descriptor == 51 else (),
    )
    return head, offset + height_px * _bytes_per_row(width_px * samples, bits, packing)


def _bytes_per_row(samples: int, bits: int, packing: int) -> int:
    """Rows end at whole 32-bit words; filled words (packing 1 and 2) hold three samples of 10 bits, or two of 12."""
    if bits in (8, 16):
        return samples * bits // 8
    if packing == 0:
        return -(-samples * bits // 32) * 4
    return -(-samples // 3) * 4 if bits == 10 else samples * 2


def _time_code(packed: int) -> str | None:
    """Return the SMPTE time code of the television header: eight decimal digits, one in each four bits."""
    digits = f"{packed:08x}"
    return None if packed == UNSET or not digits.isdecimal() else ":".join(digits[at : at + 2] for at in (0, 2, 4, 6))
