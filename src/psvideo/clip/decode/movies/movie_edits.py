"""Which of a movie's frames its edit list shows (ISO/IEC 14496-12, 8.6.6), in .mp4 and .mov.

Phones and editors cut a movie without coding it again: all frames stay in the file, and the list says which of them
play. Frames keep the times at which they were taken, so that a cut in the middle is a gap, and one that plays twice
counts once.
"""

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

CONTAINERS = {b"moov", b"trak", b"edts", b"mdia"}
DEEPEST = 3
WANTED = {b"mvhd", b"tkhd", b"elst", b"mdhd"}
MOST_BYTES = 1 << 20
"""Longer descriptions are none that a camera writes: an edit takes 12 or 20 bytes."""
ONE = 65536


@dataclass(frozen=True, kw_only=True)
class Edits:
    """The spans of a track that play, [begin, end) in the units of its timestamps, rounded by up to ``rounding``."""

    spans: tuple[tuple[float, float], ...]
    rounding: float

    def shown(self, timestamps: Sequence[int]) -> tuple[int, ...]:
        """Return those timestamps, in ascending order, that lie in a span: as players do, and FFmpeg."""
        if len(timestamps) < 2:
            return tuple(timestamps)
        late = min(self.rounding, float(np.median(np.diff(timestamps))) / 2)
        return tuple(stamp for stamp in timestamps if any(begin <= stamp + late < end for begin, end in self.spans))


def edits_of(path: Path, track: int) -> Edits | None:
    """Return what the track with this number shows; None where it shows all of itself, or nothing says what."""
    try:
        with path.open("rb") as file:
            return _edits(_by_track(file, path.stat().st_size), track)
    except (
        OSError,
        struct.error,
        KeyError,
        IndexError,
    ):  # no such file of boxes, or damaged: the decoder says so if it matters
        return None


def _edits(found: dict[int, dict[bytes, bytes]], track: int) -> Edits | None:
    parts = found.get(track, {})
    if b"elst" not in parts or 0 not in found:
        return None
    unit_hz, _ = _scale_and_length(found[0][b"mvhd"])
    media_hz, length = _scale_and_length(parts[b"mdhd"])
    per_unit = media_hz / unit_hz if unit_hz else 0.0
    spans = []
    for units, begin, rate in _entries(parts[b"elst"]):
        if begin < 0 or rate <= 0:  # nothing, or one frame that stands still
            continue
        long = units * per_unit * rate or float("inf")
        spans.append((float(begin), begin + long))
    whole = len(spans) == 1 and spans[0][1] - spans[0][0] > length - per_unit  # only begins where its frames do
    return None if not spans or whole else Edits(spans=tuple(spans), rounding=per_unit)


def _entries(body: bytes) -> Iterator[tuple[int, int, float]]:
    """Yield every edit's length in units of the movie, where it begins in the track's (-1: nothing), and its rate."""
    form = ">QqI" if body[0] else ">IiI"
    (count,) = struct.unpack_from(">I", body, 4)
    for n in range(count):
        units, begin, rate = struct.unpack_from(form, body, 8 + n * struct.calcsize(form))
        yield units, begin, rate / ONE


def _scale_and_length(body: bytes) -> tuple[int, int]:
    """Return units per second, and the length in them, of ``mvhd`` and ``mdhd``."""
    scale, length = struct.unpack_from(">IQ", body, 20) if body[0] else struct.unpack_from(">II", body, 12)
    return scale, length


def _by_track(file: BinaryIO, end: int) -> dict[int, dict[bytes, bytes]]:
    """Return the wanted boxes of every track by its number; those of the whole movie under 0."""
    found, number = dict[int, dict[bytes, bytes]](), 0
    for kind, body in _boxes(file, 0, end):
        if kind == b"tkhd":
            (number,) = struct.unpack_from(">I", body, 20 if body[0] else 12)
        found.setdefault(number, {})[kind] = body
    return found


def _boxes(file: BinaryIO, begin: int, end: int, deep: int = DEEPEST) -> Iterator[tuple[bytes, bytes]]:
    while begin + 8 <= end:
        file.seek(begin)
        size, kind = struct.unpack(">I4s", file.read(8))
        head = 8
        if size == 1:
            (size,) = struct.unpack(">Q", file.read(8))
            head = 16
        size = size or end - begin
        if size < head:
            return
        if kind in CONTAINERS and deep:
            yield from _boxes(file, begin + head, min(begin + size, end), deep - 1)
        elif kind in WANTED and size < MOST_BYTES:
            yield kind, file.read(size - head)
        begin += size
