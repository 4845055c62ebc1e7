"""JPEG: 8 bits, lossy. Read with a warning: it moves normals by a degree or more."""

from pathlib import Path

import imagecodecs
import numpy as np
from numpy.typing import NDArray

from psvideo.clip.decode.signatures import begins_like
from psvideo.clip.decoded import CodedPicture, Header
from psvideo.errors import PsvideoError
from psvideo.model.units import counted

START, END, PROGRESSIVE = b"\xff\xd8", b"\xff\xd9", b"\xff\xc2"
TAIL = 1024
NO_LENGTH = {0x01, *range(0xD0, 0xD9)}
FRAME_MARKERS = {*range(0xC0, 0xD0)} - {0xC4, 0xC8, 0xCC}
BLOCK = 8
LOSSY = "JPEG pictures have 8 bits and are lossy, which costs accuracy; record PNG, TIFF, DPX, EXR or DNG"


def header(path: Path) -> Header:
    """Read the size and the channels from the file's markers."""
    return _parse_header(path, path.read_bytes())


def decode(path: Path) -> CodedPicture:
    """Decode a whole picture. A truncated file is refused, which decoders fill with grey."""
    data = path.read_bytes()
    header = _parse_header(path, data)
    codes = imagecodecs.jpeg8_decode(data)
    if (PROGRESSIVE in data or _ends_evenly(codes)) and _breaks_off(data):
        raise PsvideoError(f"{path}: its picture breaks off before its end: it is truncated. Copy it again.")
    return CodedPicture(header=header, codes=codes)


def _ends_evenly(codes: NDArray[np.uint8]) -> bool:
    """Return whether the last block has a single colour, as where the decoder had nothing left to fill it with."""
    return not np.ptp(codes[-BLOCK:, -BLOCK:], axis=(0, 1)).any()


def _breaks_off(data: bytes) -> bool:
    """Return whether a picture's coded light ends early in spite of its end marker: libjpeg paints the rest over and
    says so to no caller; FFmpeg refuses."""
    import av

    decoder = av.CodecContext.create("mjpeg", "r")
    decoder.options = {"err_detect": "explode"}
    try:
        decoder.decode(av.Packet(data))
    except av.error.InvalidDataError:
        return True
    except av.FFmpegError:  # of a way of coding that it does not know
        return False
    return False


def _parse_header(path: Path, data: bytes) -> Header:
    if data.startswith(START) and END not in data[-TAIL:]:
        raise PsvideoError(f"{path}: ends before its end marker: it is truncated. Copy it again.")
    if data[:2] != START:
        raise PsvideoError(f"{path}: does not begin like a JPEG file{begins_like(data)}.")
    place = 2
    while data.startswith(START) and place + 9 < len(data):
        marker = data[place + 1]
        if marker in FRAME_MARKERS:
            height_px, width_px = (int.from_bytes(data[place + at : place + at + 2]) for at in (5, 7))
            channels = data[place + 9]
            if data[place + 4] != 8 or channels not in (1, 3):
                raise PsvideoError(
                    f"{path}: has {counted(channels, 'channel')}{' (CMYK, for printing)' * (channels == 4)} of "
                    f"{data[place + 4]} bits; expected grey or RGB of 8 bits. Export it as such."
                )
            return Header(width_px=width_px, height_px=height_px, channels=channels, bits=8, warnings=(LOSSY,))
        place += 2 if marker in NO_LENGTH else 2 + int.from_bytes(data[place + 2 : place + 4])
    raise PsvideoError(
        f"{path}: is truncated: it does not say how large its picture is. Copy it again, or export another kind."
    )
