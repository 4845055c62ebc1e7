"""A mixture made ready for compiled loops: where its frames lie, in memory or in open files read row by row."""

import ctypes
import sys
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.model.coded import Coded
from psvideo.plates.ambient.ambient_level import AmbientLevel
from psvideo.plates.mixing.mixture_arrays import InFiles, MixtureArrays


def _reader() -> int:
    """Return the address of the C library's pread, 0 where there is none that all threads may call with one file."""
    if sys.platform == "win32" or sys.maxsize < 1 << 32:
        return 0
    return ctypes.cast(ctypes.CDLL(None).pread, ctypes.c_void_p).value or 0


READER = _reader()


@dataclass(frozen=True, kw_only=True, eq=False)
class ReadyMixture:
    """A picture as a compiled loop takes it, beside what it is made of; ``counts`` (frame, row) are the frames' rows
    that it takes."""

    mix: MixtureArrays
    frames: tuple[Coded, ...]
    levels: tuple[AmbientLevel, ...]
    counts: NDArray[np.bool_]

    def run(self, loop: Callable[..., None], rows: range | NDArray[np.intp], *arguments: object) -> None:
        """Call ``loop(mix, *arguments)``, which takes the frames' ``rows`` (at least one, in rising order).

        Where frames stay in their files, these rows are read as far as they count, and held no longer than the loop
        runs.
        """
        if len(self.mix.frames) == len(self.frames):  # all of them lie in memory
            loop(self.mix, *arguments)
            return
        if READER and self._reads(loop, *arguments):
            return
        wanted = np.asarray(rows, np.intp)
        first = wanted[0]
        held: dict[int, NDArray[np.generic]] = {}
        begins = np.zeros(len(self.frames), np.intp)
        for place in np.flatnonzero(self.counts[:, wanted].any(axis=1)).tolist():
            codes = self.frames[place].codes
            held[place] = codes[first : wanted[-1] + 1] if isinstance(codes, np.ndarray) else codes.some(wanted)
            begins[place] = held[place].ctypes.data - first * held[place].strides[0]
        loop(self.mix._replace(frames=begins), *arguments)

    def _reads(self, loop: Callable[..., None], *arguments: object) -> bool:
        """Call the loop so that it reads rows by itself, each when it is added; return whether that could be: files
        are open, and nothing of them is missing."""
        places = [None if isinstance(one.codes, np.ndarray) else one.codes.opened() for one in self.frames]
        if None in places:
            return False
        opened, begins = np.array(places, np.intp).T.copy()
        room = np.empty(2 * self.mix.samples, self.mix.like.dtype)
        files = InFiles(opened, READER, room.ctypes.data, np.zeros(1, np.intp))
        loop(self.mix._replace(frames=begins, files=files), *arguments)
        return not files.missed[0]
