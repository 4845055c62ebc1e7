"""What moving an edge would change, compiled: the normal equations of the times that the row model leaves free.

The derivatives of the model (``row_model``) are projected on what the brightnesses, which ``kernel`` fits, cannot
explain (Kaufman 1975). That gives the normal equations of a Gauss-Newton step in one pass.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.compiled import EXACT
from psvideo.compute.memory import lent
from psvideo.model.arrays import Doubles
from psvideo.sync.rowfit.given_off import given_off
from psvideo.sync.rowfit.kernel import fit_window, solve_factored
from psvideo.sync.rowfit.row_model import Flashes, Rows, lent_flashes, lent_rows, see, width
from psvideo.sync.rowfit.row_slopes import BLUR, LEFT, RIGHT, RISE, SIGNALS, slopes
from psvideo.sync.rowfit.unknowns.whitening import factors, whiten, whiten_all

MOST_LEVERAGE = 0.9
"""A sample that its brightness fits all by itself says nothing of errors; its residual is not blown up without end."""


class _Room(NamedTuple):
    """Arrays that one call works in."""

    design: Doubles
    first_flash: NDArray[np.int64]
    normal: Doubles
    right: Doubles
    signals: Doubles
    cross: Doubles
    solved: Doubles
    diagonal: Doubles
    below: Doubles


@EXACT.called
def leverage(normal: Doubles, design: Doubles, weight: float, size: int, solved: Doubles) -> float:
    """Return which share of a sample's own error the brightnesses that are fitted to it take up."""
    taken = 0.0
    solved[:] = design
    for i in range(size - 1, -1, -1):
        solved[i] /= normal[i, i]
        taken += solved[i] ** 2
        if solved[i] != 0.0:
            for m in range(i):
                solved[m] -= normal[i, m] * solved[i]
    return min(weight * taken, MOST_LEVERAGE)


@EXACT.inlined
def _fill_signals(
    rows: Rows,
    flashes: Flashes,
    row: int,
    window: int,
    first_flash: NDArray[np.int64],
    right: Doubles,
    tails: bool,
    signals: Doubles,
) -> None:
    """Fill the window's ``signals`` (frame, SIGNALS): how a row's samples change with each time that may be free."""
    span_s = rows.ends_s[window + 1] - rows.ends_s[window]
    for n in range(rows.bounds[window], rows.bounds[window + 1]):
        shift = slopes(rows, flashes, n, row, first_flash[n], right, tails, signals[n])
        along = (rows.frame_start_s[n] + rows.row_place[row] * rows.row_time_s - rows.ends_s[window]) / span_s
        signals[n, LEFT] = shift * (1.0 - along)
        signals[n, RIGHT] = shift * along


@EXACT.inlined
def _project(
    design: Doubles,
    weight: Doubles,
    first: int,
    last: int,
    normal: Doubles,
    used: int,
    cross: Doubles,
    signals: Doubles,
) -> None:
    """Leave of the first ``used`` signals of some frames what other brightnesses could not bring about as well."""
    size = design.shape[1]
    cross[:] = 0.0
    for n in range(first, last):
        for i in range(size):
            if design[n, i] != 0.0:
                for p in range(used):
                    cross[p, i] += weight[n] * design[n, i] * signals[n, p]
    for p in range(used):
        solve_factored(normal, cross[p], size)
    for n in range(first, last):
        for i in range(size):
            if design[n, i] != 0.0:
                for p in range(used):
                    signals[n, p] -= design[n, i] * cross[p, i]


