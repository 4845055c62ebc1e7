"""The compiled loops that make rows of plates of rows of frames, in the codes in which these were read.

A row of the result fits into a core's first cache: every frame's row is added there, and written once.
"""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import lent
from psvideo.model.arrays import Floats, Places
from psvideo.plates.mixing.adding_kernel import (
    add_by_table,
    add_halves,
    add_linear,
    add_pattern,
    begin_linear,
    begin_with_level,
    signal,
    some_reach,
    take_off,
)
from psvideo.plates.mixing.mixture_arrays import MixtureArrays, lent_mix, level_row, row_of

NOTHING, WHOLE, CLIPPED = range(3)

COUNTS = np.float32(0.02)
"""A clipped sample clips the plate where its coefficient is more than this much of the row's largest; less is a
neighbour's tail that is taken off. A ratio, since a plate out of a hundred flashes has small coefficients only."""


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


@FUSED.called
def mix_row(mix: MixtureArrays, row: int, out: Floats) -> int:
    """Make one row: frames added, levels taken off, the ceiling where a sample that counts was clipped.

    Returned is NOTHING where no frame saw it, and it is 0; CLIPPED where a sample is clipped; else WHOLE.
    """
    begun, holds_clipped, counts_from = False, False, _counts_from(mix, row)
    level, place = _next_level(mix, 0, row), row % mix.zero.shape[1]
    for frame in range(mix.frames.shape[0]):
        factor = mix.coefficients[frame, row]
        if factor == np.float32(0):
            continue
        codes, zero, gain = row_of(mix, frame, row), mix.zero[frame, place, 0], mix.gain[frame, place, 0]
        limit, scale = mix.clips_from / gain + zero, factor * gain
        if mix.zero.shape[2] > 1:
            clipped = add_pattern(mix, frame, place, codes, factor, out, begun)
        elif mix.halves:
            clipped = add_halves(codes, zero, scale, limit, out, begun)
        elif mix.table.size:
            clipped = add_by_table(codes, mix.table, zero, scale, limit, out, begun)
        else:
            clipped = not holds_clipped and abs(factor) > counts_from and some_reach(codes, limit, mix.most)
            if begun:
                add_linear(codes, zero, scale, mix.most, out)
            elif level < mix.levels.shape[0]:
                share, least = _share_of(mix, level, row)
                begin_with_level(codes, zero, scale, mix.most, level_row(mix, level, row), share, least, out)
                level = _next_level(mix, level + 1, row)
            else:
                begin_linear(codes, zero, scale, mix.most, out)
        holds_clipped = holds_clipped or (clipped and abs(factor) > counts_from)
        begun = True
    if not begun:
        out[:] = np.float32(0)
        return NOTHING
    while level < mix.levels.shape[0]:
        share, least = _share_of(mix, level, row)
        take_off(level_row(mix, level, row), share, least, out)
        level = _next_level(mix, level + 1, row)
    if holds_clipped:
        _mark_clipped(mix, row, counts_from, out)
    return CLIPPED if holds_clipped else WHOLE


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
def _counts_from(mix: MixtureArrays, row: int) -> np.float32:
    """Above which coefficient a frame's clipped sample clips the row."""
    largest = np.float32(0)
    for frame in range(mix.frames.shape[0]):
        largest = max(largest, abs(mix.coefficients[frame, row]))
    return COUNTS * largest


@FUSED.inlined
def _mark_clipped(mix: MixtureArrays, row: int, counts_from: np.float32, out: Floats) -> None:
    rows, cols = mix.zero.shape[1:]
    for frame in range(mix.frames.shape[0]):
        if abs(mix.coefficients[frame, row]) > counts_from:
            codes = row_of(mix, frame, row)
            for sample in range(mix.samples):
                col = sample % cols
                zero, gain = mix.zero[frame, row % rows, col], mix.gain[frame, row % rows, col]
                if signal(mix, codes[sample]) >= mix.clips_from / gain + zero:
                    out[sample] = mix.ceiling
