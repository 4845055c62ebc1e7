"""The decoders by kind of file. Each is a module with ``header(path)`` and ``decode(path)``.

Whatever goes wrong inside a decoder becomes a PsvideoError that names the file.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from psvideo.clip import dng, dpx, exr, jpeg, png, tiff
from psvideo.clip.record import Header, Picture
from psvideo.errors import PsvideoError


@dataclass(frozen=True, kw_only=True)
class Decoder:
    """How one kind of file is read."""

    header: Callable[[Path], Header]
    decode: Callable[[Path], Picture]


DECODERS = {
    "dng": Decoder(header=dng.header, decode=dng.decode),
    "dpx": Decoder(header=dpx.header, decode=dpx.decode),
    "exr": Decoder(header=exr.header, decode=exr.decode),
    "jpeg": Decoder(header=jpeg.header, decode=jpeg.decode),
    "png": Decoder(header=png.header, decode=png.decode),
    "tiff": Decoder(header=tiff.header, decode=tiff.decode),
}
Read = TypeVar("Read")


def read_header(kind: str, file: Path) -> Header:
    """Read what a picture's file says about itself, without decoding its pixels."""
    return _guarded(DECODERS[kind].header, file)


def decode(kind: str, file: Path) -> Picture:
    """Decode one picture."""
    return _guarded(DECODERS[kind].decode, file)


def _guarded(read: Callable[[Path], Read], file: Path) -> Read:
    """Call a decoder; its library may raise anything over a damaged file, and all of it means the same."""
    try:
        if file.stat().st_size == 0:
            raise PsvideoError(f"{file}: is empty (0 bytes). Copy it again from the camera's card.")
        return read(file)
    except PsvideoError:
        raise
    except FileNotFoundError:
        raise PsvideoError(f"{file}: is not there any more. Put the file back, or open the clip again.") from None
    except OSError as fault:
        raise PsvideoError(
            f"{file}: cannot be read ({fault.strerror or fault}). Check the file and its disk."
        ) from fault
    except Exception as fault:
        raise PsvideoError(
            f"{file}: cannot be decoded; it is truncated, damaged or of another kind than its name says ({fault}). "
            "Copy it again from the camera's card."
        ) from fault
