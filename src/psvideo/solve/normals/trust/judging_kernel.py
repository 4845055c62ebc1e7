"""The compiled loops of judging: noise through least squares and what is doubted beyond it, and light in shadow."""

from typing import Any

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import decoded, encoded, lent
from psvideo.compute.symmetric import adjugate
from psvideo.model.arrays import Bytes, Floats, Indices
from psvideo.solve.normals.loops.blocks import ABSENT, BLOCK, ONE, TINY, ZERO
from psvideo.solve.normals.loops.measuring import read_block
from psvideo.solve.normals.loops.near_kernel import at, lent_task, of_light
from psvideo.solve.normals.task import LIGHTS, Samples, Spread, Task, Work

TWO, MOST_FIT_DEG, LARGEST_DEG = np.float32(2), np.float32(60), np.float32(180)
FACING = np.float32(0.05)  # the cosine up to which a light passes a surface by, where such light was not used
SHADOWED = np.float32(0.25)  # of what a light would give, below which it is hindered
LEAST_LEVEL = np.float32(0.25)  # of the light that shines straight on a surface, what is counted for noise at least
MOST_WIDENED = np.float32(100)  # up to this many times the square spreads noise farther where fewer lights reach
UNSOLVED_WIDENED = np.float32(5)  # the same where so few lights seem to reach that they could not have told the normal
ROUGHLY = np.float32(1e4)  # the condition squared up to which lights are not nearly coplanar
NO_EQUATIONS, TINIEST = (ZERO,) * 6, np.float32(1e-12)
MOST_INDIRECT = np.float32(0.5)  # of the albedo: more is a highlight, or a wrong normal


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
    channels, cols = len(a), out.shape[1]
    share, shares, scale = ONE / np.float32(channels), lent(spread.shares), spread.scale * spread.scale
    v, inverse = spread.variances, spread.inverse  # numbers outside the loops, which then become vectors
    read, photon, own, of_fit = v[0], v[1], v[2], v[3]
    tx, ty, tz = spread.toward[0], spread.toward[1], spread.toward[2]
    xx, yy, zz, xy, xz, yz = inverse[0, 0], inverse[1, 1], inverse[2, 2], inverse[0, 1], inverse[0, 2], inverse[1, 2]
    of_noise, counts, degrees_of, limit = factors[0] * factors[0], factors[1], factors[2], factors[3]
    trace, holds_fit = xx + yy + zz, f.size > 0
    beyond, usual = np.zeros(cols, np.float32), np.zeros(cols, np.float32)
    sizes, means = np.zeros(cols, np.float32), np.zeros(cols, np.float32)
    ends, place, way = np.empty((2, cols), np.float32), np.empty(cols, np.uint32), np.empty(cols, np.float32)
    _place_columns(step, place, way)
    near = dim.size > 0
    reaching, turning = np.ones(cols, np.float32), np.ones(cols, np.float32)
    for row in range(first, last):
        if d.size:
            _fill_between(d[0], row, step, ends, place, way, beyond)
            _fill_between(d[1], row, step, ends, place, way, usual)
        if near:
            _fill_between(dim, row, step, ends, place, way, reaching)
            _fill_between(wider, row, step, ends, place, way, turning)
        sizes[:], means[:] = ZERO, TINY
        for channel in range(channels):
            counts_by = shares[channel] * share
            for col in range(cols):
                one = decoded(a[channel, row, col])
                counted = one * counts_by
                sizes[col] += one * counted
                means[col] += counted
        for col in range(cols):
            means[col] = sizes[col] / means[col]  # what the channels are together, each counted as the solvers do
            sizes[col] = np.sqrt(sizes[col])  # noise over it goes with the squares
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


@FUSED.kept
def add_rows(error: Samples, more: Floats, step: int, first: int, last: int) -> None:
    """Add ``more``, degrees at every ``step``-th row and col, to rows of ``error`` (row, col), as squares; 0 stays."""
    out, d = lent(error), lent(more)
    cols = out.shape[1]
    line = np.zeros(cols, np.float32)
    ends, place, way = np.empty((2, cols), np.float32), np.empty(cols, np.uint32), np.empty(cols, np.float32)
    _place_columns(step, place, way)
    for row in range(first, last):
        _fill_between(d, row, step, ends, place, way, line)
        for col in range(cols):
            one = decoded(out[row, col])
            degrees = min(np.sqrt(one * one + line[col] * line[col]), LARGEST_DEG)
            out[row, col] = encoded(degrees if one > ZERO else ZERO, out)


@FUSED.inlined
def _fill_between(coarse: Floats, row: int, step: int, ends: Floats, place: Indices, way: Floats, line: Floats) -> None:
    """Fill a row from a plane of every ``step``-th row and column; ``ends`` (2, col) is room for what lies at these and
    what it rises by to the next; ``place`` and ``way`` are those of ``_place_columns``."""
    y, one = row // step, ONE / np.float32(step)
    down, below = np.float32(row - y * step) * one, min(y + 1, coarse.shape[0] - 1)
    above, under, begins, rises = coarse[y], coarse[below], ends[0], ends[1]
    for x in range(above.shape[0]):
        begins[x] = above[x] + down * (under[x] - above[x])
    last = above.shape[0] - 1
    for x in range(last):
        rises[x] = begins[x + 1] - begins[x]
    rises[last] = ZERO
    for col in range(line.shape[0]):
        line[col] = begins[place[col]] + way[col] * rises[place[col]]


