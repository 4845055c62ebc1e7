"""Compiled part of all solvers: what lights send to every pixel of a block; near ones are placed as it is solved.

A near light at P sends ``intensity * max(0, cos)^mu / r^2`` to a point X at the distance r, from the direction
(P - X) / r; cos is taken from the light's axis (Y. Queau et al., "LED-based photometric stereo: modeling, calibration
and numerical solution", Journal of Mathematical Imaging and Vision 60, 2018, section 2).
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import types
from numba.extending import overload

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import lent
from psvideo.compute.parts import INLINED
from psvideo.model.arrays import Floats
from psvideo.model.irradiance import near_light
from psvideo.solve.normals.loops.blocks import ONE, X, Y, Z
from psvideo.solve.normals.task import Near, Task

LEAST_COSINE = np.float32(near_light.LEAST_COSINE)


@FUSED.inlined
def _place_one(matrix: Floats, per_strength: Floats, near: Near, light: int, row: int, col: int, n: int) -> None:
    """Fill one near light's planes."""
    (px, py, pz), (ax, ay, az) = near.positions[light], near.axes[light]
    across, down, middle_col, middle_row = near.pinhole
    strength, mu = near.strengths[light], near.anisotropy[light]
    x_plane, y_plane, z_plane, per = matrix[light, 0], matrix[light, 1], matrix[light, 2], per_strength[light]
    depth = near.depth[row]
    slope_y = -(np.float32(row) - middle_row) * down
    for i in range(n):
        away = depth[col + i]
        x = px - away * (np.float32(col + i) - middle_col) * across
        y = py - away * slope_y
        z = pz + away
        inverse = ONE / np.sqrt(x * x + y * y + z * z)
        x, y, z = x * inverse, y * inverse, z * inverse
        cosine = max(-(x * ax + y * ay + z * az), LEAST_COSINE)
        sent = strength * inverse * inverse * (cosine if mu == ONE else ONE)
        x_plane[i], y_plane[i], z_plane[i], per[i] = sent * x, sent * y, sent * z, cosine
    if mu != ONE and mu > np.float32(0):
        for i in range(n):
            factor = per[i] ** mu
            x_plane[i], y_plane[i], z_plane[i] = x_plane[i] * factor, y_plane[i] * factor, z_plane[i] * factor
    for i in range(n):
        per[i] = ONE / np.sqrt(x_plane[i] ** 2 + y_plane[i] ** 2 + z_plane[i] ** 2)


@FUSED.inlined
def _place_all(matrix: Floats, per_strength: Floats, near: Near, row: int, col: int, n: int) -> None:
    """Fill the planes of all lights; a distant one sends the same everywhere, and a copy nothing."""
    for light in range(len(near.strengths)):
        strength = near.strengths[light]
        if strength > np.float32(0) and near.is_near[light]:
            _place_one(matrix, per_strength, near, light, row, col, n)
        else:
            for axis in range(3):
                matrix[light, axis, :n] = near.positions[light, axis] * strength
            per_strength[light, :n] = ONE / strength if strength > np.float32(0) else ONE


@FUSED.inlined
def lent_task(task: Task, matrix: Floats, per_strength: Floats) -> Task:
    """The task without reference counts, with the memory that takes every pixel's lights where they are near."""
    near = task.near
    return Task(
        lent(task.plates), lent(task.like), task.lights, task.cols, lent(task.tone), lent(matrix), lent(per_strength),
        lent(task.shares), lent(task.believed),
        Near(
            lent(near.positions), lent(near.is_near), lent(near.axes), lent(near.anisotropy), lent(near.strengths),
            lent(near.depth), lent(near.pinhole),
        ),
        lent(task.inverse), lent(task.origin), task.least, task.most, lent(task.noise), lent(task.dark),
        task.ratio, task.condition_squared, task.albedo_scale, lent(task.seen), lent(task.mask),
    )  # fmt: skip


def place_lights(matrix: Floats, per_strength: Floats, near: Near, row: int, col: int, n: int) -> None:
    """Fill matrix (light, 3, pixel) and per_strength (light, pixel) for n pixels of a row from ``col`` on.

    Nothing is done where all lights are distant: matrix (light, 3). Compiled only.
    """
    raise NotImplementedError


@overload(place_lights, jit_options=INLINED, strict=False)
def _place_lights(matrix: Any, per_strength: Any, near: Any, row: Any, col: Any, n: Any) -> Any:
    if matrix.ndim == 2:
        return lambda matrix, per_strength, near, row, col, n: None
    return lambda matrix, per_strength, near, row, col, n: _place_all(matrix, per_strength, near, row, col, n)


def at(numbers: Any, pixel: int) -> Any:
    """One pixel's value of what ``of_light`` returned, or of one light's 1 / strength. Compiled only."""
    raise NotImplementedError


@overload(at, jit_options=INLINED, strict=False)
def _at(numbers: Any, pixel: Any) -> Callable[[Any, int], Any]:
    if isinstance(numbers, types.Float) or (
        isinstance(numbers, types.UniTuple) and isinstance(numbers.dtype, types.Float)
    ):
        return lambda numbers, pixel: numbers
    if isinstance(numbers, types.UniTuple):
        return lambda numbers, pixel: (numbers[0][pixel], numbers[1][pixel], numbers[2][pixel])
    return lambda numbers, pixel: numbers[pixel]


@FUSED.inlined
def of_light(matrix: Any, light: int) -> Any:
    """One light's three numbers: the same for all pixels (matrix (light, 3)), or planes ((light, 3, pixel))."""
    return matrix[light, 0], matrix[light, 1], matrix[light, 2]


@FUSED.inlined
def shown(lamp: Any, w: Floats, pixel: int) -> Any:
    """What a pixel's g, or normal, in the planes X, Y, Z shows under what ``of_light`` returned."""
    x, y, z = at(lamp, pixel)
    return x * w[X + pixel] + y * w[Y + pixel] + z * w[Z + pixel]
