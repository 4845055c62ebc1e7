"""OpenEXR encodes into a file that Python has opened, so that a full disk is an ordinary error.

By itself OpenEXR swallows what goes wrong while it closes a file, and leaves a truncated one.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.spilled import let_go
from psvideo.errors import PsvideoError

LET_GO_EACH_BYTES = 1 << 20
"""What lies in files is let go each time that OpenEXR has read this much of it: what is alike throughout, such as
motion vectors of what stands, packs to next to nothing."""
NUMBER_BYTES = 8
"""A chunk begins with numbers of this size and less."""


class ExrStream:
    """A file that OpenEXR writes into, ``lines`` of the planes at a time; large ones that it reads go back to the
    system's cache meanwhile.

    ``fault`` is what went wrong first: OpenEXR swallows what does while it closes a file, where it goes back to write
    the table of its chunks, and a disk that was full then may have room again when Python closes it.
    """

    def __init__(self, file: BinaryIO, planes: Sequence[NDArray[np.floating]], lines: int) -> None:
        self._file, self._planes, self._read = file, planes, 0
        self._chunk = lines * sum(plane.shape[1] * plane.itemsize for plane in planes)
        self.fault: OSError | None = None

    def write(self, data: bytes) -> int:
        """Write bytes, and let go of what was read for them."""
        self._read += self._chunk if len(data) > NUMBER_BYTES else 0
        if self._read > LET_GO_EACH_BYTES:
            let_go(*self._planes)
            self._read = 0
        return self._noted(lambda: self._file.write(data))

    def seek(self, place: int, whence: int = 0) -> int:
        """Go to a place in the file."""
        return self._noted(lambda: self._file.seek(place, whence))

    def tell(self) -> int:
        """Return the place in the file."""
        return self._noted(self._file.tell)

    def _noted(self, do: Callable[[], int]) -> int:
        try:
            return do()
        except OSError as fault:
            self.fault = self.fault or fault
            raise


def write_streamed(
    path: Path,
    beside: Path,
    write: Callable[[ExrStream], object],
    planes: Sequence[NDArray[np.floating]],
    lines: int,
) -> None:
    """Have OpenEXR ``write`` what it built of ``planes``, so many ``lines`` at a time, to the file ``beside``, which
    stands for ``path`` until it is whole."""
    try:
        with beside.open("wb") as file:
            stream = ExrStream(file, planes, lines)
            write(stream)
            if stream.fault is not None:
                raise stream.fault
            let_go(*planes)
    except RuntimeError as fault:  # what OpenEXR raises for all its faults
        raise PsvideoError(f"{path}: OpenEXR cannot encode this picture: {fault}") from fault
