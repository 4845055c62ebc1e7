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
        """Call a loop once, as ``ReadingMixture.run`` does."""
        self.reading().run(loop, rows, *arguments)

    def reading(self) -> "ReadingMixture":
        """Return what calls loops in one thread, one after the other. Raises PsvideoError where a file is another one
        than was found."""
        if len(self.mix.frames) == len(self.frames):  # all of them lie in memory
            return ReadingMixture(ready=self, mix=self.mix)
        places = [None if isinstance(one.codes, np.ndarray) else one.codes.opened() for one in self.frames]
        if not READER or None in places:
            return ReadingMixture(ready=self)
        opened, begins = np.array(places, np.intp).T.copy()
        room = np.empty(2 * self.mix.samples, self.mix.like.dtype)
        files = InFiles(opened, READER, room.ctypes.data, np.zeros(1, np.intp))
        return ReadingMixture(ready=self, mix=self.mix._replace(frames=begins, files=files), room=room)


@dataclass(frozen=True, kw_only=True, eq=False)
class ReadingMixture:
    """A picture whose frames' rows loops of one thread read: each when it is added, where files are open, in ``mix``,
    by way of ``room``; else Python reads them before a loop."""

    ready: ReadyMixture
    mix: MixtureArrays | None = None
    room: NDArray[np.generic] | None = None

    def run(self, loop: Callable[..., None], rows: range | NDArray[np.intp], *arguments: object) -> None:
        """Call ``loop(mix, *arguments)``, which takes the frames' ``rows`` (at least one, in rising order).

        Where frames stay in their files, these rows are read as far as they count, and held no longer than the loop
        runs. What a loop could not read whole is read again by Python, which says what is wrong.
        """
        if self.mix is not None:
            loop(self.mix, *arguments)
            if not self.mix.files.missed[0]:
                return
            self.mix.files.missed[0] = 0
        frames, counts = self.ready.frames, self.ready.counts
        wanted = np.asarray(rows, np.intp)
        first = wanted[0]
        held: dict[int, NDArray[np.generic]] = {}
        begins = np.zeros(len(frames), np.intp)
        for place in np.flatnonzero(counts[:, wanted].any(axis=1)).tolist():
            codes = frames[place].codes
            held[place] = codes[first : wanted[-1] + 1] if isinstance(codes, np.ndarray) else codes.some(wanted)
            begins[place] = held[place].ctypes.data - first * held[place].strides[0]
        loop(self.ready.mix._replace(frames=begins), *arguments)
