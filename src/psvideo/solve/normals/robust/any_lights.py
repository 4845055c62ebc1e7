"""Compiled parts of the robust solver for any number of lights, plane by plane in memory: start, scale and weights."""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.compute.whole_stores import unmasked
from psvideo.model.arrays import Floats
from psvideo.solve.normals.loops.blocks import ABSENT, COUNT, LIMIT, ONE, THREE, ZERO, X, Y, Z
from psvideo.solve.normals.loops.near_kernel import at, of_light, shown
from psvideo.solve.normals.robust.equations import (
    FROM,
    HALF,
    LOWER,
    OUT,
    RANK,
    SCALE,
    SENT,
    TO,
    UPPER,
    add_equations,
    halve,
)
from psvideo.solve.normals.robust.few_lights import FOUR, LITTLE, SIGMA_OF_MEDIAN, median_few
from psvideo.solve.normals.robust.weighing import Weights
from psvideo.solve.normals.task import FEW, Task

MANY = np.float32(FEW)  # usable measurements beyond which the weight narrows


@FUSED.called
def choose_start(task: Task, weights: Weights, w: Floats, v: Floats, m: Floats, e: Floats, n: int) -> None:
    """Between which brightnesses (LOWER, UPPER) the start looks: all but the darkest and brightest few, four at least.

    The darkest may be half in shadow, and highlights only add: that is why more is left out at the bright end.
    """
    v[UPPER : UPPER + n] = ZERO
    for light in range(len(e)):
        plane, sorted_out, per = m[light], e[light], task.per_strength[light]
        for i in range(n):
            bright = plane[i] * at(per, i)
            v[UPPER + i] = max(unmasked(v[UPPER + i]), bright)
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


@FUSED.called
def add_start(task: Task, w: Floats, v: Floats, m: Floats, e: Floats, n: int) -> None:
    """The normal equations of the start's measurements, with a little of the others."""
    for light in range(len(e)):
        bright, there = e[light], m[light]
        for i in range(n):
            inner = (bright[i] >= v[LOWER + i]) & (bright[i] <= v[UPPER + i])
            weight = ONE if inner else LITTLE
            bright[i] = weight if there[i] > ABSENT else ZERO
    add_equations(task.matrix, w, m, e, n)


@FUSED.called
def fill_residuals(matrix: Floats, w: Floats, m: Floats, e: Floats, n: int) -> None:
    """Absolute residuals; OUT where a measurement is MISSING."""
    for light in range(len(e)):
        lamp, there, errors = of_light(matrix, light), m[light], e[light]
        for i in range(n):
            error = abs(there[i] - shown(lamp, w, i))
            errors[i] = error if there[i] > ABSENT else OUT


@FUSED.called
def find_scale(
    matrix: Floats, noise: np.float32, share: np.float32, w: Floats, v: Floats, m: Floats, e: Floats, n: int
) -> None:
    """Absolute residuals, and in SCALE their median as a standard deviation, at least a camera's noise.

    ``share`` is of the light that reaches the pixel: what near lamps send far away is as exact as elsewhere.

    Three of the residuals may be 0 because three unknowns were fitted: the median is that of the others.
    """
    for i in range(n):
        v[TO + i], v[FROM + i] = ZERO, ZERO
    for light in range(len(e)):
        lamp, there, errors = of_light(matrix, light), m[light], e[light]
        for i in range(n):
            error = abs(there[i] - shown(lamp, w, i))
            errors[i] = error if there[i] > ABSENT else OUT
            v[TO + i] += error if there[i] > ABSENT else ZERO
    if len(e) == FEW:
        median_few(e, w, v, n)
    else:
        for i in range(n):
            v[RANK + i] = np.floor(HALF * (w[COUNT + i] + THREE))
            v[TO + i] = v[TO + i] / max(w[COUNT + i] - v[RANK + i] + ONE, ONE)  # this many are as large or larger
        halve(v, e, n)
    for i in range(n):
        length = np.sqrt(w[X + i] ** 2 + w[Y + i] ** 2 + w[Z + i] ** 2)
        least = noise + share * length * v[SENT + i]
        v[SCALE + i] = max(SIGMA_OF_MEDIAN * HALF * (v[FROM + i] + v[TO + i]), least)


@FUSED.called
def add_weighted(
    matrix: Floats, tukey: bool, width: np.float32, last: bool, w: Floats, v: Floats, m: Floats, e: Floats, n: int
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
    add_equations(matrix, w, m, e, n)


@FUSED.called
def fill_weights(matrix: Floats, width: np.float32, w: Floats, v: Floats, m: Floats, e: Floats, n: int) -> None:
    """Cauchy's weights of all measurements, 0 of what is not there, as SCALE is."""
    fill_residuals(matrix, w, m, e, n)
    for i in range(n):
        v[FROM + i] = ONE / (width * v[SCALE + i])
    for light in range(len(e)):
        error = e[light]
        for i in range(n):
            square = (error[i] * v[FROM + i]) ** 2  # of what is OUT: infinite
            error[i] = ONE / (ONE + square)
