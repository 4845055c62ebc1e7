"""The compiled row model run over profiles on all processors: the brightnesses that explain them, what these leave, and
the equations of the times."""

from typing import NamedTuple

import numpy as np

from psvideo.compute.threads import over_ranges
from psvideo.model.arrays import Doubles, Integers
from psvideo.model.plan import Plan
from psvideo.model.timing import Timing
from psvideo.sync.rowfit import kernel, projection, row_model
from psvideo.sync.rowfit.beat import Beat, train_between
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.row_slopes import SIGNALS

WORTH_A_THREAD = 40_000
"""Samples of one part of the work; with fewer, starting a thread costs more than it saves."""


def slot_unknowns(plan: Plan) -> Integers:
    """Return which brightness each slot shows: 1, 2, … for the lit slots, 0 for dark ones."""
    number = np.zeros(len(plan.flashes), np.int64)
    number[list(plan.lit_slots)] = np.arange(1, len(plan.lit_slots) + 1)
    return number


def compiled_rows(rows: Profiles, beat: Beat) -> row_model.Rows:
    """Return the profiles as compiled code takes them."""
    return row_model.Rows(
        np.ascontiguousarray(rows.value),  # as all others: loops read them without their references
        rows.frame_start_s,
        rows.place,
        beat.row_time_s,
        beat.exposure_s,
        np.append(rows.window_start, len(rows.value)),
        rows.ends_s,
        np.array(beat.beat_hz, np.float64),
        np.zeros(len(rows.place)) if rows.restless is None else rows.restless,
    )


def compiled_flashes(plan: Plan, rows: Profiles, beat: Beat) -> row_model.Flashes:
    """Return the flashes that the profiles may show as compiled code takes them."""
    start_s = rows.frame_start_s
    until_s = float(start_s[-1] + rows.place.max() * beat.row_time_s + beat.exposure_s)
    train = train_between(plan, beat.clock, float(start_s[0]), until_s)
    unknown = slot_unknowns(plan)
    return row_model.Flashes(
        train.start_s,
        train.duration_s,
        unknown[train.slot],
        int(unknown.max()) + 1,
        beat.rise_s,
        beat.fall_s,
        beat.blur_s,
        beat.row_time_s,
    )


def unexplained(plan: Plan, rows: Profiles, beat: Beat, weight: Doubles | None = None) -> Doubles:
    """Return the residuals (frame, row) that the best brightnesses leave; ``weight`` is the trust in each sample."""
    seen, flashes = compiled_rows(rows, beat), compiled_flashes(plan, rows, beat)
    trust = np.ones_like(rows.value) if weight is None else weight
    rest = np.empty_like(rows.value)
    over_ranges(
        lambda a, b: kernel.rests(seen, flashes, trust, a, b, rest),
        rows.value.shape[1],
        each=rows_of_a_part(len(rows.value)),
    )
    return rest


class TimeEquations(NamedTuple):
    """Residuals ``rest`` (frame, row), normal matrices ``windows`` (window, signal, signal), and scores, apart by
    ``frame`` (frame, signal) and by ``place`` in a flash (window, place, signal)."""

    rest: Doubles
    windows: Doubles
    frame: Doubles
    place: Doubles


def equations(
    plan: Plan,
    rows: Profiles,
    beat: Beat,
    weight: Doubles,
    *,
    tails: bool,
    steepness: Doubles | None = None,
) -> TimeEquations:
    """Return the normal equations of the times.

    With ``steepness`` (frame, row), how fast residuals' pulls grow with them, they are errors and not steps: it
    stands in the matrices for the weight, residuals count in the scores as if no brightness were fitted to them, and
    scores are kept apart by place too.
    """
    seen, flashes = compiled_rows(rows, beat), compiled_flashes(plan, rows, beat)
    honest, growth = steepness is not None, weight if steepness is None else steepness
    weight, growth = np.ascontiguousarray(weight), np.ascontiguousarray(growth)
    rest = np.empty_like(rows.value)
    place = np.zeros(rest.shape if honest else (0, 0), np.int64)
    if honest:
        row_model.places(seen, flashes, place)

    def run(first: int, last: int) -> tuple[Doubles, Doubles, Doubles]:
        hessian = np.zeros((len(rows.window_start), SIGNALS, SIGNALS))
        score = np.zeros((len(rows.value), SIGNALS))
        apart = np.zeros((len(rows.window_start), row_model.PLACES if honest else 0, SIGNALS))
        projection.equations(
            seen, flashes, weight, growth, tails, honest, first, last, rest, hessian, score, place, apart
        )
        return hessian, score, apart

    parts = over_ranges(run, rows.value.shape[1], each=rows_of_a_part(len(rows.value)))
    lower, score, apart = (np.sum(each, axis=0) for each in zip(*parts, strict=True))
    full = lower + np.swapaxes(np.tril(lower, -1), 1, 2)
    return TimeEquations(rest, full, score, apart)


def brightnesses(plan: Plan, rows: Profiles, beat: Beat, weight: Doubles | None = None) -> Doubles:
    """Return every row's brightnesses, fitted over all frames together, shape (row, unknown)."""
    seen, flashes = compiled_rows(rows, beat), compiled_flashes(plan, rows, beat)
    trust = np.ones_like(rows.value) if weight is None else weight
    found = np.zeros((rows.value.shape[1], flashes.unknowns + 2 * len(beat.beat_hz)))
    kernel.brightnesses(seen, flashes, trust, 0, rows.value.shape[1], found)
    return found


def predictions(plan: Plan, rows: Profiles, beat: Beat, brightness: Doubles) -> Doubles:
    """Return the profiles (frame, row) that known brightnesses (row, unknown) give at the times of ``rows``."""
    found = np.empty_like(rows.value)
    seen, flashes = compiled_rows(rows, beat), compiled_flashes(plan, rows, beat)
    row_model.predictions(seen, flashes, brightness, 0, rows.value.shape[1], found)
    return found


def residuals_of(plan: Plan, timing: Timing, index: Integers, value: Doubles) -> Doubles:
    """Return what a timing that was found leaves of profiles (frame, row), with brightnesses that hold throughout."""
    height = value.shape[1]
    upward = timing.row_time_s < 0
    place = np.arange(height, dtype=np.float64)
    rows = row_model.Rows(
        np.ascontiguousarray(value, np.float64),
        np.asarray(index, np.float64) * timing.frame_period_s,
        height - 1 - place if upward else place,
        abs(timing.row_time_s),
        timing.exposure_s,
        np.array([0, len(value)]),
        np.zeros(2),
        np.zeros(0),
        np.zeros(height),
    )
    unknown = slot_unknowns(plan)
    slots = [flash.slot for flash in timing.flashes]
    flashes = row_model.Flashes(
        timing.start_s.copy(),
        timing.duration_s.copy(),
        unknown[slots],
        int(unknown.max()) + 1,
        timing.rise_s,
        timing.fall_s,
    )
    rest = np.empty(value.shape)
    kernel.rests(rows, flashes, np.ones(value.shape), 0, height, rest)
    return rest


def rows_of_a_part(samples: int) -> int:
    """Return how many rows or clocks of this many samples each one thread takes at a time."""
    return -(-WORTH_A_THREAD // samples)
