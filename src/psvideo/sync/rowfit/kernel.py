"""Fitting the row model, compiled: the brightnesses that fit best, and what moving an edge would change.

The brightnesses of every row in every window of frames are eliminated with least squares (variable projection: Golub
and Pereyra 1973). For the times that remain, the derivatives of the model (``row_model``) are projected on what the
brightnesses cannot explain (Kaufman 1975), which gives the normal equations of a Gauss-Newton step in one pass.
"""

import numpy as np

from psvideo.compute.compiled import EXACT
from psvideo.model.camera import FloatArray
from psvideo.sync.rowfit.row_model import (
    BLUR,
    LEFT,
    RIGHT,
    RISE,
    SIGNALS,
    Flashes,
    Rows,
    given_off,
    see,
    see_all,
    slopes,
    width,
)
from psvideo.sync.rowfit.unknowns.whitening import factors, whiten, whiten_all

RIDGE = 1e-6
"""Share of the normal matrix's diagonal that is added to it, so that a brightness nobody saw stays at zero."""
MOST_LEVERAGE = 0.9
"""A sample that its brightness fits all by itself says nothing of errors; its residual is not blown up without end."""


@EXACT.kept
def factor(matrix: FloatArray, size: int) -> None:
    """Replace the lower half of a symmetric positive definite matrix by its Cholesky factor."""
    for i in range(size):
        matrix[i, i] += RIDGE * matrix[i, i] + 1e-30
        for j in range(i + 1):
            rest = matrix[i, j]
            for m in range(j):
                rest -= matrix[i, m] * matrix[j, m]
            matrix[i, j] = np.sqrt(max(rest, 1e-30)) if i == j else rest / matrix[j, j]


@EXACT.kept
def solve_factored(matrix: FloatArray, right: FloatArray, size: int) -> None:
    """Solve with a Cholesky factor; the answer stands in ``right``."""
    for i in range(size):
        for m in range(i):
            right[i] -= matrix[i, m] * right[m]
        right[i] /= matrix[i, i]
    for i in range(size - 1, -1, -1):
        for m in range(i + 1, size):
            right[i] -= matrix[m, i] * right[m]
        right[i] /= matrix[i, i]


@EXACT.kept
def _fit_window(
    value: FloatArray,
    weight: FloatArray,
    design: FloatArray,
    first: int,
    last: int,
    normal: FloatArray,
    right: FloatArray,
) -> None:
    """Fit one row's brightnesses over some frames: ``normal`` ends as a Cholesky factor, ``right`` as the answer."""
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
def row_rest(rows: Rows, flashes: Flashes, weight: FloatArray, row: int, design: FloatArray, rest: FloatArray) -> None:
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
        _fit_window(value, weight[:, row], design, first, last, normal, right)
        for n in range(first, last):
            explained = 0.0
            for i in range(size):
                explained += design[n, i] * right[i]
            rest[n] = value[n] - explained


@EXACT.kept
def rests(rows: Rows, flashes: Flashes, weight: FloatArray, first: int, last: int, rest: FloatArray) -> None:
    """Fill the columns ``first`` to ``last`` of ``rest`` (frame, row)."""
    design = np.empty((len(rows.value), width(rows, flashes)))
    for row in range(first, last):
        row_rest(rows, flashes, weight, row, design, rest[:, row])


@EXACT.kept
def leverage(normal: FloatArray, design: FloatArray, weight: float, size: int, solved: FloatArray) -> float:
    """Return which share of a sample's own error the brightnesses that are fitted to it take up."""
    taken = 0.0
    for i in range(size):
        left = design[i]
        for m in range(i):
            left -= normal[i, m] * solved[m]
        solved[i] = left / normal[i, i]
        taken += solved[i] ** 2
    return min(weight * taken, MOST_LEVERAGE)


