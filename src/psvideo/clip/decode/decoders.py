"""The decoders by kind of file. Each is a module with ``header(path)`` and ``decode(path)``.

Only the one that is needed is imported: the libraries behind them take time and memory.
Whatever goes wrong inside a decoder becomes a PsvideoError that names the file.
"""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import TypeVar

from psvideo.clip.record import CodedPicture, Header
from psvideo.errors import PsvideoError

Read = TypeVar("Read")


def read_header(kind: str, file: Path) -> Header:
    """Read what a picture's file says about itself, without decoding its pixels."""
    find: Callable[[Path], Header] = _module(kind).header
    return guarded(find, file)


def decode(kind: str, file: Path) -> CodedPicture:
    """Decode one picture."""
    read: Callable[[Path], CodedPicture] = _module(kind).decode
    return guarded(read, file)


def _module(kind: str) -> ModuleType:
    return import_module(f"psvideo.clip.decode.{kind}")


def guarded(read: Callable[[Path], Read], file: Path) -> Read:
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
