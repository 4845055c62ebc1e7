"""The compiled loops of the robust solver: shadow mask, trimmed start, reweighting, the odd one of four, the error.

Blocks, planes and symbols are those of ``kernel.py``, whose parts are used here: m = L g per pixel. What these loops
add lies in a second working array ``v`` and in ``e`` (light, pixel): brightnesses first, then residuals.
"""

from typing import NamedTuple

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import encoded, lent
from psvideo.compute.symmetric import adjugate
from psvideo.solve.normals import kernel
from psvideo.solve.normals.any_lights import add_start, add_weighted, choose_start, find_scale
from psvideo.solve.normals.blocks import (
    ABSENT,
    BLOCK,
    COUNT,
    LIMIT,
    MISSING,
    ONE,
    SUM,
    THREE,
    TINY,
    XX,
    XY,
    XZ,
    YY,
    YZ,
    ZERO,
    ZZ,
    X,
    Y,
    Z,
)
from psvideo.solve.normals.equations import DOUBT, LOWER, OUT, SCALE, solve_equations
from psvideo.solve.normals.explained import explained, explains
from psvideo.solve.normals.few_lights import EIGHT, FOUR, begin_few, reweigh_few
from psvideo.solve.normals.measuring import all_seen, combine, gather_one, gather_three, hide_unseen
from psvideo.solve.normals.near_kernel import at, place_lights
from psvideo.solve.normals.odd_of_four import TWO, drop_odd_of_four
from psvideo.solve.normals.reflecting import KEPT, OF_LIGHT, find_ways, reflecting
from psvideo.solve.normals.task import FEW, LIGHTS, Bytes, Floats, Result, Task, Weights, empty_result

STEP = 128  # pixels that are solved together: few enough that all of their planes stay in the nearest cache
SMALL_SAMPLE = np.float32(1.9)  # the median of few residuals of a fit that follows them falls short by so much
SUSPICION = np.float32(0.05)  # what a highlight among four that was left out still says against the other three
UNCHECKED = np.float32(2.5)  # three measurements are explained exactly, and nothing shows a highlight among them
DEGREES = np.float32(180 / np.pi)
SOUND_SQUARED = np.float32(1e4)  # while weights change, the last solution is kept where they leave a worse condition
NO_ERROR = np.float32(180)  # what is predicted where there is no solution
LEAST_CHECKED = 5  # usable measurements from which on residuals show how well the lights explain a pixel
DROPPED_FROM = 4  # measurements, of which one may be left out
UNEXPLAINED = LOWER  # a plane of v that is free by then


class Memory(NamedTuple):
    """What one call of ``solve_rows`` works in; no two calls at a time may share it."""

    planes: Floats
    more: Floats
    values: Floats
    measurements: Floats
    errors: Floats
    flat: Floats
    matrix: Floats  # (light, 3, pixel): what lights send to every pixel
    per_strength: Floats  # (light, pixel)
    block: Result  # of one block, in float32
    ways: (
        Floats  # (light, 5, pixel) where the subject's reflectance is known, else of no light: ``reflecting.find_ways``
    )
    matte: Floats  # (light, pixel): measurements without highlights
    kept: Floats  # flat: what else ``reflecting`` keeps


def working_memory(task: Task, *, reflecting: bool, residual: bool) -> Memory:
    """Return memory for one thread; ``reflecting`` where the subject's reflectance is known, ``residual`` where
    residuals are wanted."""
    lights = len(task.matrix)
    plain = kernel.working_memory(task)
    matrix, per_strength = np.zeros((lights, 3, BLOCK), np.float32), np.zeros((lights, BLOCK), np.float32)
    matrix[:], per_strength[:] = (
        task.matrix[..., None],
        task.per_strength[:, None],
    )  # near lights' change with the block
    return Memory(
        planes=np.zeros_like(plain.planes),
        more=np.zeros(9 * BLOCK, np.float32),
        values=plain.values,
        measurements=plain.measurements,
        errors=np.full((len(plain.measurements), BLOCK), OUT, np.float32),
        flat=plain.measurements.reshape(-1),
        matrix=matrix,
        per_strength=per_strength,
        block=empty_result(BLOCK, task.tone.shape[1], half=False, residual=residual),
        ways=np.zeros((lights if reflecting else 0, 5, BLOCK), np.float32),
        matte=np.full((lights if reflecting else 0, BLOCK), MISSING, np.float32),
        kept=np.zeros(BLOCK * (KEPT + OF_LIGHT * lights) if reflecting else 0, np.float32),
    )