@EXACT.kept
def equations(
    rows: Rows,
    flashes: Flashes,
    weight: FloatArray,
    steepness: FloatArray,
    tails: bool,
    honest: bool,
    first: int,
    last: int,
    rest: FloatArray,
    hessian: FloatArray,
    score: FloatArray,
) -> None:
    """Fill ``rest``; add the rows' normal matrices to ``hessian`` (window, SIGNALS, SIGNALS), their ``weight * signal *
    rest`` to ``score`` (frame, SIGNALS), which keeps the frames apart. The normal matrices hold ``steepness`` (frame,
    row): how fast a residual's pull grows with it, which is its weight but in robust fits. Where ``honest``, residuals
    count in the scores as large as if no brightness had been fitted to them (MacKinnon and White 1985, HC2)."""
    frames = len(rows.value)
    size = width(rows, flashes)
    design = np.empty((frames, size))
    first_flash = np.empty(frames, np.int64)
    normal, right = np.empty((size, size)), np.empty(size)
    signals = np.empty((frames, SIGNALS))
    cross = np.empty((SIGNALS, size))
    solved = np.empty(size)
    diagonal, below = np.empty(frames), np.empty(frames)
    used = SIGNALS if tails and flashes.blur_s > 0.0 else BLUR if tails else RISE  # the others are 0 everywhere
    for row in range(first, last):
        k = 0
        for n in range(frames):
            k = see(rows, flashes, n, row, k, design[n])
            first_flash[n] = k
        value = rows.value[:, row].copy()
        if rows.restless[row] > 0.0:
            factors(rows, flashes, row, diagonal, below)
            whiten(value, diagonal, below)
            whiten_all(design, diagonal, below, 0, frames)
        for window in range(len(rows.bounds) - 1):
            begin, end = rows.bounds[window], rows.bounds[window + 1]
            _fit_window(value, weight[:, row], design, begin, end, normal, right)
            cross[:] = 0.0
            span_s = rows.ends_s[window + 1] - rows.ends_s[window]
            for n in range(begin, end):
                shift = slopes(rows, flashes, n, row, first_flash[n], right, tails, signals[n])
                along = (rows.frame_start_s[n] + rows.row_place[row] * rows.row_time_s - rows.ends_s[window]) / span_s
                signals[n, LEFT] = shift * (1.0 - along)
                signals[n, RIGHT] = shift * along
            if rows.restless[row] > 0.0:
                whiten_all(signals, diagonal, below, begin, end)
            for n in range(begin, end):
                for i in range(size):
                    if design[n, i] != 0.0:
                        for p in range(used):
                            cross[p, i] += weight[n, row] * design[n, i] * signals[n, p]
            for p in range(used):
                solve_factored(normal, cross[p], size)
            for n in range(begin, end):
                explained = 0.0
                for i in range(size):
                    if design[n, i] != 0.0:
                        explained += design[n, i] * right[i]
                        for p in range(used):
                            signals[n, p] -= design[n, i] * cross[p, i]
                rest[n, row] = value[n] - explained
                error = rest[n, row]
                if honest:
                    error /= np.sqrt(1.0 - leverage(normal, design[n], weight[n, row], size, solved))
                for p in range(used):
                    pull = weight[n, row] * signals[n, p]
                    score[n, p] += pull * error
                    for q in range(p + 1):
                        hessian[window, p, q] += steepness[n, row] * signals[n, p] * signals[n, q]


@EXACT.kept
def losses_by_row(
    rows: Rows,
    flashes: Flashes,
    phase_s: FloatArray,
    rate: FloatArray,
    spread: FloatArray,
    steepness: float,
    first: int,
    last: int,
    found: FloatArray,
) -> None:
    """Fill ``found`` (clock, row) with the robust loss of every clock in every row."""
    frames, height = rows.value.shape
    design = np.empty((frames, width(rows, flashes)))
    rest = np.empty(frames)
    weight = np.ones((frames, height))
    for clock in range(first, last):
        start_s = phase_s[clock] + rate[clock] * flashes.start_s
        moved = Flashes(
            start_s,
            rate[clock] * flashes.duration_s,
            flashes.unknown,
            flashes.unknowns,
            flashes.rise_s,
            flashes.fall_s,
            flashes.blur_s,
        )
        for row in range(height):
            row_rest(rows, moved, weight, row, design, rest)
            total = 0.0
            for n in range(frames):
                total += np.log1p(steepness * (rest[n] / spread[row]) ** 2)
            found[clock, row] = total


@EXACT.kept
def brightnesses(rows: Rows, flashes: Flashes, weight: FloatArray, first: int, last: int, found: FloatArray) -> None:
    """Fill ``found`` (row, unknown) with the brightnesses fitted over all frames as one window."""
    size = flashes.unknowns + 2 * len(rows.beat_hz)
    design = np.empty((len(rows.value), size))
    normal = np.empty((size, size))
    for row in range(first, last):
        see_all(rows, flashes, row, design)
        _fit_window(rows.value[:, row], weight[:, row], design, 0, len(rows.value), normal, found[row])


@EXACT.kept
def edges(
    rows: Rows, flashes: Flashes, weight: FloatArray, first: int, last: int, pull: FloatArray, stiff: FloatArray
) -> None:
    """Add to ``pull`` and ``stiff`` (flash, 2) how strongly rows that open (0) or close (1) during a flash shift it."""
    frames = len(rows.value)
    design = np.empty((frames, width(rows, flashes)))
    size = design.shape[1]
    first_flash = np.empty(frames, np.int64)
    normal, right = np.empty((size, size)), np.empty(size)
    for row in range(first, last):
        k = 0
        for n in range(frames):
            k = see(rows, flashes, n, row, k, design[n])
            first_flash[n] = k
        for window in range(len(rows.bounds) - 1):
            begin, end = rows.bounds[window], rows.bounds[window + 1]
            _fit_window(rows.value[:, row], weight[:, row], design, begin, end, normal, right)
            for n in range(begin, end):
                rest = rows.value[n, row]
                for i in range(size):
                    rest -= design[n, i] * right[i]
                open_s = rows.frame_start_s[n] + rows.row_place[row] * rows.row_time_s
                for j in range(first_flash[n], len(flashes.start_s)):
                    if flashes.start_s[j] >= open_s + rows.exposure_s:
                        break
                    u = flashes.unknown[j]
                    if u > 0:
                        light = right[u]
                        since_s, d = open_s - flashes.start_s[j], flashes.duration_s[j]
                        _, opening = given_off(since_s, d, flashes.rise_s, flashes.fall_s, flashes.blur_s)
                        _, closing = given_off(
                            since_s + rows.exposure_s, d, flashes.rise_s, flashes.fall_s, flashes.blur_s
                        )
                        pull[j, 0] += weight[n, row] * light * opening * rest
                        pull[j, 1] -= weight[n, row] * light * closing * rest
                        stiff[j, 0] += weight[n, row] * (light * opening) ** 2
                        stiff[j, 1] += weight[n, row] * (light * closing) ** 2