@EXACT.kept
def equations(
    rows: Rows,
    flashes: Flashes,
    weight: Doubles,
    steepness: Doubles,
    tails: bool,
    honest: bool,
    first: int,
    last: int,
    rest: Doubles,
    hessian: Doubles,
    score: Doubles,
    place: NDArray[np.int64],
    at_place: Doubles,
) -> None:
    """Fill ``rest``; add the rows' normal matrices to ``hessian`` (window, SIGNALS, SIGNALS), and their ``weight *
    signal * rest`` to ``score`` (frame, SIGNALS), which keeps the frames apart. Unless ``at_place`` (window, place,
    SIGNALS) is empty, they are added to it too; it keeps windows and each sample's ``place`` (frame, row) apart.

    The normal matrices hold ``steepness`` (frame, row): how fast a residual's pull grows with it, which is its weight
    but in robust fits. Where ``honest``, residuals count in the scores as large as if no brightness had been fitted to
    them (MacKinnon and White 1985, HC2).
    """
    frames, size = len(rows.value), width(rows, flashes)
    own = _Room(
        np.empty((frames, size)), np.empty(frames, np.int64), np.empty((size, size)), np.empty(size),
        np.empty((frames, SIGNALS)), np.empty((SIGNALS, size)), np.empty(size), np.empty(frames), np.empty(frames),
    )  # fmt: skip
    _add_rows(rows, flashes, weight, steepness, tails, honest, first, last, rest, hessian, score, place, at_place, own)


@EXACT.called
def _add_rows(
    rows: Rows,
    flashes: Flashes,
    weight: Doubles,
    steepness: Doubles,
    tails: bool,
    honest: bool,
    first: int,
    last: int,
    rest: Doubles,
    hessian: Doubles,
    score: Doubles,
    place: NDArray[np.int64],
    at_place: Doubles,
    room: _Room,
) -> None:
    """Do what ``equations`` does, with its arrays lent: their references would be counted for every sample."""
    rows, flashes = lent_rows(rows), lent_flashes(flashes)
    weight, steepness, rest, place = lent(weight), lent(steepness), lent(rest), lent(place)
    hessian, score, at_place = lent(hessian), lent(score), lent(at_place)
    design, first_flash, normal, right = lent(room.design), lent(room.first_flash), lent(room.normal), lent(room.right)
    signals, cross, solved = lent(room.signals), lent(room.cross), lent(room.solved)
    diagonal, below = lent(room.diagonal), lent(room.below)
    frames, size = design.shape
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
            fit_window(value, weight[:, row], design, begin, end, normal, right)
            _fill_signals(rows, flashes, row, window, first_flash, right, tails, signals)
            if rows.restless[row] > 0.0:
                whiten_all(signals, diagonal, below, begin, end)
            _project(design, weight[:, row], begin, end, normal, used, cross, signals)
            for n in range(begin, end):
                explained = 0.0
                for i in range(size):
                    if design[n, i] != 0.0:
                        explained += design[n, i] * right[i]
                rest[n, row] = value[n] - explained
                error = rest[n, row]
                if honest:
                    error /= np.sqrt(1.0 - leverage(normal, design[n], weight[n, row], size, solved))
                for p in range(used):
                    pull = weight[n, row] * signals[n, p]
                    score[n, p] += pull * error
                    if at_place.shape[1] > 0:
                        at_place[window, place[n, row], p] += pull * error
                    for q in range(p + 1):
                        hessian[window, p, q] += steepness[n, row] * signals[n, p] * signals[n, q]


@EXACT.kept
def edges(rows: Rows, flashes: Flashes, weight: Doubles, first: int, last: int, pull: Doubles, stiff: Doubles) -> None:
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
            fit_window(rows.value[:, row], weight[:, row], design, begin, end, normal, right)
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
                        rise_s, fall_s, blur_s, row_s = flashes.rise_s, flashes.fall_s, flashes.blur_s, flashes.row_s
                        _, opening = given_off(since_s, d, rise_s, fall_s, blur_s, row_s)
                        _, closing = given_off(since_s + rows.exposure_s, d, rise_s, fall_s, blur_s, row_s)
                        pull[j, 0] += weight[n, row] * light * opening * rest
                        pull[j, 1] -= weight[n, row] * light * closing * rest
                        stiff[j, 0] += weight[n, row] * (light * opening) ** 2
                        stiff[j, 1] += weight[n, row] * (light * closing) ** 2
