"""How much farther noise spreads into a normal that fewer of a rig's lights reach: those on its own side remain."""

import functools

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Floats
from psvideo.solve.normals.task import PIXEL_CONDITION

FACED = 400
"""This many normals of a ball, evenly spread over its picture, say which lights remain."""
STEEPEST, GRAZING = 0.1, 0.1
"""The least cosine of these normals to the camera's axis, and of a light that counts."""
RIGS_AT_A_TIME = 4
"""Every round asks again of the same lights, and a program may solve several takes in turn."""


def widened(matrix: NDArray[np.float64], most: float) -> Floats:
    """Return by how much the square of a normal's error grows where this many lights reach it, (0 to all of them,).

    Of ``matrix`` (light, 3), intensities times directions. A surface that turns away from some lights leaves those on
    one side, which stand much nearer to a plane than all of them: three of five in a ring leave five times the variance
    where their number alone would say 5/3. It is no more than ``most``, and no less than with more lights.
    """
    return _widened(matrix.astype(np.float64).tobytes(), most)


@functools.lru_cache(maxsize=RIGS_AT_A_TIME)
def _widened(directions: bytes, most: float) -> Floats:
    matrix = np.frombuffer(directions).reshape(-1, 3)
    count = len(matrix)
    normals = _faced()
    lit = normals @ matrix.T > GRAZING * np.linalg.norm(matrix, axis=1)
    some = lit[lit.sum(axis=1) >= 3]
    facing = normals[lit.sum(axis=1) >= 3]
    squares = np.einsum("pl,li,lj->pij", some.astype(np.float64), matrix, matrix)
    values = np.linalg.eigvalsh(squares)
    sound = values[:, 2] < PIXEL_CONDITION**2 * values[:, 0]
    spread = _across(squares[sound], facing[sound])
    whole = _across((matrix.T @ matrix)[None], facing[sound])
    number, factor = some[sound].sum(axis=1), np.sqrt(spread / whole)
    by_count, least = np.ones(count + 1, np.float32), 1.0
    for lights in range(count - 1, -1, -1):
        here = factor[number == lights]
        least = max(least, float(here.mean()) ** 2 if here.size else count / max(lights, 1))
        by_count[lights] = min(least, most)
    by_count.flags.writeable = False  # it is every round's
    return by_count


def _faced() -> NDArray[np.float64]:
    """Return normals along a spiral over a ball's picture, (normal, 3)."""
    place = np.arange(FACED) + 0.5
    z, turn = np.sqrt(1 - place / FACED * (1 - STEEPEST**2)), np.pi * (1 + np.sqrt(5)) * place
    return np.stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z], axis=-1)


def _across(squares: NDArray[np.float64], normals: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return what of the covariance that normal equations (pixel or 1, 3, 3) leave lies across normals."""
    inverse = np.broadcast_to(np.linalg.inv(squares), (len(normals), 3, 3))
    along = np.einsum("pi,pij,pj->p", normals, inverse, normals)
    return np.asarray(np.trace(inverse, axis1=1, axis2=2) - along)
