"""Codes that stay in their file, of which rows are read when somebody wants them."""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from psvideo.errors import PsvideoError


@dataclass(frozen=True, kw_only=True)
class RowsInFile:
    """A picture that lies in its file as it would in memory, ``offset`` bytes from its beginning.

    kind: the codes' type. shape: (row, col) or (row, col, channel). state: the file as it was found; where it
    is another one later, the picture would be of two exposures, or end in the middle.
    """

    path: Path
    offset: int
    kind: np.dtype[Any]
    shape: tuple[int, ...]
    state: tuple[int, ...]

    @classmethod
    def at(cls, path: Path, offset: int, kind: np.dtype[Any], shape: tuple[int, ...]) -> "RowsInFile":
        """Find a picture in a file, as it is now."""
        return cls(path=path, offset=offset, kind=kind, shape=shape, state=_state(path.stat()))

    @property
    def dtype(self) -> np.dtype[Any]:
        """The codes' type."""
        return self.kind

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, rows: slice) -> NDArray[Any]:
        """Read some rows that follow each other, in new memory. Raises PsvideoError where the file is another one."""
        wanted = range(len(self))[rows]
        codes = np.empty((len(wanted), *self.shape[1:]), self.kind)
        into = codes.reshape(-1).view(np.uint8).data
        begin = self.offset + wanted.start * (codes.strides[0] if len(wanted) else 0)
        try:
            with self.path.open("rb", buffering=0) as file:
                if _state(os.fstat(file.fileno())) != self.state:
                    raise self._changed()
                file.seek(begin)
                while len(into):
                    count = file.readinto(into)
                    if not count:
                        raise self._changed()
                    into = into[count:]
        except OSError as fault:
            raise PsvideoError(
                f"{self.path}: cannot be read any more ({fault.strerror or fault}). Check the file and its disk."
            ) from fault
        return codes

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        """Read the whole picture."""
        return np.asarray(self[:], dtype)

    def view(self, kind: type[np.generic]) -> "RowsInFile":
        """Return the same bits as codes of another type of that size."""
        return RowsInFile(path=self.path, offset=self.offset, kind=np.dtype(kind), shape=self.shape, state=self.state)

    def _changed(self) -> PsvideoError:
        return PsvideoError(
            f"{self.path}: was changed while it was worked on: it is shorter, or was written again. Expected a file "
            "that stays as it is until the run ends. Copy it again, and run again."
        )


def _state(found: os.stat_result) -> tuple[int, ...]:
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns
