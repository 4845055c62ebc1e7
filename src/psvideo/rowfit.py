"""How well a guess of the flashes' times explains the row profiles of a clip.

For one row the model is linear: ``profile[n] = ambient + sum_k weight[k, n] * brightness[slot of k]``. The brightnesses
are eliminated row by row with least squares (variable projection: Golub and Pereyra 1973), so that only the flashes'
times remain to be searched. A subject that moves changes its brightnesses: they are fitted anew in every window of
frames, while the times are common to all. The weights here are the trapezoid of ``shutter.row_weights``, evaluated
without building the (flash, frame, row) array; a test holds the two together.
"""

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numba as nb
import numpy as np
from numpy.typing import NDArray

from psvideo.camera import FloatArray

IntArray = NDArray[np.int64]

THREADS = min(os.cpu_count() or 1, 8)
WORTH_THREADS = 40_000
"""Samples from which on starting threads costs less than it saves."""
RIDGE = 1e-6
"""Share of the normal matrix's diagonal that is added to it, so that a brightness nobody saw stays at zero."""


@dataclass(frozen=True, kw_only=True)
class Profiles:
    """Row profiles of a clip: ``value`` (frame, row), when each row of frame 0 opens, and where the windows begin."""

    value: FloatArray
    frame_start_s: FloatArray
    row_offset_s: FloatArray
    exposure_s: float
    window_start: IntArray

    def take(self, frames: slice) -> "Profiles":
        """Return some consecutive frames of the profiles, with the windows that lie in them."""
        count = len(range(*frames.indices(len(self.value))))
        starts = self.window_start - (frames.start or 0)
        inside = starts[(starts > 0) & (starts < count)]
        return Profiles(
            value=self.value[frames],
            frame_start_s=self.frame_start_s[frames],
            row_offset_s=self.row_offset_s,
            exposure_s=self.exposure_s,
            window_start=np.concatenate([[0], inside]).astype(np.int64),
        )


def residuals(
    profiles: Profiles, start_s: FloatArray, duration_s: FloatArray, unknown: IntArray, weight: FloatArray
) -> FloatArray:
    """Return what a train of flashes leaves unexplained, shape (frame, row).

    ``unknown`` is the number (from 1) of each flash's brightness, 0 for a dark slot. ``weight`` (frame, row) is the
    trust in each sample while brightnesses are fitted; the residuals themselves come unweighted.
    """
    unknowns = int(unknown.max(initial=0)) + 1
    bounds = np.append(profiles.window_start, len(profiles.value))
    rest = np.empty_like(profiles.value)

    def fit(first: int, last: int) -> None:
        _residuals(
            profiles.value,
            profiles.frame_start_s,
            profiles.row_offset_s,
            profiles.exposure_s,
            bounds,
            start_s,
            duration_s,
            unknown,
            unknowns,
            weight,
            first,
            last,
            rest,
        )

    rows = profiles.value.shape[1]
    if profiles.value.size < WORTH_THREADS:
        fit(0, rows)
    else:
        edges = np.linspace(0, rows, THREADS + 1).astype(int).tolist()
        with ThreadPoolExecutor(THREADS) as pool:
            list(pool.map(fit, edges[:-1], edges[1:]))
    return rest


@nb.njit(cache=True, nogil=True)
def _flash_weights(open_s, exposure_s, k, start_s, duration_s, unknown, design):  # type: ignore[no-untyped-def]
    """Fill ``design`` with what one row saw in one frame; return the first flash that may matter to the next frame."""
    design[:] = 0.0
    design[0] = 1.0
    close_s = open_s + exposure_s
    while k < len(start_s) and start_s[k] + duration_s[k] <= open_s:
        k += 1
    j = k
    while j < len(start_s) and start_s[j] < close_s:
        if unknown[j] > 0:
            overlap = min(close_s, start_s[j] + duration_s[j]) - max(open_s, start_s[j])
            if overlap > 0.0:
                design[unknown[j]] += overlap / duration_s[j]
        j += 1
    return k


@nb.njit(cache=True, nogil=True)
def _solve_spd(matrix, right, size):  # type: ignore[no-untyped-def]
    """Solve a small symmetric positive definite system in place (Cholesky); the answer stands in ``right``."""
    for i in range(size):
        matrix[i, i] += RIDGE * matrix[i, i] + 1e-30
        for j in range(i + 1):
            rest = matrix[i, j]
            for m in range(j):
                rest -= matrix[i, m] * matrix[j, m]
            matrix[i, j] = np.sqrt(max(rest, 1e-30)) if i == j else rest / matrix[j, j]
    for i in range(size):
        for m in range(i):
            right[i] -= matrix[i, m] * right[m]
        right[i] /= matrix[i, i]
    for i in range(size - 1, -1, -1):
        for m in range(i + 1, size):
            right[i] -= matrix[m, i] * right[m]
        right[i] /= matrix[i, i]


@nb.njit(cache=True, nogil=True)
def _residuals(  # type: ignore[no-untyped-def]
    value,
    frame_start_s,
    row_offset_s,
    exposure_s,
    bounds,
    start_s,
    duration_s,
    unknown,
    unknowns,
    weight,
    first,
    last,
    rest,
):
    """Fill rows ``first`` to ``last - 1`` of ``rest``; threads share the rows (numba's own may not be nested)."""
    frames = value.shape[0]
    design = np.empty((frames, unknowns))
    for row in range(first, last):
        k = 0
        for n in range(frames):
            open_s = frame_start_s[n] + row_offset_s[row]
            k = _flash_weights(open_s, exposure_s, k, start_s, duration_s, unknown, design[n])
        for window in range(len(bounds) - 1):
            normal = np.zeros((unknowns, unknowns))
            right = np.zeros(unknowns)
            for n in range(bounds[window], bounds[window + 1]):
                for i in range(unknowns):
                    scaled = weight[n, row] * design[n, i]
                    if scaled != 0.0:
                        right[i] += scaled * value[n, row]
                        for j in range(i + 1):
                            normal[i, j] += scaled * design[n, j]
            _solve_spd(normal, right, unknowns)
            for n in range(bounds[window], bounds[window + 1]):
                explained = 0.0
                for i in range(unknowns):
                    explained += design[n, i] * right[i]
                rest[n, row] = value[n, row] - explained
