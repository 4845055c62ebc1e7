"""The compiled loops that make small pictures of plates: every n-th row and column, or means over blocks of pixels."""

from typing import Any

import numpy as np
from numba.np.numpy_support import carray

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import lent, pointer
from psvideo.model.arrays import Floats
from psvideo.plates.mixing.adding_kernel import some_reach
from psvideo.plates.mixing.mixing_kernel import CLIPPED, WHOLE, mix_row
from psvideo.plates.mixing.mixture_arrays import InFiles, MixtureArrays, lent_mix, level_row, row_of, two_rows_of

ZERO, HALF = np.float32(0), np.float32(0.5)


@FUSED.kept
def mix_thinned(
    mix: MixtureArrays, first: int, last: int, step: int, channels: tuple[int, int], stride: int, out: Floats
) -> None:
    """Make every ``step``-th row, and of it every ``stride``-th sample from the first of each channel on: ``out``
    (row, sample), one channel after the other.

    ``first`` and ``last`` count rows of ``out``, ``channels`` are the first one and the one after the last.
    """
    given, made = lent_mix(mix), lent(out)
    if given.zero.shape[2] > 1:  # what a sample means depends on its column
        whole = np.empty(given.samples, np.float32)
        for row in range(first, last):
            mix_row(given, step * row, whole)
            _every(whole, made[row], channels, stride)
        return
    count = made.shape[1]
    codes = np.empty((given.frames.shape[0], count), given.like.dtype)
    levels = np.empty((given.levels.shape[0], count), np.uint16)
    thin = MixtureArrays(
        np.empty_like(given.frames), given.like, count, given.coefficients, given.table, given.halves, given.zero,
        given.gain, given.most, np.empty_like(given.levels), given.least, given.step, given.narrow, given.taken,
        given.ceiling, given.clips_from, InFiles(given.files.opened[:0], 0, 0, given.files.missed),
    )  # fmt: skip
    for row in range(first, last):
        at = step * row
        for frame in range(given.frames.shape[0]):
            if given.coefficients[frame, at] != np.float32(0):
                _every(row_of(given, frame, at), codes[frame], channels, stride)
            thin.frames[frame] = codes.ctypes.data + (frame - at) * count * codes.itemsize
        for level in range(given.levels.shape[0]):
            if given.taken[level, at] != np.float32(0):
                _every(level_row(given, level, at), levels[level], channels, stride)
            thin.levels[level] = levels.ctypes.data + (level - at) * count * levels.itemsize
        mix_row(thin, at, made[row])


