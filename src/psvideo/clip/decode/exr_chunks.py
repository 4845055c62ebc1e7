"""Whether an OpenEXR file of scan lines is whole, judged by its table of chunks, without decoding a pixel; and one
number of its header, for thousands of files at once.

The library finds a truncated file too, but writes about it to the terminal by itself. The layout is that of the
"OpenEXR File Layout" document: magic number, version, attributes up to an empty name, then one offset per chunk.
"""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

MAGIC = 20000630
TILED, DEEP, SEVERAL_PARTS = 0x200, 0x800, 0x1000
# By compression: none, RLE, ZIPS, ZIP, PIZ, PXR24, B44, B44A, DWAA, DWAB.
NUMBERS = {8: "<d", 4: "<f"}
ROWS_PER_CHUNK = (1, 1, 1, 16, 32, 16, 32, 32, 32, 256)


def is_cut_short(path: Path) -> bool:
    """Return True where chunks are missing from the end; False too for layouts other than plain scan lines."""
    size = path.stat().st_size
    with path.open("rb") as file:
        try:
            magic, version = struct.unpack("<II", file.read(8))
            if magic != MAGIC or version & (TILED | DEEP | SEVERAL_PARTS):
                return False
            attributes = dict(_attributes(file, size))
            top, bottom = struct.unpack("<4i", attributes["dataWindow"])[1::2]
            rows = ROWS_PER_CHUNK[attributes["compression"][0]]
            count = (bottom - top) // rows + 1
            if count < 1:
                return False
            if 8 * count > size:
                return True
            offsets = struct.unpack(f"<{count}Q", file.read(8 * count))
            if max(offsets) + 8 > size:
                return True
            file.seek(max(offsets))
            _, length = struct.unpack("<iI", file.read(8))
        except struct.error:
            return True
        except (KeyError, IndexError):
            return False
    return bool(min(offsets) == 0 or max(offsets) + 8 + length > size)


def number_in_header(path: Path, name: str) -> float | None:
    """Return the number that a file's (first) header holds under a name; None where it holds none, or cannot be
    read."""
    try:
        size = path.stat().st_size
        with path.open("rb") as file:
            (magic, _) = struct.unpack("<II", file.read(8))
            value = next((value for key, value in _attributes(file, size) if key == name), b"")
        return float(struct.unpack(NUMBERS[len(value)], value)[0]) if magic == MAGIC and value else None
    except (OSError, struct.error, KeyError, UnicodeDecodeError):
        return None


def _attributes(file: BinaryIO, size: int) -> Iterator[tuple[str, bytes]]:
    """Yield the attributes' names and values; leaves the file at the table of chunks."""
    while name := _text(file):
        _text(file)
        (length,) = struct.unpack("<I", file.read(4))
        if length > size:
            raise struct.error("the file ends inside a value")
        yield name, file.read(length)


def _text(file: BinaryIO) -> str:
    letters = bytearray()
    while (letter := file.read(1)) != b"\0":
        if not letter:
            raise struct.error("the file ends inside a name")
        letters += letter
    return letters.decode("latin-1")
