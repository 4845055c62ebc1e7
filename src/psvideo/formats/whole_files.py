"""Files appear whole or not at all: written beside their final name, then renamed."""

import contextlib
import os
import zlib
from collections.abc import Iterator
from pathlib import Path

from psvideo.errors import PsvideoError, UsageError


@contextlib.contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Give a temporary name beside ``path`` to write to; rename it when the block ends well, else remove it.

    A full disk or a folder that cannot be written becomes a PsvideoError that names the file.
    """
    beside = path.with_name(f".{path.name}.{os.getpid()}.partial")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield beside
        beside.replace(path)
    except OSError as fault:
        raise PsvideoError(
            f"{path}: cannot be written ({fault.strerror or fault}). Nothing was left under that name: make room or "
            "check the folder's permissions, then run the command again."
        ) from fault
    finally:
        with contextlib.suppress(OSError):
            beside.unlink(missing_ok=True)


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


def refuse_existing(path: Path, *, force: bool, mark: str | None = None) -> None:
    """Raise UsageError where an output exists already and ``force`` does not allow to replace it.

    ``mark`` is a word that a file of this kind holds: what does not is not replaced, even with ``force``.
    """
    if not path.exists():
        return
    if not force:
        raise UsageError(f"{path}: exists already. Name another output, or give `force` to replace it.")
    if mark is not None and not (path.is_file() and mark.encode() in path.read_bytes()[:4096]):
        raise UsageError(
            f"{path}: exists and is nothing that this command wrote (no {mark!r} in it), so it is not replaced, not "
            "even with `force`. Name another output."
        )
