"""The compiled loops of the robust solver: shadow mask, trimmed start, reweighting, the odd one of four, the error.

Blocks, planes and symbols are those of ``kernel.py``, whose parts are used here: m = L g per pixel. What these loops
add lies in a second working array ``v`` and in ``e`` (light, pixel): brightnesses first, then residuals.
"""

from typing import NamedTuple

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import encoded, lent
from psvideo.solve.normals import kernel
from psvideo.solve.normals.equations import (
    DOUBT,
    FROM,
    LOWER,
    OUT,
    RANK,
    SCALE,
    TO,
    UPPER,
    add_equations,
    halve,
    solve_equations,
)
from psvideo.solve.normals.kernel import (
    ABSENT,
    BLOCK,
    COUNT,
    LIMIT,
    MISSING,
    ONE,
    SUM,
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
from psvideo.solve.normals.near_kernel import at, of_light, place_lights
from psvideo.solve.normals.nine_kernel import LITTLE, NINE, begin_nine, reweigh_nine
from psvideo.solve.normals.odd_of_four import FOUR, TWO, drop_odd_of_four
from psvideo.solve.normals.task import Floats, Result, Samples, Task

STEP = 128  # pixels that are solved together: few enough that all of their planes stay in the nearest cache
HALF, THREE, EIGHT = np.float32(0.5), np.float32(3), np.float32(8)
MANY = np.float32(NINE)  # usable measurements beyond which the weight narrows
SIGMA_OF_MEDIAN = np.float32(1.4826)  # of Gaussian noise
SMALL_SAMPLE = np.float32(1.9)  # the median of few residuals of a fit that follows them falls short by so much
SUSPICION = np.float32(0.05)  # what a highlight among four that was left out still says against the other three
UNCHECKED = np.float32(2.5)  # three measurements are explained exactly, and nothing shows a highlight among them
DEGREES = np.float32(180 / np.pi)
SOUND_SQUARED = np.float32(1e4)  # while weights change, the last solution is kept where they leave a worse condition
NO_ERROR = np.float32(180)  # what is predicted where there is no solution
LEAST_CHECKED = 5  # usable measurements from which on residuals show how well the lights explain a pixel
UNEXPLAINED = LOWER  # a plane of v that is free by then


class Weights(NamedTuple):
    """How measurements are weighed, and which normals are trusted; the fields are described in robust.Reweighting.

    ``most_error_deg`` is the limit for this picture, and ``common`` the share of a pixel's light that its lights
    usually leave unexplained.
    """

    rounds: int
    tukey: bool
    width: np.float32
    noise: np.float32
    signal_noise: np.float32
    darkest: np.float32
    brightest: np.float32
    contradiction: np.float32
    most_error_deg: np.float32
    common: np.float32


class Memory(NamedTuple):
    """What one call of ``solve_rows`` works in; no two calls at a time may share it."""

    planes: Floats
    more: Floats
    values: Floats
    measurements: Floats
    errors: Floats
    flat: Floats
    matrix: Floats
    per_strength: Floats


def working_memory(task: Task) -> Memory:
    """Return memory for one thread."""
    plain = kernel.working_memory(task)
    return Memory(
        planes=np.zeros_like(plain.planes),
        more=np.zeros(9 * BLOCK, np.float32),
        values=plain.values,
        measurements=plain.measurements,
        errors=np.full((len(plain.measurements), BLOCK), OUT, np.float32),
        flat=plain.measurements.reshape(-1),
        matrix=plain.matrix,
        per_strength=plain.per_strength,
    )


@FUSED.kept
def solve_rows(
    task: Task, result: Result, error: Samples, misfit: Floats, memory: Memory, weights: Weights,
    first: int, last: int, step: int,
) -> None:  # fmt: skip
    """Solve the rows from ``first`` up to ``last``; no two calls may share rows, and any number may run at once.

    Only every ``step``-th row of the picture is solved. ``error`` (pixel,) or empty takes the predicted error in
    degrees, ``misfit`` (pixel,) or empty the share of a pixel's light that its lights leave unexplained, 0 where
    too few are usable to judge.
    """
    t = kernel.lent_task(task, memory.matrix, memory.per_strength)
    out = Result(lent(result.normals), lent(result.albedo), lent(result.valid), lent(result.residual))
    predicted, unexplained = lent(error), lent(misfit)
    w, v, values = lent(memory.planes), lent(memory.more), lent(memory.values)
    m, e = lent(memory.measurements), lent(memory.errors)
    flat = lent(memory.flat)
    for row in range(-(-first // step) * step, last, step):
        for col in range(0, t.cols, STEP):
            n = min(STEP, t.cols - col)
            if t.mask.size and not t.mask[row, col : col + n].any():
                w[X : X + n], w[Y : Y + n], w[Z : Z + n] = ZERO, ZERO, ZERO
                v[DOUBT : DOUBT + n], v[UNEXPLAINED : UNEXPLAINED + n] = NO_ERROR, ZERO
            else:
                _solve_block(t, weights, w, v, values, m, e, flat, row, col, n)
            start = row * t.cols + col
            kernel._store_block(t, out, w, values, m, start, n)
            for i in range(min(n, len(predicted))):
                predicted[start + i] = encoded(v[DOUBT + i] if out.valid[start + i] else ZERO, predicted)
            for i in range(min(n, len(unexplained))):
                unexplained[start + i] = v[UNEXPLAINED + i] if out.valid[start + i] else ZERO


@FUSED.inlined
def _solve_block(
    task: Task,
    weights: Weights,
    w: Floats,
    v: Floats,
    values: Floats,
    m: Floats,
    e: Floats,
    flat: Floats,
    row: int,
    col: int,
    n: int,
) -> None:
    """Leave g in the planes X, Y, Z, all 0 where the normal is not to be trusted, and the error in DOUBT."""
    start, channels = row * task.cols + col, task.tone.shape[1]
    place_lights(task.matrix, task.per_strength, task.near, row, col, n)
    if channels == 1:
        kernel._gather_one(task, values, start, n)
    else:
        kernel._gather_three(task, values, start, n)
    kernel._hide_unseen(task, values, row, col, n)
    if channels > 1:
        kernel._combine(task, w, values, m, n)
    _hide_shadows(task, w, m, n)
    nine = len(m) == NINE and task.near.depth.size == 0
    if nine:
        begin_nine(task.matrix, task.per_strength, weights.darkest, weights.brightest, w, flat, n)
    else:
        _choose_start(task, weights, w, v, m, e, n)
        _add_start(task, w, v, m, e, n)
    solve_equations(w, n, SOUND_SQUARED, False)
    drop_odd_of_four(task, weights.noise, weights.signal_noise, weights.contradiction, w, v, m, e, n)
    for _ in range(weights.rounds):
        _reweigh(task, weights, weights.tukey, weights.width, False, nine, w, v, m, e, flat, n)
        solve_equations(w, n, SOUND_SQUARED, True)
    _reweigh(task, weights, False, TWO, True, nine, w, v, m, e, flat, n)
    _predict_error(weights, min(task.lights, LEAST_CHECKED), w, v, n)
    if task.mask.size:
        for i in range(n):
            kept = ONE if task.mask[row, col + i] else ZERO
            w[X + i], w[Y + i], w[Z + i] = w[X + i] * kept, w[Y + i] * kept, w[Z + i] * kept


@FUSED.inlined
def _reweigh(
    task: Task, weights: Weights, tukey: bool, width: np.float32, last: bool, nine: bool,
    w: Floats, v: Floats, m: Floats, e: Floats, flat: Floats, n: int,
) -> None:  # fmt: skip
    """SCALE and the normal equations, every measurement weighed by how well the last solution explains it."""
    if nine:
        reweigh_nine(task.matrix, tukey, width, weights.noise, weights.signal_noise, SIGMA_OF_MEDIAN, w, v, flat, n)
    else:
        _find_scale(task, weights, w, v, m, e, n)
        _add_weighted(task, tukey, width, last, w, v, m, e, n)


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


@FUSED.inlined
def _choose_start(task: Task, weights: Weights, w: Floats, v: Floats, m: Floats, e: Floats, n: int) -> None:
    """Between which brightnesses (LOWER, UPPER) the start looks: all but the darkest and brightest few, four at least.

    The darkest may be half in shadow, and highlights only add: that is why more is left out at the bright end.
    """
    v[UPPER : UPPER + n] = ZERO
    for light in range(len(e)):
        plane, sorted_out, per = m[light], e[light], task.per_strength[light]
        for i in range(n):
            bright = plane[i] * at(per, i)
            v[UPPER + i] = max(v[UPPER + i], bright)
            sorted_out[i] = bright if plane[i] > ABSENT else OUT
    for i in range(n):
        count = w[COUNT + i]
        spare = max(count - FOUR, ZERO)
        bright = np.floor(min(weights.brightest * count, spare))
        v[SCALE + i] = count - bright
        v[RANK + i] = np.floor(min(weights.darkest * count, spare - bright)) + ONE
        v[FROM + i], v[TO + i] = w[LIMIT + i], v[UPPER + i]
    halve(v, e, n)
    for i in range(n):
        v[LOWER + i] = v[FROM + i]
        v[RANK + i], v[FROM + i], v[TO + i] = v[SCALE + i], w[LIMIT + i], v[UPPER + i]
    halve(v, e, n)
    for i in range(n):
        v[UPPER + i] = v[TO + i]


@FUSED.inlined
def _add_start(task: Task, w: Floats, v: Floats, m: Floats, e: Floats, n: int) -> None:
    """The normal equations of the start's measurements, with a little of the others."""
    for light in range(len(e)):
        bright, there = e[light], m[light]
        for i in range(n):
            inner = (bright[i] >= v[LOWER + i]) & (bright[i] <= v[UPPER + i])
            weight = ONE if inner else LITTLE
            bright[i] = weight if there[i] > ABSENT else ZERO
    add_equations(task.matrix, w, m, e, n)


@FUSED.inlined
def _find_scale(task: Task, weights: Weights, w: Floats, v: Floats, m: Floats, e: Floats, n: int) -> None:
    """Residuals without their sign, and in SCALE their median as a standard deviation, at least a camera's noise.

    Three of the residuals may be 0 because three unknowns were fitted: the median is that of the others.
    """
    for i in range(n):
        v[TO + i], v[FROM + i] = ZERO, ZERO
    for light in range(len(e)):
        lamp, there, errors = of_light(task.matrix, light), m[light], e[light]
        for i in range(n):
            x, y, z = at(lamp, i)
            error = abs(there[i] - (x * w[X + i] + y * w[Y + i] + z * w[Z + i]))
            errors[i] = error if there[i] > ABSENT else OUT
            v[TO + i] += error if there[i] > ABSENT else ZERO
    for i in range(n):
        v[RANK + i] = np.floor(HALF * (w[COUNT + i] + THREE))
        v[TO + i] = v[TO + i] / max(w[COUNT + i] - v[RANK + i] + ONE, ONE)  # so many are as large or larger
    halve(v, e, n)
    for i in range(n):
        length = np.sqrt(w[X + i] ** 2 + w[Y + i] ** 2 + w[Z + i] ** 2)
        least = weights.noise + weights.signal_noise * length
        v[SCALE + i] = max(SIGMA_OF_MEDIAN * HALF * (v[FROM + i] + v[TO + i]), least)


@FUSED.inlined
def _add_weighted(
    task: Task, tukey: bool, width: np.float32, last: bool, w: Floats, v: Floats, m: Floats, e: Floats, n: int
) -> None:
    """The normal equations, every measurement weighed by how well the last solution explains it.

    Of many measurements fewer will do: the weight narrows with the root of their number, not for the ``last`` time.
    """
    for i in range(n):
        narrow = ONE if last else np.sqrt(MANY / max(w[COUNT + i], MANY))
        v[FROM + i] = ONE / (width * narrow * v[SCALE + i])
    for light in range(len(e)):
        error = e[light]
        for i in range(n):
            square = (error[i] * v[FROM + i]) ** 2  # of what is OUT: infinite
            inside = max(ONE - square, ZERO)
            error[i] = inside * inside if tukey else ONE / (ONE + square)
    add_equations(task.matrix, w, m, e, n)


@FUSED.called
def _predict_error(weights: Weights, checked: int, w: Floats, v: Floats, n: int) -> None:
    """The normal's standard error in degrees into DOUBT, and g = 0 where it is too large to be trusted.

    The residuals' scale through the weighted equations: sigma sqrt(trace(P A^-1 P)) / |g|, with P across the normal.
    Beyond eight lights the error does not shrink further, because what is not matte does not average out. Where fewer
    than ``checked`` measurements are usable, residuals say little: they are taken for what is common in the picture.
    """
    for i in range(n):
        a, b, c, d, e, f = w[XX + i], w[XY + i], w[XZ + i], w[YY + i], w[YZ + i], w[ZZ + i]
        xx, xy, xz = d * f - e * e, c * e - b * f, b * e - c * d
        yy, yz, zz = a * f - c * c, b * c - a * e, a * d - b * b
        determinant = a * xx + b * xy + c * xz
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
