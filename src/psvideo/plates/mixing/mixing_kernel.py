"""The compiled loops that make rows of plates of rows of frames, in the codes in which these were read.

A row of the result fits into a core's first cache: every frame's row is added there, and written once.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numba import types
from numba.extending import overload
from numba.np.numpy_support import carray
from numpy.typing import NDArray

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import decoded, lent, pointer, read_at
from psvideo.compute.parts import INLINED

Floats = NDArray[np.float32]
Places = NDArray[np.intp]
Codes = NDArray[np.uint16]
EMPTY = np.empty(0, np.uint16)
NOTHING, WHOLE, CLIPPED = range(3)

COUNTS = np.float32(0.02)
"""A clipped sample clips the plate where so much of it counts; less is a neighbour's tail that is taken off."""


class InFiles(NamedTuple):
    """How rows are read of pictures that lie in open files: each when it is added, into room that stays in a core's
    first cache."""

    opened: Places  # (frame,) files; empty where pictures lie in memory
    reader: int  # the address of the C library's pread
    room: int  # that of room for a row
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


@FUSED.kept
def mix_rows(mix: MixtureArrays, rows: Places, out: Floats) -> None:
    """Make some rows: ``out`` is (row, sample), one for each of ``rows``."""
    given = lent_mix(mix)
    made, wanted = lent(out), lent(rows)
    for place in range(wanted.shape[0]):
        mix_row(given, wanted[place], made[place])


@FUSED.kept
def mix_pictures(mix: MixtureArrays, shares: Floats, taken: Floats, rows: Places, first: int, out: Floats) -> None:
    """Make some ``rows`` of several pictures of the same frames and levels: ``out`` (picture, row, sample) begins with
    the row ``first``. ``shares`` (picture, frame, row) and ``taken`` (picture, level, row) stand for those of ``mix``.
    """
    given = lent_mix(mix)
    made, wanted, each, off = lent(out), lent(rows), lent(shares), lent(taken)
    for place in range(wanted.shape[0]):
        row = wanted[place]
        for picture in range(made.shape[0]):
            one = MixtureArrays(
                given.frames, given.like, given.samples, each[picture], given.table, given.halves, given.zero,
                given.gain, given.most, given.levels, given.least, given.step, given.narrow, off[picture],
                given.ceiling, given.clips_from, given.files,
            )  # fmt: skip
            mix_row(one, row, made[picture, row - first])


def _some_reach(codes: NDArray[Any], limit: np.float32, most: np.float32) -> bool:
    """Whether any code, ``most`` at most, is ``limit`` or more. Compiled only."""
    raise NotImplementedError


@overload(_some_reach, jit_options=INLINED, strict=False)
def _some_reach_of(codes: Any, limit: Any, most: Any) -> Callable[[Any, np.float32, np.float32], bool]:
    def of_integers(codes: Any, limit: np.float32, most: np.float32) -> bool:
        largest = codes[0]
        for sample in range(codes.shape[0]):  # compared as they are, many in one vector
            largest = codes[sample] if codes[sample] > largest else largest
        return bool(min(np.float32(largest), most) >= limit)

    def of_floats(codes: Any, limit: np.float32, most: np.float32) -> bool:
        count = np.int32(0)
        for sample in range(codes.shape[0]):
            count += np.int32(min(codes[sample], most) >= limit)
        return bool(count > 0)

    return of_integers if isinstance(codes.dtype, types.Integer) else of_floats


@FUSED.inlined
def lent_mix(mix: MixtureArrays) -> MixtureArrays:
    """The same without reference counts."""
    files = InFiles(lent(mix.files.opened), mix.files.reader, mix.files.room, lent(mix.files.missed))
    return MixtureArrays(
        lent(mix.frames), lent(mix.like), mix.samples, lent(mix.coefficients), lent(mix.table), mix.halves,
        lent(mix.zero), lent(mix.gain), mix.most, lent(mix.levels), lent(mix.least), lent(mix.step), lent(mix.narrow),
        lent(mix.taken), mix.ceiling, mix.clips_from, files,
    )  # fmt: skip


