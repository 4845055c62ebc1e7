"""Decoded pictures kept in a temporary file, so that a clip that is read twice is decoded once.

Codes are written as they were decoded, and linear light is made of them again: nothing is lost, and 16-bit footage
takes half of what its light would. The file has no name from the moment it is made, so however a run ends, nothing of
it stays behind. What does not fit is not kept, and is decoded again where it is asked for.
"""

import contextlib
import shutil
import sys
import tempfile
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from io import FileIO
from math import prod
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from psvideo.clip.decoded import CodedPicture, Header, PictureInFile
from psvideo.clip.in_file import RowsInFile
from psvideo.clip.shown_file import PassingPlace, ShownFile, not_given_back
from psvideo.errors import PsvideoError

SHARE_OF_FREE_SPACE = 0.5
"""What kept pictures may take of the disk's free space; the run's own files need room too."""
STAYS_FROM_BYTES = 1 << 20
"""Pictures of this many bytes and more may stay in the file while they are worked on."""


@dataclass(frozen=True, kw_only=True)
class _Place:
    """Where a picture's codes lie in the file, and how they are to be read."""

    offset: int
    shape: tuple[int, ...]
    dtype: np.dtype[np.generic]
    header: Header


class Kept:
    """Pictures by frame number, in one file; threads may put and get at the same time.

    ``most_bytes`` bounds the file. ``missed`` counts the pictures for which there was no room.
    """

    def __init__(self, file: FileIO, *, most_bytes: int) -> None:
        self._file = file
        self._shown = None if sys.platform == "win32" else ShownFile(file)
        self._most_bytes = most_bytes
        self._places: dict[int, _Place] = {}
        self._free: dict[int, list[int]] = {}
        self._lock = threading.Lock()
        self.bytes_held = 0
        self.missed = 0

    def __contains__(self, number: int) -> bool:
        """Return whether the picture of this frame is kept."""
        return number in self._places

    def __len__(self) -> int:
        """How many pictures are kept."""
        return len(self._places)

    def close(self) -> None:
        """Give the disk back; from then on there is no room for pictures."""
        with self._lock:
            self._most_bytes = 0
            self._places.clear()
            self._free.clear()
            self._shown = None
            self._file.close()

    def put(self, number: int, picture: CodedPicture) -> None:
        """Keep a picture, if there is room for it; a disk that turns out to be full ends the keeping, not the run."""
        codes = np.ascontiguousarray(picture.codes)
        with self._lock:
            if self.bytes_held + codes.nbytes > self._most_bytes:
                self.missed += 1
                return
            try:
                self._file.seek(self.bytes_held)
                _write_all(self._file, codes.data.cast("B"))
            except OSError:
                self._most_bytes = 0
                self.missed += 1
                return
            self._places[number] = _Place(
                offset=self.bytes_held, shape=codes.shape, dtype=codes.dtype, header=picture.header
            )
            self.bytes_held += codes.nbytes

    def passing(self, picture: CodedPicture) -> CodedPicture | PictureInFile:
        """Return a picture that stays in the file, as ``passing_codes`` holds its codes."""
        rows = self.passing_codes(np.ascontiguousarray(picture.codes))
        return PictureInFile(header=picture.header, codes=rows) if isinstance(rows, RowsInFile) else picture

    def passing_codes(self, codes: NDArray[Any]) -> NDArray[Any] | RowsInFile:
        """Return C-contiguous codes that stay in the file for as long as somebody holds them; the next ones then take
        their place. Few are returned as they are, and so are those for which there is no room.
        """
        shown = self._shown
        if shown is None or codes.nbytes < STAYS_FROM_BYTES:
            return codes
        free = self._free.setdefault(codes.nbytes, [])
        with self._lock:
            offset = free.pop() if free else self.bytes_held
            if offset + codes.nbytes > self._most_bytes:
                return codes
            self.bytes_held = max(self.bytes_held, offset + codes.nbytes)
            try:
                self._file.seek(offset)
                _write_all(self._file, codes.data.cast("B"))
            except OSError:
                self._most_bytes = 0
                return codes
        return RowsInFile(offset=offset, kind=codes.dtype, shape=codes.shape, file=PassingPlace(shown, offset, free))

    def get(self, number: int, *, in_file: bool = False) -> CodedPicture | PictureInFile:
        """Return a kept picture as it was put. Raises PsvideoError where the disk does not give it back.

        ``in_file``: it may stay in the file, of which rows are read whenever somebody wants them.
        """
        place, shown = self._places[number], self._shown
        if in_file and shown is not None and prod(place.shape) * place.dtype.itemsize >= STAYS_FROM_BYTES:
            rows = RowsInFile(offset=place.offset, kind=place.dtype, shape=place.shape, file=shown)
            return PictureInFile(header=place.header, codes=rows)
        codes = np.empty(place.shape, place.dtype)
        try:
            with self._lock:
                self._file.seek(place.offset)
                read = _filled(self._file, codes.data.cast("B"))
        except OSError as fault:
            raise not_given_back(str(fault.strerror or fault)) from fault
        if read != codes.nbytes:
            raise not_given_back(f"{read} of {codes.nbytes} bytes of frame {number}")
        return CodedPicture(header=place.header, codes=codes)


def _filled(file: FileIO, room: memoryview) -> int:
    """Read until there is no more room, or no more to read; return how many bytes. One reading gives 2 GiB at most."""
    done = 0
    while done < len(room) and (more := file.readinto(room[done:])):
        done += more
    return done


def _write_all(file: FileIO, data: memoryview) -> None:
    """Write all of it; a disk that is nearly full takes a part and then raises OSError."""
    while data:
        data = data[file.write(data) :]


@contextlib.contextmanager
def keeping_near(output: Path) -> Iterator[Kept]:
    """Give an empty store of pictures on the disk where ``output`` will be written; at the end its file is gone.

    Raises PsvideoError where no file can be made there.
    """
    folder = next(parent for parent in output.absolute().parents if parent.is_dir())
    try:
        most_bytes = int(shutil.disk_usage(folder).free * SHARE_OF_FREE_SPACE)
        opened = tempfile.TemporaryFile(dir=folder, prefix=".psvideo-", buffering=0)  # noqa: SIM115, closed by Kept
    except OSError as fault:
        raise PsvideoError(
            f"{folder}: no file can be made here ({fault.strerror or fault}), and {output.name} would be. Check the "
            "folder's permissions, or name another output."
        ) from fault
    kept = Kept(opened, most_bytes=most_bytes)
    try:
        yield kept
    finally:
        kept.close()
