"""Files appear whole or not at all: written beside their final name, then renamed."""

import contextlib
import glob
import os
import platform
import sys
import zlib
from collections.abc import Iterator
from pathlib import Path

from psvideo.errors import PsvideoError, UsageError

HERE = f"{zlib.crc32(platform.node().encode()):08x}"
"""This computer, in names of files that are being written: others may write into the same folder over a network."""


@contextlib.contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Give a temporary name beside ``path`` to write to; rename it when the block ends well, else remove it.

    A full disk or a folder that cannot be written becomes a PsvideoError that names the file.
    """
    beside = _beside(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield beside
        beside.replace(path)
    except OSError as fault:
        raise not_written(path, fault) from fault
    finally:
        with contextlib.suppress(OSError):
            beside.unlink(missing_ok=True)


def check_can_be_written(path: Path) -> None:
    """Raise PsvideoError where a file could not be written, long before there is what to write; nothing is left."""
    there = path
    while not there.parent.exists():
        there = there.parent
    beside = _beside(there)
    try:
        beside.touch(exist_ok=False)
        beside.unlink()
    except FileExistsError:  # this process is writing it already
        return
    except OSError as fault:
        raise not_written(path, fault) from fault


def _beside(path: Path) -> Path:
    return path.with_name(f".{path.name}.{os.getpid()}-{HERE}.partial")


def not_written(path: Path, fault: OSError) -> PsvideoError:
    """Return what to raise where a file or folder cannot be written."""
    return PsvideoError(
        f"{path}: cannot be written ({fault.strerror or fault}). Nothing was left under that name: make room or "
        "check the folder's permissions, then run the command again."
    )


def write_text(path: Path, text: str) -> None:
    """Write a small text file, whole or not at all."""
    with whole_file(path) as beside:
        beside.write_text(text, encoding="utf-8")


PICTURE_MARK = "psvideo-picture"
"""What pictures that commands draw hold near their start, so that ``force`` replaces these and nobody else's."""
_PNG_HEAD_BYTES = 33
"""A PNG's signature and its first chunk, IHDR, whose size is fixed (PNG specification, 5.2 and 11.2.1)."""


def marked_png(data: bytes) -> bytes:
    """Return an encoded PNG with a text chunk that says that psvideo drew it (PNG specification, 11.3.3.2)."""
    kind_and_text = b"tEXtSoftware\x00" + PICTURE_MARK.encode("latin-1")
    length, check = len(kind_and_text) - 4, zlib.crc32(kind_and_text)
    chunk = length.to_bytes(4, "big") + kind_and_text + check.to_bytes(4, "big")
    return data[:_PNG_HEAD_BYTES] + chunk + data[_PNG_HEAD_BYTES:]


def is_drawn(path: Path) -> bool:
    """Return whether a picture is one that a command drew, such as ``rig.png`` beside a rig, and no photograph."""
    return path.suffix.lower() == ".png" and PICTURE_MARK.encode() in _beginning(path)


def refuse_existing(path: Path, *, force: bool, mark: str | None = None) -> None:
    """Raise UsageError where an output exists already and ``force`` does not allow to replace it, or would lie below a
    file, and PsvideoError where it could not be written; what earlier runs that were killed left beside it is removed.

    ``mark`` is a word that a file of this kind holds: what does not is not replaced, even with ``force``.
    """
    above = next((one for one in path.absolute().parents if one.exists()), path.parent)
    if above.is_file():
        raise UsageError(f"{path}: cannot be written, as {above} is a file. Name an output in a folder.")
    _remove_left(path)
    there = path.exists()
    if there and not force:
        raise UsageError(f"{path}: exists already. Name another output, or give `force` to replace it.")
    if there and mark is not None and not (path.is_file() and mark.encode() in _beginning(path)):
        raise UsageError(
            f"{path}: exists and is nothing that this command wrote (no {mark!r} in it), so it is not replaced, not "
            "even with `force`. Name another output."
        )
    check_can_be_written(path)


def check_ending(path: Path, *endings: str, name: str) -> None:
    """Raise UsageError where an output given as option ``name`` has none of the ``endings`` of what is written to it
    ("" among them is none at all): programs would not know the file."""
    if path.suffix.lower() not in endings:
        such = path.with_name(path.name + endings[0]) if not path.suffix else path.with_suffix(endings[0])
        wanted = " or ".join(filter(None, endings))
        raise UsageError(f"`{name}` {path}: expected a name that ends in {wanted}, such as {such}.")


def _beginning(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(4096)


def _remove_left(path: Path) -> None:
    """Remove what processes of this computer that are no more had begun to write under this name."""
    end = f"-{HERE}.partial"
    for left in path.parent.glob(f".{glob.escape(path.name)}.*{end}"):
        process = left.name.removesuffix(end).rpartition(".")[2]
        if process.isdecimal() and not _runs(int(process)):
            with contextlib.suppress(OSError):
                left.unlink()


def _runs(process: int) -> bool:
    """Return whether a process of this number may be running."""
    if sys.platform == "win32":
        return True  # there the same call would end it
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True
    return True