@FUSED.called
def mix_row(mix: MixtureArrays, row: int, out: Floats) -> int:
    """Make one row: frames added, levels taken off, the ceiling where a sample that counts was clipped.

    Returned is NOTHING where no frame saw it, and it is 0; CLIPPED where a sample is clipped; else WHOLE.
    """
    begun, holds_clipped = False, False
    level, place = _next_level(mix, 0, row), row % mix.zero.shape[1]
    for frame in range(mix.frames.shape[0]):
        factor = mix.coefficients[frame, row]
        if factor == np.float32(0):
            continue
        codes, zero, gain = row_of(mix, frame, row), mix.zero[frame, place, 0], mix.gain[frame, place, 0]
        limit, scale = mix.clips_from / gain + zero, factor * gain
        if mix.zero.shape[2] > 1:
            clipped = _add_pattern(mix, frame, place, codes, factor, out, begun)
        elif mix.halves:
            clipped = _add_halves(codes, zero, scale, limit, out, begun)
        elif mix.table.size:
            clipped = _add_by_table(codes, mix.table, zero, scale, limit, out, begun)
        else:
            clipped = not holds_clipped and abs(factor) > COUNTS and _some_reach(codes, limit, mix.most)
            if begun:
                _add_linear(codes, zero, scale, mix.most, out)
            elif level < mix.levels.shape[0]:
                share, least = (
                    mix.taken[level, row] * mix.step[level, row],
                    mix.taken[level, row] * mix.least[level, row],
                )
                _begin_with_level(codes, zero, scale, mix.most, level_row(mix, level, row), share, least, out)
                level = _next_level(mix, level + 1, row)
            else:
                _begin_linear(codes, zero, scale, mix.most, out)
        holds_clipped = holds_clipped or (clipped and abs(factor) > COUNTS)
        begun = True
    if not begun:
        out[:] = np.float32(0)
        return NOTHING
    while level < mix.levels.shape[0]:
        share, least = _share_of(mix, level, row)
        _take_off(level_row(mix, level, row), share, least, out)
        level = _next_level(mix, level + 1, row)
    if holds_clipped:
        _mark_clipped(mix, row, out)
    return CLIPPED if holds_clipped else WHOLE


@FUSED.inlined
def row_of(mix: MixtureArrays, frame: int, row: int) -> Any:
    """A frame's row in its codes, read if it lies in a file."""
    end = (row + 1) * mix.samples
    if mix.files.opened.shape[0]:
        size = mix.samples * mix.like.itemsize
        _read(mix.files, mix.files.opened[frame], mix.frames[frame] + row * size, size)
        return carray(pointer(mix.files.room, mix.like), mix.samples)[0 : mix.samples]
    return carray(pointer(mix.frames[frame], mix.like), end)[row * mix.samples : end]


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
def level_row(mix: MixtureArrays, level: int, row: int) -> Codes:
    """A row of a level in its codes."""
    end = (row + 1) * mix.samples
    codes: Codes = carray(pointer(mix.levels[level], EMPTY), end)
    return codes[row * mix.samples : end]


@FUSED.inlined
def _share_of(mix: MixtureArrays, level: int, row: int) -> tuple[np.float32, np.float32]:
    """By what a level's codes are multiplied to be taken off, and what is taken off of every sample beside."""
    taken = mix.taken[level, row]
    return taken * mix.step[level, row], taken * mix.least[level, row]


@FUSED.inlined
def _next_level(mix: MixtureArrays, first: int, row: int) -> int:
    """The first level from ``first`` on of which the row has a share, or how many levels there are."""
    for level in range(first, mix.levels.shape[0]):
        if mix.taken[level, row] != np.float32(0):
            return level
    return len(mix.levels)


