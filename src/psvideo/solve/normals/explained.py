"""Compiled part of the robust solver: where plain least squares explains all measurements to their noise.

There nothing is to be weighed down, least squares is the best estimate (Gauss and Markov), and the cheapest.
"""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.solve.normals.blocks import ABSENT, ONE, ZERO, X, Y, Z
from psvideo.solve.normals.equations import DOUBT, add_equations, solve_equations
from psvideo.solve.normals.near_kernel import at, of_light
from psvideo.solve.normals.task import LIGHTS, Floats, Task

EXPLAINED_SQUARED = np.float32(4.5**2)  # of 128 pixels under eight lights, noise spoils none in 99 of 100 blocks
ROUGHLY = np.float32(1e4)  # the condition squared up to which a pixel counts as solved


@FUSED.called
def explained(
    task: Task, read: np.float32, photon: np.float32, w: Floats, v: Floats, m: Floats, e: Floats, n: int
) -> bool:
    """Solve a block by least squares over its usable measurements; True where that explains every one of them.

    read, photon: the variance of a dark measurement, and what light adds to it.
    """
    for light in range(len(e)):
        for i in range(n):
            e[light, i] = ONE if m[light, i] > ABSENT else ZERO
    add_equations(task.matrix, w, m, e, n)
    solve_equations(w, n, ROUGHLY, False)
    return explains(task, read, photon, w, v, m, n)


@FUSED.called
def explains(task: Task, read: np.float32, photon: np.float32, w: Floats, v: Floats, m: Floats, n: int) -> bool:
    """Whether g explains every usable measurement of a block to its noise; DOUBT becomes 0."""
    odd = np.int32(0)
    for light in range(task.lights):
        lamp = of_light(task.matrix, light)
        for i in range(n):
            x, y, z = at(lamp, i)
            a, b, c = w[X + i], w[Y + i], w[Z + i]
            error = m[light, i] - (x * a + y * b + z * c)
            variance = read + photon * max(m[light, i], ZERO) + LIGHTS * LIGHTS * (a * a + b * b + c * c)
            odd = np.int32(odd | (m[light, i] > ABSENT) & (error * error > EXPLAINED_SQUARED * variance))
    v[DOUBT : DOUBT + n] = ZERO
    return bool(odd == 0)
