"""The compiled loops of judging: noise through least squares, and what is doubted beyond it."""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import decoded, encoded, lent
from psvideo.model.arrays import Bytes, Floats, Indices, Samples
from psvideo.solve.normals.loops.blocks import ONE, TINY, ZERO
from psvideo.solve.normals.trust.spread_numbers import Spread

TWO, MOST_FIT_DEG, LARGEST_DEG = np.float32(2), np.float32(60), np.float32(180)
LEAST_LEVEL = np.float32(0.25)  # of the light that shines straight on a surface, what is counted for noise at least


@FUSED.kept
def judge_rows(
    normals: Samples, albedo: Samples, fit: Samples, spread: Spread, factors: Floats, doubt: Floats, step: int,
    error: Samples, trusted: Bytes, first: int, last: int,
) -> None:  # fmt: skip
    """Fill the rows of ``error`` (row, col) in degrees and of ``trusted`` from normals (3, row, col) and albedo
    (channel, row, col), zeros where there is none.

    fit: (row, col), the error in degrees that residuals predict, or residuals, or empty.
    factors: of the error that noise makes, what of ``fit`` is noise; how much of the rest counts; by what residuals
    become degrees where noise does, 0 where they are that already; and the error up to which a normal is trusted.
    doubt: (2, row, col) of every ``step``-th row and column, as of ``spread.dim`` and ``wider``: degrees to be added,
    and what of ``fit`` is usual around and does not count; or empty.
    """
    n, a, f, d, out, kept = lent(normals), lent(albedo), lent(fit), lent(doubt), lent(error), lent(trusted)
    dim, wider = lent(spread.dim), lent(spread.wider)
    cols, shares, scale = out.shape[1], lent(spread.shares), spread.scale * spread.scale
    v, inverse = spread.variances, spread.inverse  # numbers outside the loops, which then become vectors
    read, photon, own, of_fit = v[0], v[1], v[2], v[3]
    tx, ty, tz = spread.toward[0], spread.toward[1], spread.toward[2]
    xx, yy, zz, xy, xz, yz = inverse[0, 0], inverse[1, 1], inverse[2, 2], inverse[0, 1], inverse[0, 2], inverse[1, 2]
    of_noise, counts, degrees_of, limit = factors[0] * factors[0], factors[1], factors[2], factors[3]
    trace, holds_fit = xx + yy + zz, f.size > 0
    beyond, usual = np.zeros(cols, np.float32), np.zeros(cols, np.float32)
    sizes, means = np.zeros(cols, np.float32), np.zeros(cols, np.float32)
    place, way, rises = np.empty(cols, np.uint32), np.empty(cols, np.float32), np.empty(cols, np.float32)
    ends = np.empty((4, 2, cols), np.float32)
    _place_columns(step, place, way)
    near, held = dim.size > 0, -2
    reaching, turning = np.ones(cols, np.float32), np.ones(cols, np.float32)
    for row in range(first, last):
        if row // step != held:
            if d.size:
                _hold_ends(d[0], row // step, held, rises, place, way, ends[0])
                _hold_ends(d[1], row // step, held, rises, place, way, ends[1])
            if near:
                _hold_ends(dim, row // step, held, rises, place, way, ends[2])
                _hold_ends(wider, row // step, held, rises, place, way, ends[3])
            held = row // step
        if d.size:
            _fill_between(ends[0], row, step, beyond)
            _fill_between(ends[1], row, step, usual)
        if near:
            _fill_between(ends[2], row, step, reaching)
            _fill_between(ends[3], row, step, turning)
        _weigh_channels(a, row, shares, sizes, means)
        for col in range(cols):
            x, y, z = decoded(n[0, row, col]), decoded(n[1, row, col]), decoded(n[2, row, col])
            size = max(sizes[col] * reaching[col], TINY)
            along = x * x * xx + y * y * yy + z * z * zz + TWO * (x * y * xy + x * z * xz + y * z * yz)
            wide = max(trace - along, ZERO) * scale * turning[col]
            level = size * max(x * tx + y * ty + z * tz, LEAST_LEVEL)
            noise = (read + photon * level) / (size * size)
            more = beyond[col]
            if holds_fit:
                one = decoded(f[row, col])
                alike = max(means[col] * reaching[col], TINY)  # residuals are those of the channels together
                one = min(one * degrees_of * np.sqrt(wide) / alike if degrees_of > ZERO else one, MOST_FIT_DEG)
                one = np.sqrt(max(one * one - of_noise * wide * (noise + of_fit), ZERO))
                more += counts * max(one - usual[col], ZERO)
            degrees = min(np.sqrt(wide * (noise + own) + more * more), LARGEST_DEG)
            solved = sizes[col] > ZERO
            out[row, col] = encoded(degrees if solved else ZERO, out)
            kept[row, col] = solved & (degrees <= limit)


@FUSED.inlined
def _weigh_channels(albedo: Samples, row: int, shares: Floats, sizes: Floats, means: Floats) -> None:
    """Fill for a row what noise is divided by, ``sizes``, and what residuals are, ``means``: how large the channels of
    albedo are together, each counted as the solvers do."""
    share = ONE / np.float32(len(albedo))
    sizes[:], means[:] = ZERO, TINY
    for channel in range(len(albedo)):
        counts_by = shares[channel] * share
        for col in range(len(sizes)):
            one = decoded(albedo[channel, row, col])
            counted = one * counts_by
            sizes[col] += one * counted
            means[col] += counted
    for col in range(len(sizes)):
        means[col] = sizes[col] / means[col]
        sizes[col] = np.sqrt(sizes[col])  # noise over it goes with the squares


@FUSED.kept
def add_rows(error: Samples, more: Floats, step: int, first: int, last: int) -> None:
    """Add ``more``, degrees at every ``step``-th row and col, to rows of ``error`` (row, col), as squares; 0 stays."""
    out, d = lent(error), lent(more)
    cols = out.shape[1]
    line = np.zeros(cols, np.float32)
    place, way, rises = np.empty(cols, np.uint32), np.empty(cols, np.float32), np.empty(cols, np.float32)
    ends, held = np.empty((2, cols), np.float32), -2
    _place_columns(step, place, way)
    for row in range(first, last):
        if row // step != held:
            _hold_ends(d, row // step, held, rises, place, way, ends)
            held = row // step
        _fill_between(ends, row, step, line)
        for col in range(cols):
            one = decoded(out[row, col])
            degrees = min(np.sqrt(one * one + line[col] * line[col]), LARGEST_DEG)
            out[row, col] = encoded(degrees if one > ZERO else ZERO, out)


@FUSED.inlined
def _hold_ends(coarse: Floats, at: int, held: int, rises: Floats, place: Indices, way: Floats, ends: Floats) -> None:
    """Fill ``ends`` (2, col) with what lies between the columns of a plane of every n-th row and column in its row
    ``at`` and in the next one; those of the row ``held`` are there. Numbers are picked by place for these alone, which
    takes longer than all that is done with them in the rows between."""
    above, under = ends[0], ends[1]
    if at == held + 1:
        for col in range(above.shape[0]):
            above[col] = under[col]
    else:
        _fill_across(coarse[at], rises, place, way, above)
    _fill_across(coarse[min(at + 1, coarse.shape[0] - 1)], rises, place, way, under)


@FUSED.inlined
def _fill_across(coarse: Floats, rises: Floats, place: Indices, way: Floats, line: Floats) -> None:
    """Fill a row between every n-th column; ``rises`` is room for what it rises by from each to the next, ``place`` and
    ``way`` are those of ``_place_columns``."""
    last = coarse.shape[0] - 1
    for x in range(last):
        rises[x] = coarse[x + 1] - coarse[x]
    rises[last] = ZERO
    for col in range(line.shape[0]):
        line[col] = coarse[place[col]] + way[col] * rises[place[col]]


@FUSED.inlined
def _fill_between(ends: Floats, row: int, step: int, line: Floats) -> None:
    """Fill a row from those of every ``step``-th before and after it."""
    down, above, under = np.float32(row % step) * (ONE / np.float32(step)), ends[0], ends[1]
    for col in range(line.shape[0]):
        line[col] = above[col] + down * (under[col] - above[col])


@FUSED.inlined
def _place_columns(step: int, place: Indices, way: Floats) -> None:
    """Fill for every column before which one of every ``step``-th it lies, and how far it is on its way to the next."""
    one = ONE / np.float32(step)
    for col in range(place.shape[0]):
        place[col] = col // step
        way[col] = np.float32(col % step) * one
