"""The file of kept pictures as those see it who read rows of them: open, and a place taken, until the last is gone."""

import os
from io import FileIO

from psvideo.clip.in_file import read_whole
from psvideo.errors import PsvideoError


class ShownFile:
    """The file of kept pictures as those see it who read rows of them; open until the last of them is gone."""

    def __init__(self, file: FileIO) -> None:
        self._opened = -1  # while nothing is open
        self._opened = os.dup(file.fileno())

    def __del__(self) -> None:
        if self._opened >= 0:
            os.close(self._opened)

    def opened(self) -> int:
        """Return the file, which is open, and nobody else's."""
        return self._opened

    def read(self, into: memoryview, begin: int) -> None:
        """Read as many bytes as there is room for, from the byte ``begin`` on."""
        try:
            whole = read_whole(self._opened, into, begin)
        except OSError as fault:
            raise not_given_back(str(fault.strerror or fault)) from fault
        if not whole:
            raise not_given_back(f"it ends at byte {begin} or after")


class PassingPlace:
    """The same for one picture, whose place is free once nobody holds it."""

    def __init__(self, shown: ShownFile, offset: int, free: list[int]) -> None:
        self._shown, self._offset, self._free = shown, offset, free

    def __del__(self) -> None:
        self._free.append(self._offset)

    def opened(self) -> int:
        """Return the file, which is open, and nobody else's."""
        return self._shown.opened()

    def read(self, into: memoryview, begin: int) -> None:
        """Read as many bytes as there is room for, from the byte ``begin`` on."""
        self._shown.read(into, begin)


def not_given_back(why: str) -> PsvideoError:
    """Return what is said where the disk does not give back what was kept."""
    return PsvideoError(
        f"The temporary file that holds decoded frames and plates cannot be read back ({why}). Check the disk that the "
        "output is on, then run the command again."
    )
