"""The compiled loops that make rows of plates of rows of frames, in the codes in which these were read.

A row of the result fits into a core's first cache: every frame's row is added there, and written once.
"""

from typing import Any, NamedTuple

import numpy as np
from numba.np.numpy_support import carray
from numpy.typing import NDArray

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import lent, pointer

Floats = NDArray[np.float32]
Places = NDArray[np.intp]

COUNTS = np.float32(0.02)
"""A clipped sample clips the plate where so much of it counts; less is a neighbour's tail that is taken off."""


class MixtureArrays(NamedTuple):
    """What to add up, in plain arrays; addresses are those of pictures' first samples.

    like: any array of the codes' type. samples: of a row. zero, gain: (frame, row, col) patterns, of the tone.
    """

    frames: Places  # (frame,) addresses
    like: NDArray[Any]
    samples: int
    coefficients: Floats  # (frame, row)
    table: Floats  # (code,), or empty
    zero: Floats
    gain: Floats
    most: np.float32
    levels: Places  # (level,) addresses of float32 pictures, which are taken off
    taken: Floats  # (level, row)
    ceiling: np.float32  # what a clipped sample becomes
    clips_from: np.float32  # light from which on a sample is


@FUSED.kept
def mix_rows(mix: MixtureArrays, rows: Places, out: Floats) -> None:
    """Make some rows: ``out`` is (row, sample), one for each of ``rows``."""
    given = lent_mix(mix)
    made, wanted = lent(out), lent(rows)
    for place in range(wanted.shape[0]):
        mix_row(given, wanted[place], made[place])


@FUSED.kept
def mix_halved(mix: MixtureArrays, first: int, last: int, channels: int, out: Floats) -> None:
    """Make pairs of rows, and of them the mean over two by two pixels and all channels: ``out`` (row // 2, col // 2).

    ``first`` and ``last`` count rows of ``out``.
    """
    given, made = lent_mix(mix), lent(out)
    upper, lower = np.empty(given.samples, np.float32), np.empty(given.samples, np.float32)
    share = np.float32(1 / (4 * channels))
    for row in range(first, last):
        mix_row(given, 2 * row, upper)
        mix_row(given, 2 * row + 1, lower)
        for col in range(made.shape[1]):
            total = np.float32(0)
            for sample in range(2 * col * channels, 2 * (col + 1) * channels):
                total += upper[sample] + lower[sample]
            made[row, col] = total * share


@FUSED.inlined
def lent_mix(mix: MixtureArrays) -> MixtureArrays:
    """The same without reference counts."""
    return MixtureArrays(
        lent(mix.frames), lent(mix.like), mix.samples, lent(mix.coefficients), lent(mix.table), lent(mix.zero),
        lent(mix.gain), mix.most, lent(mix.levels), lent(mix.taken), mix.ceiling, mix.clips_from,
    )  # fmt: skip


@FUSED.called
def mix_row(mix: MixtureArrays, row: int, out: Floats) -> None:
    """Make one row: frames added, levels taken off, the ceiling where a sample that counts was clipped."""
    begun, holds_clipped = False, False
    for frame in range(mix.frames.shape[0]):
        factor = mix.coefficients[frame, row]
        if factor != np.float32(0):
            codes = _row_of(mix, frame, row)
            clipped = _add_row(mix, frame, row, codes, factor, out, begun)
            holds_clipped = holds_clipped or bool(clipped > 0 and abs(factor) > COUNTS)
            begun = True
    if not begun:
        out[:] = np.float32(0)
        return
    for level in range(mix.levels.shape[0]):
        share = mix.taken[level, row]
        if share != np.float32(0):
            _take_off(mix, level, row, share, out)
    if holds_clipped:
        _mark_clipped(mix, row, out)


@FUSED.inlined
def _row_of(mix: MixtureArrays, frame: int, row: int) -> Any:
    end = (row + 1) * mix.samples
    return carray(pointer(mix.frames[frame], mix.like), end)[row * mix.samples : end]


@FUSED.inlined
def _add_row(
    mix: MixtureArrays, frame: int, row: int, codes: NDArray[Any], factor: np.float32, out: Floats, begun: bool
) -> np.int32:
    """Add a frame's row times its coefficient; return how many samples are clipped."""
    rows, cols = mix.zero.shape[1:]
    clipped = np.int32(0)
    for col in range(cols):
        zero, gain = mix.zero[frame, row % rows, col], mix.gain[frame, row % rows, col]
        limit, scale = mix.clips_from / gain + zero, factor * gain
        if mix.table.size:
            for sample in range(col, mix.samples, cols):
                value = mix.table[np.intp(codes[sample])]
                clipped += np.int32(value >= limit)
                light = (value - zero) * scale
                out[sample] = out[sample] + light if begun else light
        elif cols > 1:
            for sample in range(col, mix.samples, cols):
                value = min(np.float32(codes[sample]), mix.most)
                clipped += np.int32(value >= limit)
                light = (value - zero) * scale
                out[sample] = out[sample] + light if begun else light
        else:
            clipped += _add_linear(codes, zero, limit, scale, mix.most, out, begun)
    return clipped


@FUSED.inlined
def _add_linear(
    codes: NDArray[Any],
    zero: np.float32,
    limit: np.float32,
    scale: np.float32,
    most: np.float32,
    out: Floats,
    begun: bool,
) -> np.int32:
    """The same for linear codes with one black level: straight loops, which become vectors."""
    clipped = np.int32(0)
    if begun:
        for sample in range(out.shape[0]):
            value = min(np.float32(codes[sample]), most)
            clipped += np.int32(value >= limit)
            out[sample] += (value - zero) * scale
    else:
        for sample in range(out.shape[0]):
            value = min(np.float32(codes[sample]), most)
            clipped += np.int32(value >= limit)
            out[sample] = (value - zero) * scale
    return clipped


@FUSED.inlined
def _take_off(mix: MixtureArrays, level: int, row: int, share: np.float32, out: Floats) -> None:
    end = (row + 1) * mix.samples
    picture = carray(pointer(mix.levels[level], mix.taken), end)[row * mix.samples : end]
    for sample in range(out.shape[0]):
        out[sample] -= share * picture[sample]


@FUSED.inlined
def _mark_clipped(mix: MixtureArrays, row: int, out: Floats) -> None:
    rows, cols = mix.zero.shape[1:]
    for frame in range(mix.frames.shape[0]):
        if abs(mix.coefficients[frame, row]) > COUNTS:
            codes = _row_of(mix, frame, row)
            for sample in range(mix.samples):
                col = sample % cols
                zero, gain = mix.zero[frame, row % rows, col], mix.gain[frame, row % rows, col]
                value = mix.table[np.intp(codes[sample])] if mix.table.size else np.float32(codes[sample])
                if value >= mix.clips_from / gain + zero:
                    out[sample] = mix.ceiling