@FUSED.inlined
def _every(row: Any, out: Any, channels: tuple[int, int], stride: int) -> None:
    """Copy every ``stride``-th sample, one channel after the other."""
    begin, end = channels
    place = np.uint64(0)  # numbers without a sign: nothing is counted from the end
    for channel in range(begin, end):
        sample = np.uint64(channel)
        for _ in range(out.shape[0] // (end - begin)):
            out[place] = row[sample]
            place += np.uint64(1)
            sample += np.uint64(stride)


@FUSED.kept
def mix_halved(mix: MixtureArrays, first: int, last: int, channels: int, out: Floats) -> None:
    """Make pairs of rows, and of them the mean over two by two pixels and all channels: ``out`` (row // 2, col // 2).

    ``first`` and ``last`` count rows of ``out``. Levels are taken off as they are kept for this, and whole where a
    sample is clipped.
    """
    given, made = lent_mix(mix), lent(out)
    bare = _without_levels(given)
    upper, lower = np.empty(given.samples, np.float32), np.empty(given.samples, np.float32)
    share = np.float32(1 / (4 * channels))
    straight = given.zero.shape[1] * given.zero.shape[2] == 1 and not given.halves and not given.table.size
    for row in range(first, last):
        added, black = _add_codes(given, 2 * row, upper) if straight else (False, ZERO)
        above = below = WHOLE
        if not added:
            black = ZERO
            above, below = mix_row(bare, 2 * row, upper), mix_row(bare, 2 * row + 1, lower)
        whole = above != CLIPPED and below != CLIPPED
        if not whole:
            mix_row(given, 2 * row, upper)
            mix_row(given, 2 * row + 1, lower)
        if not added:
            for sample in range(given.samples):
                upper[sample] += lower[sample]
        _add_neighbours(upper, made[row], channels, share, black * HALF)
        for level in range(given.levels.shape[0] if whole else 0):
            if above == WHOLE:
                _take_off_narrow(given, level, 2 * row, made[row])
            if below == WHOLE:
                _take_off_narrow(given, level, 2 * row + 1, made[row])


@FUSED.inlined
def _add_codes(mix: MixtureArrays, row: int, pairs: Floats) -> tuple[bool, np.float32]:
    """Add up two rows as they are in their codes: return whether that could be, and what is too much for black in every
    sum; not where a sample may be clipped, or one of the rows was not seen.

    Linear codes of one black level: two rows cost one pass, where ``mix_row`` takes two for each.
    """
    begun_above, begun_below, black = False, False, ZERO
    for frame in range(mix.frames.shape[0]):
        above, below = mix.coefficients[frame, row], mix.coefficients[frame, row + 1]
        if above == ZERO and below == ZERO:
            continue
        codes, zero, gain = two_rows_of(mix, frame, row), mix.zero[frame, 0, 0], mix.gain[frame, 0, 0]
        if some_reach(codes, min(mix.clips_from / gain + zero, mix.most), mix.most):
            return False, black
        above, below = above * gain, below * gain
        black += (above + below) * zero
        _add_two_rows(codes, above, below, pairs, begun_above or begun_below)
        begun_above, begun_below = begun_above or above != ZERO, begun_below or below != ZERO
    return begun_above and begun_below, black


@FUSED.inlined
def _add_two_rows(codes: Any, above: np.float32, below: np.float32, pairs: Floats, begun: bool) -> None:
    count = pairs.shape[0]
    upper, lower = codes[0:count], codes[count : 2 * count]
    if begun:
        for sample in range(count):
            pairs[sample] += above * np.float32(upper[sample]) + below * np.float32(lower[sample])
    else:
        for sample in range(count):
            pairs[sample] = above * np.float32(upper[sample]) + below * np.float32(lower[sample])


@FUSED.inlined
def _without_levels(mix: MixtureArrays) -> MixtureArrays:
    return MixtureArrays(
        mix.frames, mix.like, mix.samples, mix.coefficients, mix.table, mix.halves, mix.zero, mix.gain, mix.most,
        mix.levels[:0], mix.least[:0], mix.step[:0], mix.narrow[:0], mix.taken[:0], mix.ceiling, mix.clips_from,
        mix.files,
    )  # fmt: skip


@FUSED.inlined
def _take_off_narrow(mix: MixtureArrays, level: int, row: int, out: Floats) -> None:
    share = mix.taken[level, row] * HALF
    if share != np.float32(0):
        end = (row + 1) * out.shape[0]
        narrow: Floats = carray(pointer(mix.narrow[level], mix.taken), end)[row * out.shape[0] : end]
        for col in range(out.shape[0]):
            out[col] -= share * narrow[col]


@FUSED.inlined
def _add_neighbours(pairs: Floats, out: Floats, channels: int, share: np.float32, less: np.float32) -> None:
    """Two neighbouring pixels' channels added up, times their share, and so much ``less``."""
    if channels == 3:
        for col in range(out.shape[0]):
            a, b, c = pairs[6 * col], pairs[6 * col + 1], pairs[6 * col + 2]
            out[col] = (a + b + c + pairs[6 * col + 3] + pairs[6 * col + 4] + pairs[6 * col + 5]) * share - less
        return
    for col in range(out.shape[0]):
        total = np.float32(0)
        for sample in range(2 * col * channels, 2 * (col + 1) * channels):
            total += pairs[sample]
        out[col] = total * share - less
