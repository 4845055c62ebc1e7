"""Codes that stay in their file; rows are read when they are needed."""

import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from math import inf
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from psvideo.errors import PsvideoError

LOOKED_AT_EACH_S = 0.01
"""How often an open file is looked at for whether it was written again: each look costs a thread half as much as
reading some rows."""
NEAR_ROWS = 3
"""Rows that lie no farther apart are read together with those between."""


@dataclass(frozen=True, kw_only=True)
class RowsInFile:
    """A picture that lies in its file as it would in memory, ``offset`` bytes from its beginning.

    kind: the codes' type. shape: (row, col) or (row, col, channel). file: the file as it was found; where it is another
    one later, the picture would be of two exposures, or end in the middle.
    """

    offset: int
    kind: np.dtype[Any]
    shape: tuple[int, ...]
    file: "OpenFile" = field(repr=False)

    @classmethod
    def at(
        cls, path: Path, offset: int, kind: np.dtype[Any], shape: tuple[int, ...], *, stays_open: bool = False
    ) -> "RowsInFile":
        """Find a picture in a file, as it is now; ``stays_open`` as for ``FoundFile``."""
        return cls(offset=offset, kind=kind, shape=shape, file=FoundFile(path, stays_open=stays_open))

    @property
    def dtype(self) -> np.dtype[Any]:
        """The codes' type."""
        return self.kind

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, rows: slice) -> NDArray[Any]:
        """Read some rows that follow each other, in new memory. Raises PsvideoError where the file is another one."""
        wanted = range(len(self))[rows]
        return self.some(np.arange(wanted.start, wanted.stop)) if len(wanted) else self._room(0)

    def some(self, rows: NDArray[np.intp]) -> NDArray[Any]:
        """Read rows in new memory: what is returned begins with the first of ``rows``, which rise, and ends with the
        last; of those between, only these hold anything for sure. Raises PsvideoError where the file is another one."""
        first, count = int(rows[0]), int(rows[-1] - rows[0]) + 1
        codes = self._room(count)
        size = codes.strides[0]
        into, begin = codes.reshape(-1).view(np.uint8).data, self.offset + first * size
        apart = np.flatnonzero(np.diff(rows) > NEAR_ROWS)
        begins, ends = rows[np.r_[0, apart + 1]] - first, rows[np.r_[apart, -1]] - first + 1
        for one, other in zip((begins * size).tolist(), (ends * size).tolist(), strict=True):
            self.file.read(into[one:other], begin + one)
        return codes

    def opened(self) -> tuple[int, int] | None:
        """Return the open file and the byte at which the picture begins; None where the file is opened for every
        reading. Raises PsvideoError where it is another one."""
        opened = self.file.opened()
        return None if opened is None else (opened, self.offset)

    def _room(self, rows: int) -> NDArray[Any]:
        return np.empty((rows, *self.shape[1:]), self.kind)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        """Read the whole picture. Raises ValueError where none may be copied: it lies in a file."""
        if copy is False:
            raise ValueError("A picture that stays in its file cannot be had without a copy.")
        return np.asarray(self[:], dtype)

    def view(self, kind: type[np.generic]) -> "RowsInFile":
        """Return the same bits as codes of another type of that size."""
        return replace(self, kind=np.dtype(kind))


class OpenFile(Protocol):
    """A file that is read at any place by any thread."""

    def opened(self) -> int | None:
        """Return the file while it stays open, else None. Raises PsvideoError where it is another one than it was."""

    def read(self, into: memoryview, begin: int) -> None:
        """Read as many bytes as there is room for, from the byte ``begin`` on. Raises PsvideoError where it cannot."""


class FoundFile:
    """A file as it was found, read at any place by any thread.

    ``stays_open``: from now until nobody holds it, and what is not in the system's memory is fetched meanwhile: for
    those that are read in many pieces, and are few at a time. The others are opened for every reading.
    """

    def __init__(self, path: Path, *, stays_open: bool = False) -> None:
        self._path = path
        self._state = _state(path.stat())
        self._looked_s = -inf
        self._opened: int | None = None
        if stays_open and sys.platform != "win32":  # where one place in an open file is all threads'
            self._opened = os.open(path, os.O_RDONLY)
            if hasattr(os, "posix_fadvise"):
                os.posix_fadvise(self._opened, 0, 0, os.POSIX_FADV_WILLNEED)

    def __del__(self) -> None:
        opened: int | None = getattr(self, "_opened", None)  # not there where the file was not
        if opened is not None:
            os.close(opened)

    def opened(self) -> int | None:
        """Return the file while it stays open, else None. Raises PsvideoError where it is another one than was found;
        that is looked at now and then."""
        if self._opened is not None and (now_s := time.monotonic()) - self._looked_s > LOOKED_AT_EACH_S:
            self._check(self._opened)
            self._looked_s = now_s
        return self._opened

    def read(self, into: memoryview, begin: int) -> None:
        """Read as many bytes as there is room for, from the byte ``begin`` on. Raises PsvideoError where the file is
        another one than was found, or cannot be read."""
        try:
            if (opened := self.opened()) is not None:
                if not read_whole(opened, into, begin):
                    raise self._changed()
                return
            with self._path.open("rb", buffering=0) as file:
                self._check(file.fileno())
                file.seek(begin)
                if not _filled(lambda some, _: file.readinto(some), into, begin):
                    raise self._changed()
        except OSError as fault:
            raise PsvideoError(
                f"{self._path}: cannot be read any more ({fault.strerror or fault}). Check the file and its disk."
            ) from fault

    def _check(self, opened: int) -> None:
        if _state(os.fstat(opened)) != self._state:
            raise self._changed()

    def _changed(self) -> PsvideoError:
        return PsvideoError(
            f"{self._path}: was changed while it was worked on: it is shorter, or was written again. Expected a file "
            "that stays as it is until the run ends. Copy it again, and run again."
        )


def _state(found: os.stat_result) -> tuple[int, ...]:
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns


def _filled(read: Callable[[memoryview, int], int], into: memoryview, begin: int) -> bool:
    """Fill all of the room; return whether the file was long enough."""
    while len(into):
        count = read(into, begin)
        if not count:
            return False
        into, begin = into[count:], begin + count
    return True


def read_whole(opened: int, into: memoryview, begin: int) -> bool:
    """Fill all of the room from the byte ``begin`` of an open file on; return whether it was long enough."""
    return _filled(lambda some, first: os.preadv(opened, [some], first), into, begin)
