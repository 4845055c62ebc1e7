"""Whether an MP4 or QuickTime file breaks off, by its outermost boxes (ISO/IEC 14496-12, 4.2): cameras write the index
last, so that a copy that stopped half way holds pictures that nothing says how to read."""

from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

FIRST = {b"ftyp", b"wide", b"mdat", b"moov", b"free", b"skip", b"pnot"}
"""What such files begin with."""
INDEX = b"moov"
MOST_BOXES = 10_000
"""Outermost boxes that are looked at: a movie has a few, one in fragments two a second."""


def how_it_breaks_off(path: Path) -> str:
    """Return what says that a file breaks off, and what to do; empty for whole ones and for other containers.

    Raises OSError where it cannot be read.
    """
    size = path.stat().st_size
    with path.open("rb") as file:
        boxes = list(_outermost(file, size))
    if not boxes or boxes[0][0] not in FIRST:
        return ""
    kind, begin, end = boxes[-1]
    if end > size:
        return (
            f"is truncated: of the {end - begin} bytes of its last part ({kind.decode('latin-1')}) {size - begin} are "
            "there. Copy it again from the camera's card."
        )
    if not any(kind == INDEX for kind, _, _ in boxes):
        return (
            f"is truncated: it lacks its index ({INDEX.decode()}), which cameras write when a recording ends. Copy it "
            "again; where the recording itself was broken off, many cameras mend it once their card is put back."
        )
    return ""


def _outermost(file: BinaryIO, size: int) -> Iterator[tuple[bytes, int, int]]:
    """Yield the kind of every outermost box, where it begins and where it says that it ends."""
    begin = 0
    for _ in range(MOST_BOXES):
        if begin + 8 > size:
            return
        file.seek(begin)
        head = file.read(16)
        length, kind = int.from_bytes(head[:4]), head[4:8]
        if length == 1:
            length = int.from_bytes(head[8:16])
        elif length == 0:  # up to the file's end
            length = size - begin
        if length < 8:
            return
        yield kind, begin, begin + length
        begin += length