@FUSED.inlined
def _add_pattern(
    mix: MixtureArrays, frame: int, place: int, codes: NDArray[Any], factor: np.float32, out: Floats, begun: bool
) -> bool:
    """Add a frame's row times its coefficient, where levels differ by column; return whether any sample is clipped."""
    cols = mix.zero.shape[2]
    clipped = np.int32(0)
    for col in range(cols):
        zero, gain = mix.zero[frame, place, col], mix.gain[frame, place, col]
        limit, scale = mix.clips_from / gain + zero, factor * gain
        for sample in range(col, mix.samples, cols):
            value = _signal(mix, codes[sample])
            clipped += np.int32(value >= limit)
            light = (value - zero) * scale
            out[sample] = out[sample] + light if begun else light
    return bool(clipped > 0)


@FUSED.inlined
def _signal(mix: MixtureArrays, code: Any) -> np.float32:
    value: np.float32 = mix.table[np.uintp(code)] if mix.table.size else min(np.float32(code), mix.most)
    return value


@FUSED.inlined
def _add_by_table(
    codes: NDArray[Any], table: Floats, zero: np.float32, scale: np.float32, limit: np.float32, out: Floats, begun: bool
) -> bool:
    """The same through a table, with one black level."""
    clipped = np.int32(0)
    if begun:
        for sample in range(out.shape[0]):
            value = table[np.uintp(codes[sample])]
            clipped += np.int32(value >= limit)
            out[sample] += (value - zero) * scale
    else:
        for sample in range(out.shape[0]):
            value = table[np.uintp(codes[sample])]
            clipped += np.int32(value >= limit)
            out[sample] = (value - zero) * scale
    return bool(clipped > 0)


@FUSED.inlined
def _add_halves(
    codes: NDArray[Any], zero: np.float32, scale: np.float32, limit: np.float32, out: Floats, begun: bool
) -> bool:
    """The same of half floats, which the processor knows: their table would fill a core's nearest caches."""
    clipped = np.int32(0)
    if begun:
        for sample in range(out.shape[0]):
            value = decoded(np.uint16(codes[sample]))
            clipped = np.int32(clipped | (value >= limit))
            out[sample] += (value - zero) * scale
    else:
        for sample in range(out.shape[0]):
            value = decoded(np.uint16(codes[sample]))
            clipped = np.int32(clipped | (value >= limit))
            out[sample] = (value - zero) * scale
    return bool(clipped > 0)


@FUSED.inlined
def _begin_linear(codes: NDArray[Any], zero: np.float32, scale: np.float32, most: np.float32, out: Floats) -> None:
    """Begin a row with linear codes of one black level, ``most`` at most: straight loops, which become vectors."""
    for sample in range(out.shape[0]):
        out[sample] = (min(np.float32(codes[sample]), most) - zero) * scale


@FUSED.inlined
def _begin_with_level(
    codes: NDArray[Any], zero: np.float32, scale: np.float32, most: np.float32, level: Codes, share: np.float32,
    least: np.float32, out: Floats,
) -> None:  # fmt: skip
    """The same, and take a level off: its codes times ``share``, and ``least``."""
    for sample in range(out.shape[0]):
        light = (min(np.float32(codes[sample]), most) - zero) * scale - least
        out[sample] = light - share * np.float32(level[sample])


@FUSED.inlined
def _add_linear(codes: NDArray[Any], zero: np.float32, scale: np.float32, most: np.float32, out: Floats) -> None:
    for sample in range(out.shape[0]):
        out[sample] += (min(np.float32(codes[sample]), most) - zero) * scale


@FUSED.inlined
def _take_off(level: Codes, share: np.float32, least: np.float32, out: Floats) -> None:
    for sample in range(out.shape[0]):
        out[sample] = out[sample] - least - share * np.float32(level[sample])


@FUSED.inlined
def _mark_clipped(mix: MixtureArrays, row: int, out: Floats) -> None:
    rows, cols = mix.zero.shape[1:]
    for frame in range(mix.frames.shape[0]):
        if abs(mix.coefficients[frame, row]) > COUNTS:
            codes = row_of(mix, frame, row)
            for sample in range(mix.samples):
                col = sample % cols
                zero, gain = mix.zero[frame, row % rows, col], mix.gain[frame, row % rows, col]
                if _signal(mix, codes[sample]) >= mix.clips_from / gain + zero:
                    out[sample] = mix.ceiling
