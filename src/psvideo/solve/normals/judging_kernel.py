"""The compiled loops of judging: noise through least squares and what is doubted beyond it, and light in shadow."""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import decoded, lent
from psvideo.solve.normals.blocks import ABSENT, BLOCK, ONE, TINY, ZERO
from psvideo.solve.normals.kernel import lent_task
from psvideo.solve.normals.measuring import read_block
from psvideo.solve.normals.near_kernel import at, of_light
from psvideo.solve.normals.task import Floats, Samples, Task, Work

TWO, MOST_FIT_DEG, LARGEST_DEG = np.float32(2), np.float32(60), np.float32(180)
FACING = np.float32(0.05)  # the cosine up to which a light passes a surface by
SHADOWED = np.float32(0.25)  # of what a light would give, below which it is hindered
MOST_INDIRECT = np.float32(0.5)  # of the albedo: more is a highlight, or a wrong normal


@FUSED.kept
def judge_rows(
    normals: Samples, albedo: Samples, fit: Samples, inverse: Floats, variances: Floats, scale: np.float32,
    doubt: Floats, factors: Floats, step: int, error: Floats, first: int, last: int,
) -> None:  # fmt: skip
    """Fill the rows of ``error`` (row, col) in degrees from normals (3, row, col) and albedo (channel, row, col).

    fit: (row, col), the error in degrees that residuals predict, or residuals, or empty.
    inverse: (3, 3), of the lights' normal equations.
    variances: of a dark sample, per unit of albedo and of its square; the last for what ``fit`` says of noise.
    doubt: of every ``step``-th row and column, degrees to be added; or empty.
    factors: of the error that noise makes, what of ``fit`` is noise; how much of the rest counts; and by what residuals
    become degrees where noise does, 0 where they are that already.
    """
    n, a, f, d, out = lent(normals), lent(albedo), lent(fit), lent(doubt), lent(error)
    channels, cols = len(a), out.shape[1]
    share = ONE / np.float32(channels)
    trace = inverse[0, 0] + inverse[1, 1] + inverse[2, 2]
    for row in range(first, last):
        for col in range(cols):
            x, y, z = decoded(n[0, row, col]), decoded(n[1, row, col]), decoded(n[2, row, col])
            size = ZERO
            for channel in range(channels):
                size += decoded(a[channel, row, col]) * share
            along = x * x * inverse[0, 0] + y * y * inverse[1, 1] + z * z * inverse[2, 2]
            along += TWO * (x * y * inverse[0, 1] + x * z * inverse[0, 2] + y * z * inverse[1, 2])
            spread = max(trace - along, ZERO) * scale * scale
            noise = (variances[0] + variances[1] * size) / max(size * size, TINY * TINY)
            expected = factors[0] * factors[0] * spread * (noise + variances[3])
            noise = spread * (noise + variances[2])
            beyond = ZERO
            if f.size:
                one = decoded(f[row, col])
                one *= factors[2] * np.sqrt(spread) / max(size, TINY) if factors[2] > ZERO else ONE
                one = min(one, MOST_FIT_DEG)
                beyond += factors[1] * np.sqrt(max(one * one - expected, ZERO))
            if d.size:
                beyond += _between(d, row, col, step)
            out[row, col] = min(np.sqrt(noise + beyond * beyond), LARGEST_DEG) if size > ZERO else ZERO


@FUSED.inlined
def _between(coarse: Floats, row: int, col: int, step: int) -> np.float32:
    """A plane of every ``step``-th row and column at a pixel."""
    y, x, one = row // step, col // step, ONE / np.float32(step)
    down, right = np.float32(row - y * step) * one, np.float32(col - x * step) * one
    below, beside = min(y + 1, coarse.shape[0] - 1), min(x + 1, coarse.shape[1] - 1)
    top = coarse[y, x] + right * (coarse[y, beside] - coarse[y, x])
    bottom = coarse[below, x] + right * (coarse[below, beside] - coarse[below, x])
    value: np.float32 = top + down * (bottom - top)
    return value


@FUSED.kept
def indirect_rows(
    task: Task, work: Work, normals: Samples, albedo: Samples, sums: Floats, counts: Floats,
    first: int, last: int, step: int,
) -> None:  # fmt: skip
    """Add up what reaches every ``step``-th row and column from lights that do not, as a share of the albedo.

    normals, albedo: as ``judge_rows`` takes them, zeros where there is none. sums, counts: (row // step, col // step).
    """
    t = lent_task(task, work.matrix, work.per_strength)
    n, a, values, total, count = lent(normals), lent(albedo), lent(work.values), lent(sums), lent(counts)
    channels = t.tone.shape[1]
    share = ONE / np.float32(channels)
    for row in range(-(-first // step) * step, last, step):
        for col in range(0, t.cols, BLOCK):
            width = min(BLOCK, t.cols - col)
            read_block(t, values, row, col, width)
            for light in range(t.lights):
                lamp, per = of_light(t.matrix, light), t.per_strength[light]
                for i in range(-col % step, width, step):
                    size = ZERO
                    for channel in range(channels):
                        size += decoded(a[channel, row, col + i]) * share
                    if not size > ZERO or not values[light * channels, i] > ABSENT:
                        continue
                    level = ZERO
                    for channel in range(channels):
                        level += values[light * channels + channel, i] * share
                    one = at(per, i)
                    lx, ly, lz = at(lamp, i)
                    nx = decoded(n[0, row, col + i])
                    ny = decoded(n[1, row, col + i])
                    nz = decoded(n[2, row, col + i])
                    cosine = (lx * nx + ly * ny + lz * nz) * one
                    level *= one * t.albedo_scale
                    hindered = (cosine <= FACING) | (level < max(t.dark * t.albedo_scale, SHADOWED * size * cosine))
                    if hindered:
                        total[row // step, (col + i) // step] += min(max(level / size, -MOST_INDIRECT), MOST_INDIRECT)
                        count[row // step, (col + i) // step] += ONE
