"""Compiled part of both solvers: from g to the stored normal, every channel's albedo, and what is left over."""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import encoded
from psvideo.model.arrays import Bytes, Floats, Samples
from psvideo.solve.normals.loops.blocks import ABSENT, ALBEDO, COUNT, LEAST_Z, ONE, SUM, XX, XY, ZERO, X, Y, Z
from psvideo.solve.normals.loops.colour_kernel import albedo_from_sums
from psvideo.solve.normals.loops.near_kernel import of_light, shown
from psvideo.solve.normals.result import Result
from psvideo.solve.normals.task import Task


@FUSED.called
def store_block(
    task: Task, result: Result, w: Floats, values: Floats, m: Floats, weights: Floats, start: int, n: int,
    summed: bool, weighed: bool,
) -> None:  # fmt: skip
    """From g to what is stored; ``summed``: all measurements count, and three channels' sums are there.

    weights (light, pixel): by which measurements count for albedo where they are ``weighed``.
    """
    end = start + n
    x, y, z = result.normals[0, start:end], result.normals[1, start:end], result.normals[2, start:end]
    _store_normals(w, n, x, y, z, result.albedo[0, start:end], result.valid[start:end], task.albedo_scale)
    if result.residual.size:
        _store_residual(task, w, m, n, result.residual[start:end])
    for channel in range(task.tone.shape[1]):
        if summed:
            break
        if task.tone.shape[1] > 1:
            if weighed:
                _sum_up_weighed(task, w, values, m, weights, channel, n)
            else:
                _sum_up(task, w, values, m, channel, n)
            _albedo_given_normal(task, w, n, result.albedo[channel, start:end])
    if summed:
        red, green, blue = result.albedo[0, start:end], result.albedo[1, start:end], result.albedo[2, start:end]
        albedo_from_sums(task, w, n, red, green, blue)


@FUSED.inlined
def _store_normals(
    w: Floats, n: int, x: Samples, y: Samples, z: Samples, albedo: Samples, valid: Bytes, albedo_scale: np.float32
) -> None:
    """From g to the stored normal, albedo and validity, and to the planes X, Y, Z: all 0 where it faces away."""
    for i in range(n):
        gx, gy, gz = w[X + i], w[Y + i], w[Z + i]
        square = gx * gx + gy * gy + gz * gz
        length = np.sqrt(square)
        trusted = gz > LEAST_Z * length
        scale = ONE / length if trusted else ZERO
        size = square * scale if trusted else ZERO
        gx, gy, gz = gx * scale, gy * scale, gz * scale
        w[X + i], w[Y + i], w[Z + i], w[ALBEDO + i] = gx, gy, gz, size
        x[i] = encoded(gx, x)
        y[i] = encoded(gy, y)
        z[i] = encoded(gz, z)
        albedo[i] = encoded(size * albedo_scale, albedo)
        valid[i] = trusted


@FUSED.inlined
def _sum_up(task: Task, w: Floats, values: Floats, m: Floats, channel: int, n: int) -> None:
    """What one channel's least squares albedo is made of, over the usable measurements, the normal being known."""
    w[SUM : SUM + n], w[COUNT : COUNT + n] = ZERO, ZERO
    for light in range(task.lights):
        lamp = of_light(task.matrix, light)
        plane = values[light * task.tone.shape[1] + channel]
        for i in range(n):
            here = m[light, i] > ABSENT
            shade = shown(lamp, w, i)
            shade = shade if here else ZERO
            w[SUM + i] += shade * plane[i] if here else ZERO
            w[COUNT + i] += shade * shade


@FUSED.inlined
def _sum_up_weighed(task: Task, w: Floats, values: Floats, m: Floats, weights: Floats, channel: int, n: int) -> None:
    """As ``_sum_up``, each measurement weighted as it was for the normal: a highlight is not the surface's colour."""
    w[SUM : SUM + n], w[COUNT : COUNT + n] = ZERO, ZERO
    for light in range(task.lights):
        lamp = of_light(task.matrix, light)
        plane = values[light * task.tone.shape[1] + channel]
        for i in range(n):
            here = m[light, i] > ABSENT
            shade = shown(lamp, w, i)
            counted = shade * weights[light, i] if here else ZERO
            w[SUM + i] += counted * plane[i] if here else ZERO
            w[COUNT + i] += counted * shade


@FUSED.inlined
def _albedo_given_normal(task: Task, w: Floats, n: int, out: Samples) -> None:
    """One channel's albedo of what was summed up."""
    scale = task.albedo_scale
    for i in range(n):
        albedo = w[SUM + i] / w[COUNT + i] if w[COUNT + i] > ZERO else ZERO
        out[i] = encoded(max(albedo, ZERO) * scale, out)


@FUSED.inlined
def _store_residual(task: Task, w: Floats, m: Floats, n: int, out: Samples) -> None:
    """What g leaves of the measurements, channels combined: the root of the mean square over those that count."""
    channels = task.tone.shape[1]
    w[XX : XX + n], w[XY : XY + n] = ZERO, ZERO
    for light in range(task.lights):
        lamp, to_plate = of_light(task.matrix, light), ZERO
        for channel in range(channels):
            to_plate += task.tone[light, channel, 3] / np.float32(channels)
        for i in range(n):
            here = m[light, i] > ABSENT
            error = (m[light, i] - w[ALBEDO + i] * shown(lamp, w, i)) * to_plate
            w[XX + i] += error * error if here else ZERO
            w[XY + i] += ONE if here else ZERO
    for i in range(n):
        error = np.sqrt(w[XX + i] / max(w[XY + i], ONE))
        out[i] = encoded(error if w[ALBEDO + i] > ZERO else ZERO, out)
