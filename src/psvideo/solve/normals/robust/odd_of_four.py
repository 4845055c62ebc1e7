"""Compiled part of the robust solver: which of four measurements that contradict each other is to be left out.

S. Barsky and M. Petrou, "The 4-source photometric stereo technique for three-dimensional surfaces in the presence of
highlights and shadows", IEEE Transactions on Pattern Analysis and Machine Intelligence 25(10), 2003. Four directions
are linearly dependent, and so must be the four brightnesses of a matte surface that all of them light.
"""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.compute.symmetric import adjugate
from psvideo.compute.whole_stores import unmasked
from psvideo.model.arrays import Floats
from psvideo.solve.normals.loops.blocks import ABSENT, COUNT, MISSING, ONE, XX, XY, XZ, YY, YZ, ZERO, ZZ, X, Y, Z
from psvideo.solve.normals.loops.near_kernel import at, of_light, shown
from psvideo.solve.normals.robust.equations import (
    DOUBT,
    LOWER,
    ODD,
    RANK,
    SENT,
    VIEW_X,
    VIEW_Y,
    VIEW_Z,
    add_equations,
    solve_equations,
)
from psvideo.solve.normals.robust.weighing import Weights
from psvideo.solve.normals.task import Task

TWO, FOUR = np.float32(2), np.float32(4)
TINIEST = np.float32(1e-18)
BEST, SQUARES = LOWER, RANK  # planes of v that are free at this step


@FUSED.called
def drop_odd_of_four(task: Task, weights: Weights, w: Floats, v: Floats, m: Floats, e: Floats, n: int) -> None:
    """Where four measurements remain and contradict each other, the likeliest highlight among them becomes MISSING.

    The residuals of least squares over four always stand in one ratio, whichever measurement is to blame. Highlights
    add light, so it is one that is too bright for the other three; of these, the one whose mirror direction is nearest
    to the normal that the other three give. DOUBT is the root of the squared residuals there, else 0.
    """
    v[DOUBT : DOUBT + n] = ZERO
    if not _some_contradict(task, weights, w, v, m, e, n):
        return
    for i in range(n):
        v[BEST + i], v[ODD + i] = -TWO, -ONE
    for light in range(task.lights):
        lamp = of_light(task.matrix, light)
        for i in range(n):
            x, y, z = at(lamp, i)
            size = np.sqrt(x * x + y * y + z * z)
            half_x, half_y, half_z = x + size * v[VIEW_X + i], y + size * v[VIEW_Y + i], z + size * v[VIEW_Z + i]
            to_mirror = ONE / np.sqrt(half_x * half_x + half_y * half_y + half_z**2)
            half_x, half_y, half_z = half_x * to_mirror, half_y * to_mirror, half_z * to_mirror
            nearness = _nearness_without(w, v, i, x, y, z, e[light, i], half_x, half_y, half_z)
            best, odd = unmasked(v[BEST + i]), unmasked(v[ODD + i])
            better = (e[light, i] > ZERO) & (nearness > best)
            v[BEST + i] = nearness if better else best
            v[ODD + i] = np.float32(light) if better else odd
    for i in range(n):
        odd = unmasked(v[ODD + i])
        v[ODD + i] = odd if v[DOUBT + i] > ZERO else -ONE
        v[DOUBT + i] = np.sqrt(v[SQUARES + i]) if v[ODD + i] >= ZERO else ZERO
        w[COUNT + i] -= ONE if v[ODD + i] >= ZERO else ZERO
    for light in range(task.lights):
        for i in range(n):
            there = unmasked(m[light, i])
            m[light, i] = MISSING if v[ODD + i] == np.float32(light) else there
    _solve_again(task, w, v, m, e, n)


@FUSED.inlined
def _some_contradict(task: Task, weights: Weights, w: Floats, v: Floats, m: Floats, e: Floats, n: int) -> bool:
    """Whether any pixel of the block has four measurements that contradict each other; DOUBT is 1 where."""
    four = 0
    for i in range(n):
        four += w[COUNT + i] == FOUR
    if four == 0:
        return False
    _find_errors(task, w, v, m, e, n)
    some = 0
    for i in range(n):
        light = v[SENT + i] * np.sqrt(w[X + i] ** 2 + w[Y + i] ** 2 + w[Z + i] ** 2)
        sigma = weights.noise + weights.signal_noise * light
        contradict = (w[COUNT + i] == FOUR) & (v[SQUARES + i] > (weights.contradiction * sigma) ** 2)
        v[DOUBT + i] = ONE if contradict else ZERO
        some += contradict
    return some > 0


@FUSED.inlined
def _find_errors(task: Task, w: Floats, v: Floats, m: Floats, e: Floats, n: int) -> None:
    """Residuals, 0 where MISSING, and the sum of their squares in SQUARES."""
    v[SQUARES : SQUARES + n] = ZERO
    for light in range(task.lights):
        lamp = of_light(task.matrix, light)
        for i in range(n):
            error = m[light, i] - shown(lamp, w, i)
            error = error if m[light, i] > ABSENT else ZERO
            e[light, i] = error
            v[SQUARES + i] += error * error


@FUSED.inlined
def _nearness_without(
    w: Floats, v: Floats, i: int, x: np.float32, y: np.float32, z: np.float32, error: np.float32,
    half_x: np.float32, half_y: np.float32, half_z: np.float32,
) -> np.float32:  # fmt: skip
    """Cosine between a mirror direction and the normal that the other three give: g - A^-1 l (sum of squares / error).

    With four measurements 1 - leverage is error squared / the sum of squares.
    """
    a, b, c, d, q, f = w[XX + i], w[XY + i], w[XZ + i], w[YY + i], w[YZ + i], w[ZZ + i]
    xx, xy, xz, yy, yz, zz, determinant = adjugate(a, b, c, d, q, f)
    step = v[SQUARES + i] / (error * determinant) if error * determinant != ZERO else ZERO
    gx = w[X + i] - (xx * x + xy * y + xz * z) * step
    gy = w[Y + i] - (xy * x + yy * y + yz * z) * step
    gz = w[Z + i] - (xz * x + yz * y + zz * z) * step
    cosine: np.float32 = (gx * half_x + gy * half_y + gz * half_z) / np.sqrt(gx * gx + gy * gy + gz * gz + TINIEST)
    return cosine


@FUSED.inlined
def _solve_again(task: Task, w: Floats, v: Floats, m: Floats, e: Floats, n: int) -> None:
    """Solve with what is left, only where one of four was dropped."""
    for light in range(len(e)):
        for i in range(n):
            e[light, i] = ONE if (v[ODD + i] >= ZERO) & (m[light, i] > ABSENT) else ZERO
    add_equations(task.matrix, w, m, e, n)
    solve_equations(w, n, task.condition_squared, True)
