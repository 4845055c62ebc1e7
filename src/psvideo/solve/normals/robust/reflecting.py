"""Compiled part of the robust solver: pixels solved again under what their subject reflects beyond n . l.

What the model shows without shine is J g, with its gradient J (light, 3, pixel) at g: a step of Gauss and Newton is
what reweighted least squares does with J as the lights.
"""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.model.arrays import Floats
from psvideo.solve.normals.loops.blocks import BLOCK, COUNT, ONE, TINY, ZERO, X, Y, Z
from psvideo.solve.normals.robust.any_lights import add_weighted, fill_residuals, find_scale
from psvideo.solve.normals.robust.equations import OUT, SCALE, solve_equations
from psvideo.solve.normals.robust.reflected_gain import fill_gradient
from psvideo.solve.normals.robust.reflected_light import TWO, fill_left_over, take_off
from psvideo.solve.normals.robust.room import (
    AFTER,
    BEFORE,
    HOLDS,
    KEPT,
    MATTE_X,
    MATTE_Y,
    MATTE_Z,
    OF_LIGHT,
    OLD_X,
    OLD_Y,
    OLD_Z,
    SPREAD,
    Room,
)
from psvideo.solve.normals.robust.weighing import Weights

STEPS = 4
FARTHEST = np.float32(0.3)  # so far, beside its length, does g go in one step
FROM_MEASUREMENTS = np.float32(5)  # of four any model explains too much
CLEARLY = np.float32(0.2)  # where a pixel's residuals come down by so much, in sum, the model holds; by less, in part
FAR_OFF = np.float32(1.5)  # the residual, over the pixel's own without the model, that counts half
_SOUND_SQUARED = np.float32(1e4)


@FUSED.called
def reflect(room: Room, lights: int, weights: Weights, n: int) -> None:
    """Solve solved pixels again under the subject's model, where that explains them better.

    How far the model holds in each is left in the plane HOLDS of ``kept``. Nothing it takes has a type that pictures
    decide, so that it is compiled once for all of them.
    """
    w, v, m, e, kept, matte = room.planes, room.more, room.measurements, room.errors, room.kept, room.matte
    noise, least, gradient = weights.noise, weights.signal_noise, _gradient(room)
    find_scale(room.matrix, noise, least, w, v, m, e, n)
    for i in range(n):
        kept[MATTE_X + i], kept[MATTE_Y + i], kept[MATTE_Z + i] = w[X + i], w[Y + i], w[Z + i]
        kept[SPREAD + i], kept[HOLDS + i] = ONE / (FAR_OFF * v[SCALE + i]), ONE
    _add_up(kept, BEFORE, e, n)
    for step in range(STEPS):
        fill_gradient(room, lights, weights, n)
        for i in range(n):
            kept[OLD_X + i], kept[OLD_Y + i], kept[OLD_Z + i] = w[X + i], w[Y + i], w[Z + i]
        if step == 0:
            find_scale(gradient, noise, least, w, v, matte, e, n)
        else:
            fill_residuals(gradient, w, matte, e, n)
        add_weighted(gradient, weights.tukey, weights.width, False, w, v, matte, e, n)
        solve_equations(w, n, _SOUND_SQUARED, True)
        _shorten(kept, w, n)
    fill_left_over(room, lights, weights, n)
    _add_up(kept, AFTER, e, n)
    _mix(weights, kept, w, n)


@FUSED.inlined
def _mix(weights: Weights, kept: Floats, w: Floats, n: int) -> None:
    """Leave g as far as the model holds, by how much less it leaves of the measurements, and the matte one else."""
    unseen = ONE if weights.rough > ZERO or weights.soft > ZERO else ZERO
    more = ONE if weights.soft > ZERO else ZERO  # it turns normals where residuals do not show it, too
    for i in range(n):
        gained = (kept[BEFORE + i] - kept[AFTER + i]) / (CLEARLY * max(kept[BEFORE + i], TINY))
        gained += more
        holds = min(max(gained, ZERO), ONE) if w[COUNT + i] >= FROM_MEASUREMENTS else unseen
        kept[HOLDS + i] = holds
        w[X + i] = kept[MATTE_X + i] + holds * (w[X + i] - kept[MATTE_X + i])
        w[Y + i] = kept[MATTE_Y + i] + holds * (w[Y + i] - kept[MATTE_Y + i])
        w[Z + i] = kept[MATTE_Z + i] + holds * (w[Z + i] - kept[MATTE_Z + i])


@FUSED.called
def weigh_reflecting(room: Room, lights: int, weights: Weights, share: np.float32, n: int) -> None:
    """SCALE and the weighted normal equations under the model as far as it holds; the samples ``values`` are left
    without what the model adds, for the albedo."""
    w, v, e, matte, gradient = room.planes, room.more, room.errors, room.matte, _gradient(room)
    fill_gradient(room, lights, weights, n)
    find_scale(gradient, weights.least, share, w, v, matte, e, n)
    add_weighted(gradient, False, TWO, True, w, v, matte, e, n)
    take_off(room, lights, weights, n)


@FUSED.inlined
def _gradient(room: Room) -> Floats:
    """What ``fill_gradient`` leaves of every light: (light, 4, pixel)."""
    return room.kept[BLOCK * KEPT :].reshape(len(room.ways), OF_LIGHT, BLOCK)


@FUSED.called
def _add_up(kept: Floats, plane: int, e: Floats, n: int) -> None:
    """Add up residuals, each as a share of one: a measurement that is far off counts as one, however far."""
    kept[plane : plane + n] = ZERO
    for light in range(len(e)):
        for i in range(n):
            error = e[light, i]
            share = error * kept[SPREAD + i]
            square = share * share
            kept[plane + i] += square / (ONE + square) if error < OUT else ZERO


@FUSED.inlined
def _shorten(kept: Floats, w: Floats, n: int) -> None:
    """No step is longer than a share of g."""
    for i in range(n):
        a, b, c = kept[OLD_X + i], kept[OLD_Y + i], kept[OLD_Z + i]
        x, y, z = w[X + i] - a, w[Y + i] - b, w[Z + i] - c
        far, size = np.sqrt(x * x + y * y + z * z), np.sqrt(a * a + b * b + c * c)
        share = min(FARTHEST * size / max(far, TINY), ONE)
        w[X + i], w[Y + i], w[Z + i] = a + share * x, b + share * y, c + share * z
