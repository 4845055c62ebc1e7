"""The decoders by kind of file. Each is a module with ``header(path)`` and ``decode(path)``.

Only the one that is needed is imported: the libraries behind them take time and memory.
Whatever goes wrong inside a decoder becomes a PsvideoError that names the file. What the libraries that are installed
here can read is asked here too.
"""

from collections.abc import Callable
from functools import partial
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import TypeVar

from psvideo.clip.decoded import CodedPicture, Header, PictureInFile
from psvideo.errors import PsvideoError
from psvideo.formats.paths import check_file, not_there
from psvideo.model.units import counted

Read = TypeVar("Read")

MOVIE_CODECS = {"ProRes": "prores", "H.264": "h264", "H.265 (HEVC)": "hevc", "DNxHD and DNxHR": "dnxhd", "FFV1": "ffv1"}
"""What cameras and recorders write, by FFmpeg's names of the decoders."""


def read_header(kind: str, file: Path) -> Header:
    """Read what a picture's file says about itself, without decoding its pixels."""
    find: Callable[[Path], Header] = _module(kind).header
    return guarded(find, file)


def decode(kind: str, file: Path) -> CodedPicture:
    """Decode one picture."""
    read: Callable[[Path], CodedPicture] = _module(kind).decode
    picture = guarded(read, file)
    head = picture.header
    if picture.codes.shape != (head.height_px, head.width_px, 3)[: 2 if head.channels == 1 else 3]:
        raise PsvideoError(
            f"{file}: says that it is {head.width_px} x {head.height_px} pixels of "
            f"{counted(head.channels, 'channel')}, and holds an array of {picture.codes.shape}: it is damaged. "
            "Copy it again from the camera's card."
        )
    return picture


def opened(kind: str, file: Path, *, of_clip: bool = False) -> CodedPicture | PictureInFile:
    """Decode one picture, or leave it in its file where it is large and lies there as it would in memory. ``of_clip``:
    one of many of which a few are held at a time, which stay in their files from a smaller size on."""
    if kind == "tiff":
        from psvideo.clip.decode import tiff

        return guarded(partial(tiff.opened, of_clip=of_clip), file)
    return decode(kind, file)


def _module(kind: str) -> ModuleType:
    return import_module(f"psvideo.clip.decode.{kind}")


def guarded(read: Callable[[Path], Read], file: Path) -> Read:
    """Call a decoder; its library may raise anything over a damaged file, and all of it means the same."""
    try:
        check_file(file)
        if file.stat().st_size == 0:
            raise PsvideoError(f"{file}: is empty (0 bytes). Copy it again from the camera's card.")
        return read(file)
    except PsvideoError:
        raise
    except FileNotFoundError:
        raise not_there(file) from None
    except OSError as fault:
        raise PsvideoError(
            f"{file}: cannot be read ({fault.strerror or fault}). Check the file and its disk."
        ) from fault
    except Exception as fault:
        raise PsvideoError(
            f"{file}: cannot be decoded; it is truncated, damaged or of another kind than its name says ({fault}). "
            "Copy it again from the camera's card."
        ) from fault


def movie_decoders() -> dict[str, bool]:
    """Return of each kind of movie whether it can be decoded. Raises ImportError where PyAV cannot be loaded."""
    codec = import_module("av.codec")
    return {name: decoder in codec.codecs_available for name, decoder in MOVIE_CODECS.items()}


def raw_library() -> str:
    """Return the version of LibRaw that decodes DNG. Raises ImportError where rawpy cannot be loaded."""
    return ".".join(str(part) for part in import_module("rawpy").libraw_version)


def curve_library() -> str:
    """Return OpenColorIO's version. Raises ImportError where it cannot be loaded."""
    return str(import_module("PyOpenColorIO").GetVersion())


def exr_library() -> str:
    """Return OpenEXR's version. Raises ImportError where it cannot be loaded."""
    return str(import_module("OpenEXR").OPENEXR_VERSION)
