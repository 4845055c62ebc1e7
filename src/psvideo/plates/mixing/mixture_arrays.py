"""What the loops take: frames and ambient levels by their addresses, in memory or in open files.

``row_of`` and ``level_row`` find one row of them.
"""

from typing import Any, NamedTuple

import numpy as np
from numba.np.numpy_support import carray
from numpy.typing import NDArray

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import lent, pointer, read_at
from psvideo.model.arrays import Codes16, Floats, Places

EMPTY = np.empty(0, np.uint16)


class InFiles(NamedTuple):
    """How rows are read of pictures that lie in open files: each when it is added, or two that are added together, into
    room that stays in a core's first cache."""

    opened: Places  # (frame,) files; empty where pictures lie in memory
    reader: int  # the address of the C library's pread
    room: int  # that of room for two rows
    missed: Places  # (1,) becomes 1 where a row could not be read whole


NO_FILES = InFiles(np.empty(0, np.intp), 0, 0, np.zeros(1, np.intp))


class MixtureArrays(NamedTuple):
    """What to add up, in plain arrays; addresses are those of pictures' first samples, of those in files the bytes at
    which they begin.

    like: any array of the codes' type. samples: of a row. zero, gain: (frame, row, col) patterns, of the tone.
    """

    frames: Places  # (frame,) addresses
    like: NDArray[Any]
    samples: int
    coefficients: Floats  # (frame, row)
    table: Floats  # (code,), or empty
    halves: bool  # codes are the bits of half floats, and the table gives these as they are
    zero: Floats
    gain: Floats
    most: np.float32
    levels: Places  # (level,) addresses of the codes of pictures that are taken off, of 16 bits
    least: Floats  # (level, row), and
    step: Floats  # (level, row): their light is least + step * code
    narrow: Places  # (level,) addresses of (row, col // 2), the same over two columns and all channels
    taken: Floats  # (level, row)
    ceiling: np.float32  # what a clipped sample becomes
    clips_from: np.float32  # light from which on a sample is
    files: InFiles = NO_FILES


@FUSED.inlined
def lent_mix(mix: MixtureArrays) -> MixtureArrays:
    """The same without reference counts."""
    files = InFiles(lent(mix.files.opened), mix.files.reader, mix.files.room, lent(mix.files.missed))
    return MixtureArrays(
        lent(mix.frames), lent(mix.like), mix.samples, lent(mix.coefficients), lent(mix.table), mix.halves,
        lent(mix.zero), lent(mix.gain), mix.most, lent(mix.levels), lent(mix.least), lent(mix.step), lent(mix.narrow),
        lent(mix.taken), mix.ceiling, mix.clips_from, files,
    )  # fmt: skip


@FUSED.inlined
def row_of(mix: MixtureArrays, frame: int, row: int) -> Any:
    """A frame's row in its codes, read if it lies in a file."""
    return _codes_of(mix, frame, row, mix.samples)


@FUSED.inlined
def two_rows_of(mix: MixtureArrays, frame: int, row: int) -> Any:
    """A frame's row and the one after it as one line of codes, read if they lie in a file."""
    return _codes_of(mix, frame, row, 2 * mix.samples)


@FUSED.inlined
def _codes_of(mix: MixtureArrays, frame: int, row: int, count: int) -> Any:
    begin = row * mix.samples
    if mix.files.opened.shape[0]:
        size = mix.like.itemsize
        _read(mix.files, mix.files.opened[frame], mix.frames[frame] + begin * size, count * size)
        return carray(pointer(mix.files.room, mix.like), count)[0:count]
    return carray(pointer(mix.frames[frame], mix.like), begin + count)[begin : begin + count]


@FUSED.called
def _read(files: InFiles, opened: int, begin: int, size: int) -> None:
    """Read this many bytes of a file; a part may come at a time."""
    done = 0
    while done < size:
        came = read_at(files.reader, opened, files.room + done, size - done, begin + done)
        if came <= 0:
            files.missed[0] = 1
            return
        done += came


@FUSED.inlined
def level_row(mix: MixtureArrays, level: int, row: int) -> Codes16:
    """A row of a level in its codes."""
    end = (row + 1) * mix.samples
    codes: Codes16 = carray(pointer(mix.levels[level], EMPTY), end)
    return codes[row * mix.samples : end]
