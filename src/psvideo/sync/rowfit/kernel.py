"""Fitting the row model, compiled: the brightnesses that fit best, and what they leave unexplained.

The brightnesses of every row in every window of frames are eliminated with least squares (variable projection: Golub
and Pereyra 1973). What remains are times; ``projection`` says which way they are to move.
"""

import numpy as np

from psvideo.compute.compiled import EXACT
from psvideo.model.arrays import Doubles
from psvideo.sync.rowfit.row_model import Flashes, Rows, see_all, width
from psvideo.sync.rowfit.unknowns.whitening import factors, whiten, whiten_all

RIDGE = 1e-6
"""Share of the normal matrix's diagonal that is added to it, so that a brightness nobody saw stays at zero."""


@EXACT.kept
def factor(matrix: Doubles, size: int) -> None:
    """Replace the lower half of a symmetric positive definite matrix by the lower factor L of ``L' L``.

    The last unknown is eliminated first, and the light of the room, which every sample holds, at the end: flashes share
    samples with their neighbours in the cycle alone, so that hardly any zero is filled (George and Liu 1981).
    """
    for i in range(size):
        matrix[i, i] += RIDGE * matrix[i, i] + 1e-30
    for i in range(size - 1, -1, -1):
        matrix[i, i] = np.sqrt(max(matrix[i, i], 1e-30))
        for j in range(i):
            if matrix[i, j] != 0.0:
                matrix[i, j] /= matrix[i, i]
        for j in range(i):
            if matrix[i, j] != 0.0:
                for m in range(j + 1):
                    matrix[j, m] -= matrix[i, j] * matrix[i, m]


@EXACT.kept
def solve_factored(matrix: Doubles, right: Doubles, size: int) -> None:
    """Solve with the factor; the answer stands in ``right``."""
    for i in range(size - 1, -1, -1):
        right[i] /= matrix[i, i]
        if right[i] != 0.0:
            for m in range(i):
                right[m] -= matrix[i, m] * right[i]
    for i in range(size):
        for m in range(i):
            if matrix[i, m] != 0.0:
                right[i] -= matrix[i, m] * right[m]
        right[i] /= matrix[i, i]


@EXACT.kept
def fit_window(
    value: Doubles,
    weight: Doubles,
    design: Doubles,
    first: int,
    last: int,
    normal: Doubles,
    right: Doubles,
) -> None:
    """Fit one row's brightnesses over some frames: ``normal`` ends as ``factor`` leaves it, ``right`` as the answer."""
    size = design.shape[1]
    normal[:] = 0.0
    right[:] = 0.0
    for n in range(first, last):
        for i in range(size):
            scaled = weight[n] * design[n, i]
            if scaled != 0.0:
                right[i] += scaled * value[n]
                for j in range(i + 1):
                    normal[i, j] += scaled * design[n, j]
    factor(normal, size)
    solve_factored(normal, right, size)


@EXACT.kept
def row_rest(rows: Rows, flashes: Flashes, weight: Doubles, row: int, design: Doubles, rest: Doubles) -> None:
    """Fill ``rest`` (frame,) with what one row's own brightnesses, fitted window by window, leave unexplained."""
    frames, size = design.shape
    normal, right = np.empty((size, size)), np.empty(size)
    see_all(rows, flashes, row, design)
    value = rows.value[:, row].copy()
    if rows.restless[row] > 0.0:
        diagonal, below = np.empty(frames), np.empty(frames)
        factors(rows, flashes, row, diagonal, below)
        whiten(value, diagonal, below)
        whiten_all(design, diagonal, below, 0, frames)
    for window in range(len(rows.bounds) - 1):
        first, last = rows.bounds[window], rows.bounds[window + 1]
        fit_window(value, weight[:, row], design, first, last, normal, right)
        for n in range(first, last):
            explained = 0.0
            for i in range(size):
                explained += design[n, i] * right[i]
            rest[n] = value[n] - explained


@EXACT.kept
def rests(rows: Rows, flashes: Flashes, weight: Doubles, first: int, last: int, rest: Doubles) -> None:
    """Fill the columns ``first`` to ``last`` of ``rest`` (frame, row)."""
    design = np.empty((len(rows.value), width(rows, flashes)))
    for row in range(first, last):
        row_rest(rows, flashes, weight, row, design, rest[:, row])


@EXACT.kept
def brightnesses(rows: Rows, flashes: Flashes, weight: Doubles, first: int, last: int, found: Doubles) -> None:
    """Fill ``found`` (row, unknown) with the brightnesses fitted over all frames as one window."""
    size = flashes.unknowns + 2 * len(rows.beat_hz)
    design = np.empty((len(rows.value), size))
    normal = np.empty((size, size))
    for row in range(first, last):
        see_all(rows, flashes, row, design)
        fit_window(rows.value[:, row], weight[:, row], design, 0, len(rows.value), normal, found[row])
