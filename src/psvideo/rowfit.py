"""How well a guess of the flashes' times explains the row profiles of a clip.

For one row the model is linear: ``profile[n] = ambient + sum_k weight[k, n] * brightness[slot of k]``. The brightnesses
are eliminated row by row with least squares (variable projection: Golub and Pereyra 1973), so that only the flashes'
times remain to be searched. A subject that moves changes its brightnesses: they are fitted anew in every window of
frames, while the times are common to all. The weights here are the trapezoid of ``shutter.row_weights``, evaluated
without building the (flash, frame, row) array; a test holds the two together.
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import NamedTuple

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


class _Rows(NamedTuple):
    """Profiles as compiled code takes them."""

    value: FloatArray
    frame_start_s: FloatArray
    row_offset_s: FloatArray
    exposure_s: float
    bounds: IntArray


class _Flashes(NamedTuple):
    """A train of flashes as compiled code takes it; ``unknowns`` counts the ambient light too."""

    start_s: FloatArray
    duration_s: FloatArray
    unknown: IntArray
    unknowns: int


def _rows(profiles: Profiles) -> _Rows:
    bounds = np.append(profiles.window_start, len(profiles.value))
    return _Rows(profiles.value, profiles.frame_start_s, profiles.row_offset_s, profiles.exposure_s, bounds)


def residuals(
    profiles: Profiles, start_s: FloatArray, duration_s: FloatArray, unknown: IntArray, weight: FloatArray
) -> FloatArray:
    """Return what a train of flashes leaves unexplained, shape (frame, row).

    ``unknown`` is the number (from 1) of each flash's brightness, 0 for a dark slot. ``weight`` (frame, row) is the
    trust in each sample while brightnesses are fitted; the residuals themselves come unweighted.
    """
    rows = _rows(profiles)
    flashes = _Flashes(start_s, duration_s, unknown, int(unknown.max(initial=0)) + 1)
    rest = np.empty_like(profiles.value)
    _share(
        lambda first, last: _residuals(rows, flashes, weight, first, last, rest),
        profiles.value.shape[1],
        work=profiles.value.size,
    )
    return rest


def losses(
    profiles: Profiles,
    start_s: FloatArray,
    duration_s: FloatArray,
    unknown: IntArray,
    *,
    phase_s: FloatArray,
    rate: FloatArray,
    spread: FloatArray,
    steepness: float,
) -> FloatArray:
    """Return how badly each of many clocks explains the profiles, shape (clock,).

    The train is given in strobe seconds; clock c turns it into ``phase_s[c] + rate[c] * start_s``. The loss is the sum
    of ``log(1 + steepness * r^2)``, r being a residual over its row's ``spread`` (row,).
    """
    rows = _rows(profiles)
    flashes = _Flashes(start_s, duration_s, unknown, int(unknown.max(initial=0)) + 1)
    found = np.empty(len(phase_s))
    _share(
        lambda first, last: _losses(rows, flashes, phase_s, rate, spread, steepness, first, last, found),
        len(phase_s),
        work=len(phase_s) * profiles.value.size,
    )
    return found


def _share(run: Callable[[int, int], None], count: int, *, work: int) -> None:
    """Share ``count`` rows or clocks between threads (numba's own may not be nested), if that is worth the start."""
    if work < WORTH_THREADS:
        run(0, count)
        return
    edges = np.linspace(0, count, THREADS + 1).astype(int).tolist()
    with ThreadPoolExecutor(THREADS) as pool:
        list(pool.map(run, edges[:-1], edges[1:]))


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
def _row_residuals(rows, flashes, weight, row, design, rest):  # type: ignore[no-untyped-def]
    """Fill ``rest`` (frame,) with what one row's own brightnesses, fitted window by window, leave unexplained."""
    unknowns = flashes.unknowns
    k = 0
    for n in range(len(rows.value)):
        open_s = rows.frame_start_s[n] + rows.row_offset_s[row]
        k = _flash_weights(open_s, rows.exposure_s, k, flashes.start_s, flashes.duration_s, flashes.unknown, design[n])
    for window in range(len(rows.bounds) - 1):
        normal = np.zeros((unknowns, unknowns))
        right = np.zeros(unknowns)
        for n in range(rows.bounds[window], rows.bounds[window + 1]):
            for i in range(unknowns):
                scaled = weight[n, row] * design[n, i]
                if scaled != 0.0:
                    right[i] += scaled * rows.value[n, row]
                    for j in range(i + 1):
                        normal[i, j] += scaled * design[n, j]
        _solve_spd(normal, right, unknowns)
        for n in range(rows.bounds[window], rows.bounds[window + 1]):
            explained = 0.0
            for i in range(unknowns):
                explained += design[n, i] * right[i]
            rest[n] = rows.value[n, row] - explained


@nb.njit(cache=True, nogil=True)
def _residuals(rows, flashes, weight, first, last, rest):  # type: ignore[no-untyped-def]
    design = np.empty((len(rows.value), flashes.unknowns))
    for row in range(first, last):
        _row_residuals(rows, flashes, weight, row, design, rest[:, row])


@nb.njit(cache=True, nogil=True)
def _losses(rows, flashes, phase_s, rate, spread, steepness, first, last, found):  # type: ignore[no-untyped-def]
    frames, height = rows.value.shape
    design = np.empty((frames, flashes.unknowns))
    rest = np.empty(frames)
    weight = np.ones((frames, height))
    for clock in range(first, last):
        start_s = phase_s[clock] + rate[clock] * flashes.start_s
        moved = _Flashes(start_s, rate[clock] * flashes.duration_s, flashes.unknown, flashes.unknowns)
        total = 0.0
        for row in range(height):
            _row_residuals(rows, moved, weight, row, design, rest)
            for n in range(frames):
                total += np.log1p(steepness * (rest[n] / spread[row]) ** 2)
        found[clock] = total