@FUSED.inlined
def _place_columns(step: int, place: Indices, way: Floats) -> None:
    """Fill for every column before which one of every ``step``-th it lies, and how far it is on its way to the next."""
    one = ONE / np.float32(step)
    for col in range(place.shape[0]):
        place[col] = col // step
        way[col] = np.float32(col % step) * one


@FUSED.inlined
def _by_noise(read: np.float32, photon: np.float32, light: np.float32) -> np.float32:
    """Return the weight of a light's measurement where it makes so much ``light`` straight above."""
    off = LIGHTS * light
    return np.float32(ONE / max(read + photon * light + off * off, TINIEST))


@FUSED.inlined
def _with_light(equations: Any, lamp: Any, weight: np.float32) -> Any:
    """Return normal equations with one more light."""
    a, b, c, d, e, f = equations
    x, y, z = lamp
    return (
        a + weight * x * x,
        b + weight * x * y,
        c + weight * x * z,
        d + weight * y * y,
        e + weight * y * z,
        f + weight * z * z,
    )


@FUSED.inlined
def _across(equations: Any, x: np.float32, y: np.float32, z: np.float32) -> np.float32:
    """Return what of the covariance lies across a normal; 0 where there is none, or that of nearly coplanar lights."""
    a, b, c, d, e, f = equations
    xx, xy, xz, yy, yz, zz, determinant = adjugate(a, b, c, d, e, f)
    sound = (determinant > ZERO) & ((a + d + f) * (xx + yy + zz) < ROUGHLY * determinant)
    along = x * x * xx + y * y * yy + z * z * zz + TWO * (x * y * xy + x * z * xz + y * z * yz)
    return np.float32((xx + yy + zz - along) / determinant if sound else ZERO)


@FUSED.inlined
def _widened(some: Any, every: Any, x: np.float32, y: np.float32, z: np.float32) -> np.float32:
    """Return by how much what lies across a normal grows from the equations of every light to those of some."""
    left, whole = _across(some, x, y, z), _across(every, x, y, z)
    return np.float32(min(max(left / whole, ONE), MOST_WIDENED) if left > ZERO and whole > ZERO else UNSOLVED_WIDENED)


@FUSED.kept
def indirect_rows(
    task: Task, work: Work, normals: Samples, albedo: Samples, sums: Floats, counts: Floats, wider: Floats,
    squares: Floats, lights: Floats, first: int, last: int, step: int,
) -> None:  # fmt: skip
    """Add up what reaches every ``step``-th row and column from lights that do not, as a share of the albedo, by how
    much farther noise spreads without these (``wider``), and the ``squares`` of what normals leave of all ``lights``
    that show there, where these planes are not empty.

    normals, albedo: as ``judge_rows`` takes them, zeros where there is none. The others: (row // step, col // step).
    """
    t = lent_task(task, work.matrix, work.per_strength)
    n, a, values, total, count = lent(normals), lent(albedo), lent(work.values), lent(sums), lent(counts)
    over, lit, looks, spreads = lent(squares), lent(lights), squares.size > 0, lent(wider)
    channels, facing = t.tone.shape[1], FACING if t.ratio > ZERO else ZERO
    each = ONE / np.float32(channels)
    for row in range(-(-first // step) * step, last, step):
        for col in range(0, t.cols, BLOCK):
            width = min(BLOCK, t.cols - col)
            read_block(t, values, row, col, width)
            for i in range(-col % step, width, step):
                size = ZERO
                for channel in range(channels):
                    size += decoded(a[channel, row, col + i]) * each * t.shares[channel]
                if not size > ZERO:
                    continue
                nx, ny, nz = decoded(n[0, row, col + i]), decoded(n[1, row, col + i]), decoded(n[2, row, col + i])
                sum_of, number, left, showing, some, every = ZERO, ZERO, ZERO, ZERO, NO_EQUATIONS, NO_EQUATIONS
                for light in range(t.lights):
                    lamp, per, dark = of_light(t.matrix, light), t.per_strength[light], t.dark[light]
                    weight = _by_noise(t.noise[light, 0], t.noise[light, 1], size / (t.albedo_scale * at(per, i)))
                    every = _with_light(every, at(lamp, i), weight)
                    if not values[light * channels, i] > ABSENT:
                        continue
                    level = ZERO
                    for channel in range(channels):
                        level += values[light * channels + channel, i] * each * t.shares[channel]
                    one = at(per, i)
                    lx, ly, lz = at(lamp, i)
                    cosine = (lx * nx + ly * ny + lz * nz) * one
                    level *= one * t.albedo_scale
                    dark *= one * t.albedo_scale
                    beyond = level / size - max(cosine, ZERO)
                    left += beyond * beyond
                    showing += ONE if max(level, size * cosine) > dark else ZERO
                    shadowed = (cosine > facing) & (level < SHADOWED * size * cosine)
                    if shadowed | (cosine <= facing) | (level < dark):  # or lost in noise
                        grazing = ZERO if shadowed else max(cosine, ZERO)
                        share = level / size - grazing
                        sum_of += min(max(share, -MOST_INDIRECT), MOST_INDIRECT)
                        number += ONE
                    else:
                        some = _with_light(some, (lx, ly, lz), weight)
                total[row // step, (col + i) // step] = sum_of
                count[row // step, (col + i) // step] = number
                spreads[row // step, (col + i) // step] = _widened(some, every, nx, ny, nz)
                if looks:
                    over[row // step, (col + i) // step] = left
                    lit[row // step, (col + i) // step] = showing