def as_bytes(result: Result) -> Result:
    """Return a result as ``solve_rows`` takes it."""
    return Result(
        normals=result.normals.view(np.uint8),
        albedo=result.albedo.view(np.uint8),
        valid=result.valid,
        residual=result.residual.view(np.uint8),
    )


@FUSED.kept
def solve_rows(
    task: Task, result: Result, half: bool, error: Bytes, misfit: Floats, memory: Memory, weights: Weights,
    first: int, last: int, step: int,
) -> None:  # fmt: skip
    """Solve the rows from ``first`` up to ``last``; no two calls may share rows, and any number may run at once.

    Only every ``step``-th row of the picture is solved. ``error`` (pixel,) or empty takes the predicted error in
    degrees, ``misfit`` (pixel,) or empty the share of a pixel's light that its lights leave unexplained, 0 where
    too few are usable to judge. ``result`` and ``error`` are the bytes of half floats, or of float32, so that one loop,
    compiled once, writes both.
    """
    t = kernel.lent_task(task, memory.matrix, memory.per_strength)
    out = Result(lent(result.normals), lent(result.albedo), lent(result.valid), lent(result.residual))
    predicted, unexplained = lent(error), lent(misfit)
    w, v, values = lent(memory.planes), lent(memory.more), lent(memory.values)
    m, e = lent(memory.measurements), lent(memory.errors)
    flat, ways = lent(memory.flat), lent(memory.ways)
    matte, kept = lent(memory.matte), lent(memory.kept)
    block = Result(
        lent(memory.block.normals), lent(memory.block.albedo), lent(memory.block.valid), lent(memory.block.residual)
    )
    sent, per = lent(task.matrix), lent(task.per_strength)
    find_ways(t.matrix, t.per_strength, ways, BLOCK)  # near lights' change with the block
    for row in range(-(-first // step) * step, last, step):
        for col in range(0, t.cols, STEP):
            n = min(STEP, t.cols - col)
            summed = False
            if t.mask.size and not t.mask[row, col : col + n].any():
                w[X : X + n], w[Y : Y + n], w[Z : Z + n] = ZERO, ZERO, ZERO
                v[DOUBT : DOUBT + n], v[UNEXPLAINED : UNEXPLAINED + n] = NO_ERROR, ZERO
            else:
                summed = _solve_block(t, sent, per, weights, w, v, values, m, e, flat, ways, matte, kept, row, col, n)
            start = row * t.cols + col
            kernel.store_block(t, block, w, values, m, 0, n, summed)
            for i in range(n):
                v[DOUBT + i] = v[DOUBT + i] if block.valid[i] else ZERO
            for i in range(min(n, len(unexplained))):
                unexplained[start + i] = v[UNEXPLAINED + i] if block.valid[i] else ZERO
            _hand_out(block, v, out, predicted, half, start, n)


@FUSED.called
def _hand_out(block: Result, v: Floats, out: Result, predicted: Bytes, half: bool, start: int, n: int) -> None:
    """Write a solved block where it goes."""
    for axis in range(3):
        _write(block.normals[axis], out.normals[axis], half, start, n)
    for channel in range(len(block.albedo)):
        _write(block.albedo[channel], out.albedo[channel], half, start, n)
    if out.residual.size:
        _write(block.residual, out.residual, half, start, n)
    if predicted.size:
        _write(v[DOUBT : DOUBT + n], predicted, half, start, n)
    out.valid[start : start + n] = block.valid[:n]


@FUSED.called
def _write(values: Floats, plane: Bytes, half: bool, start: int, n: int) -> None:
    if half:
        halves = plane.view(np.uint16)[start : start + n]
        for i in range(n):
            halves[i] = encoded(values[i], halves)
    else:
        plane.view(np.float32)[start : start + n] = values[:n]


@FUSED.inlined
def _solve_block(
    task: Task,
    sent: Floats,
    per: Floats,
    weights: Weights,
    w: Floats,
    v: Floats,
    values: Floats,
    m: Floats,
    e: Floats,
    flat: Floats,
    ways: Floats,
    matte: Floats,
    kept: Floats,
    row: int,
    col: int,
    n: int,
) -> bool:
    """Leave g in the planes X, Y, Z, all 0 where the normal is not to be trusted, and the error in DOUBT.

    Returned is whether three channels' sums are left as well (``colour_kernel.py``), of what counts in every pixel.
    """
    start, channels = row * task.cols + col, task.tone.shape[1]
    distant = task.near.depth.size == 0
    if not distant:
        place_lights(task.matrix, task.per_strength, task.near, row, col, n)
        find_ways(task.matrix, task.per_strength, ways, n)
    plain = distant and channels == 3 and all_seen(task.seen, row, col, n)
    summed = plain and kernel.solve_colours(task, w, values, m, start, n)
    if summed:
        w[COUNT : COUNT + n], w[LIMIT : LIMIT + n] = np.float32(task.lights), task.dark
        done = weights.read > ZERO and explains(task, weights.read, weights.photon, w, v, m, n)
    else:
        _read_usable(task, w, values, m, row, col, n)
        done = weights.read > ZERO and explained(task, weights.read, weights.photon, w, v, m, e, n)
    few = len(m) == FEW and distant
    if not done:
        if few:
            begin_few(sent, per, weights.darkest, weights.brightest, w, flat, n)
        else:
            choose_start(task, weights, w, v, m, e, n)
            add_start(task, w, v, m, e, n)
        solve_equations(w, n, SOUND_SQUARED, False)
        drop_odd_of_four(task, weights.noise, weights.signal_noise, weights.contradiction, w, v, m, e, n)
        for _ in range(weights.rounds):
            _reweigh(
                task, sent, weights, weights.signal_noise, weights.tukey, weights.width, False, few, w, v, m, e, flat, n
            )
            solve_equations(w, n, SOUND_SQUARED, True)
    share = LIGHTS if weights.read > ZERO else weights.signal_noise
    again = not done and ways.size > 0
    if again:
        reflecting(task.matrix, ways, task.lights, weights, share, kept, matte, w, v, values, m, e, n)
    else:
        _reweigh(task, sent, weights, share, False, TWO, True, few, w, v, m, e, flat, n)
    _predict_error(weights, min(task.lights, LEAST_CHECKED), w, v, n)
    if task.mask.size:
        for i in range(n):
            inside = ONE if task.mask[row, col + i] else ZERO
            w[X + i], w[Y + i], w[Z + i] = w[X + i] * inside, w[Y + i] * inside, w[Z + i] * inside
    return summed and not again and (done or task.lights > DROPPED_FROM)


@FUSED.called
def _read_usable(task: Task, w: Floats, values: Floats, m: Floats, row: int, col: int, n: int) -> None:
    """Read a block's measurements; what is saturated, unseen or in shadow is MISSING, and COUNT is what remains."""
    start, channels = row * task.cols + col, task.tone.shape[1]
    if channels == 1:
        gather_one(task, values, start, n)
    else:
        gather_three(task, values, start, n)
    hide_unseen(task, values, row, col, n)
    if channels > 1:
        combine(task, w, values, m, n)
    _hide_shadows(task, w, m, n)


@FUSED.inlined
def _reweigh(
    task: Task, sent: Floats, weights: Weights, share: np.float32, tukey: bool, width: np.float32, last: bool,
    few: bool, w: Floats, v: Floats, m: Floats, e: Floats, flat: Floats, n: int,
) -> None:  # fmt: skip
    """SCALE and the normal equations, every measurement weighed by how well the last solution explains it.

    share: of a pixel's light, what is left over at least.
    """
    if few:
        reweigh_few(sent, tukey, width, weights.noise, share, w, v, flat, n)
    else:
        find_scale(task.matrix, weights.noise, share, w, v, m, e, n)
        add_weighted(task.matrix, tukey, width, last, w, v, m, e, n)


@FUSED.inlined
def _hide_shadows(task: Task, w: Floats, m: Floats, n: int) -> None:
    """What is dark beside the pixel's own mean becomes MISSING; COUNT is what remains."""
    w[SUM : SUM + n], w[COUNT : COUNT + n] = ZERO, ZERO
    for light in range(task.lights):
        plane, per = m[light], task.per_strength[light]
        for i in range(n):
            w[SUM + i] += max(plane[i] * at(per, i), ZERO) if plane[i] > ABSENT else ZERO
            w[COUNT + i] += ONE if plane[i] > ABSENT else ZERO
    for i in range(n):
        w[LIMIT + i] = max(task.dark, task.ratio * w[SUM + i] / (w[COUNT + i] + TINY))
        w[COUNT + i] = ZERO
    for light in range(task.lights):
        plane, per = m[light], task.per_strength[light]
        for i in range(n):
            lit = plane[i] * at(per, i) > w[LIMIT + i]
            plane[i] = plane[i] if lit else MISSING
            w[COUNT + i] += ONE if lit else ZERO


@FUSED.called
def _predict_error(weights: Weights, checked: int, w: Floats, v: Floats, n: int) -> None:
    """The normal's standard error in degrees into DOUBT, and g = 0 where it is too large to be trusted.

    The residuals' scale through the weighted equations: sigma sqrt(trace(P A^-1 P)) / |g|, with P across the normal.
    Beyond eight lights the error does not shrink further, because what is not matte does not average out. Where fewer
    than ``checked`` measurements are usable, residuals say little: they are taken for what is common in the picture.
    """
    for i in range(n):
        a, b, c, d, e, f = w[XX + i], w[XY + i], w[XZ + i], w[YY + i], w[YZ + i], w[ZZ + i]
        xx, xy, xz, yy, yz, zz, determinant = adjugate(a, b, c, d, e, f)
        x, y, z, count = w[X + i], w[Y + i], w[Z + i], w[COUNT + i]
        square = x * x + y * y + z * z
        along = x * x * xx + y * y * yy + z * z * zz + TWO * (x * y * xy + x * z * xz + y * z * yz)
        solved = (square > ZERO) & (determinant > ZERO) & (count >= THREE)
        across = (xx + yy + zz - along / square) / determinant if solved else ZERO
        few = count < np.float32(checked)
        scale = max(v[SCALE + i], weights.common * np.sqrt(square) if few else ZERO)
        sigma = max(scale, SUSPICION * v[DOUBT + i]) * (UNCHECKED if count < FOUR else SMALL_SAMPLE)
        spread = max(across * max(count / EIGHT, ONE) / square, ZERO) if solved else ZERO
        error = DEGREES * sigma * np.sqrt(spread) if solved else NO_ERROR
        trusted = error <= weights.most_error_deg
        judged = solved & (not few) & (count > THREE)
        v[UNEXPLAINED + i] = scale / np.sqrt(square) if judged else ZERO
        v[DOUBT + i] = min(error, NO_ERROR)
        w[X + i] = x if trusted else ZERO
        w[Y + i] = y if trusted else ZERO
        w[Z + i] = z if trusted else ZERO
