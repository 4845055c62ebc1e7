"""Compiled part of the robust solver: where plain least squares explains all measurements to their noise.

There nothing is to be weighed down, least squares is the best estimate (Gauss and Markov), and the cheapest.
"""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.compute.whole_stores import unmasked
from psvideo.model.arrays import Floats, Indices
from psvideo.solve.normals.loops.blocks import ABSENT, COUNT, HIGH, LOW, ONE, THREE, ZERO, X, Y, Z
from psvideo.solve.normals.loops.near_kernel import at, of_light
from psvideo.solve.normals.robust.equations import add_equations, solve_equations
from psvideo.solve.normals.task import LIGHTS, Task

EXPLAINED_SQUARED = np.float32(4.5**2)  # of eight measurements, noise spoils none in 9999 of 10,000 pixels
ROUGHLY = np.float32(1e4)  # the condition squared up to which a pixel counts as solved
FAR_OFF_SQUARED = np.float32(3.0**2)  # noise takes 0.0027 of all measurements so far
MOST_FAR_OFF = np.float32(0.01)
ODD, FAR_OFF = LOW, HIGH  # planes of w that are free by then


@FUSED.called
def solve_plainly(task: Task, w: Floats, m: Floats, e: Floats, n: int) -> None:
    """Solve a block by least squares over its usable measurements."""
    for light in range(len(e)):
        for i in range(n):
            e[light, i] = ONE if m[light, i] > ABSENT else ZERO
    add_equations(task.matrix, w, m, e, n)
    solve_equations(w, n, ROUGHLY, False)


@FUSED.called
def list_unexplained(task: Task, w: Floats, m: Floats, listed: Indices, n: int) -> int:
    """List the pixels with a usable measurement that g does not explain to its noise, and return how many they are.

    All are listed where the others' measurements are farther off than noise would take so many: a surface that is not
    matte turns their normals too. (Of the noise a fit of three numbers takes its part.) All are listed as well where
    too few lights reach one of them, for shadows end there. Three measurements are always explained.
    """
    w[ODD : ODD + n], w[FAR_OFF : FAR_OFF + n] = ZERO, ZERO
    for light in range(task.lights):
        lamp, per = of_light(task.matrix, light), task.per_strength[light]
        read, photon = task.noise[light, 0], task.noise[light, 1]
        for i in range(n):
            x, y, z = at(lamp, i)
            a, b, c = w[X + i], w[Y + i], w[Z + i]
            error = m[light, i] - (x * a + y * b + z * c)
            share = LIGHTS / at(per, i)
            variance = read + photon * max(m[light, i], ZERO) + share * share * (a * a + b * b + c * c)
            there = m[light, i] > ABSENT
            odd = unmasked(w[ODD + i])
            w[ODD + i] = ONE if there & (error * error > EXPLAINED_SQUARED * variance) else odd
            left = FAR_OFF_SQUARED * variance * (w[COUNT + i] - THREE)
            w[FAR_OFF + i] += ONE if there & (error * error * w[COUNT + i] > left) else ZERO
    count, far_off, measured, unsolved = 0, ZERO, ZERO, False
    for i in range(n):
        listed[count] = i
        checked = w[COUNT + i] > THREE
        odd = (w[ODD + i] > ZERO) & checked
        count += odd
        unsolved |= (w[ODD + i] > ZERO) & (w[COUNT + i] < THREE)
        far_off += w[FAR_OFF + i] if checked & (not odd) else ZERO
        measured += w[COUNT + i] if checked & (not odd) else ZERO
    if unsolved or (count and far_off > MOST_FAR_OFF * measured):
        for i in range(n):
            listed[i] = i
        return n
    return count
