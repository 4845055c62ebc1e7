"""Row profiles laid out for fitting, and the compiled row model run over them on all processors."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.threads import over_ranges
from psvideo.model.arrays import Doubles, Integers
from psvideo.model.plan import Plan
from psvideo.model.timing import Timing
from psvideo.sync.rowfit import kernel, projection, row_model
from psvideo.sync.rowfit.beat import Beat, train_between

WORTH_A_THREAD = 40_000
"""Samples of one part of the work; with fewer, starting a thread costs more than it saves."""

HIDDEN = 0.01
"""Clipped pixels that may hide this share of what a row changes by halve what its sample counts for."""


@dataclass(frozen=True, kw_only=True)
class Profiles:
    """Row profiles of a clip: ``value`` (frame, row) in the order in which rows open, ``index`` (frame,) in time.

    ``place`` (row,) counts sensor rows from the one that opens first; ``window_start`` (window,) are the frames at
    which windows begin, in each of which a row has brightnesses of its own. ``doubt`` (frame, row) is by how much a
    value may be wrong beyond noise, as where pixels saturate. ``restless`` (row,) is by how much the flashes of a light
    differ in each row, as variance over the noise's; none: all are alike.
    """

    value: Doubles
    index: Integers
    period_s: float
    place: Doubles
    window_start: Integers
    doubt: Doubles | None = None
    restless: Doubles | None = None

    @property
    def frame_start_s(self) -> Doubles:
        """When each frame's first row opens, shape (frame,)."""
        start_s: Doubles = np.asarray(self.index, np.float64) * self.period_s
        return start_s

    def take(self, frames: slice) -> "Profiles":
        """Return some consecutive frames, with the windows that lie in them."""
        count = len(range(*frames.indices(len(self.value))))
        starts = self.window_start - (frames.start or 0)
        inside = starts[(starts > 0) & (starts < count)]
        return replace(
            self,
            value=self.value[frames],
            index=self.index[frames],
            window_start=np.concatenate([[0], inside]).astype(np.int64),
            doubt=None if self.doubt is None else self.doubt[frames],
        )

    def only_rows(self, rows: slice | NDArray[np.bool_]) -> "Profiles":
        """Return some of the rows of all frames."""
        return replace(
            self,
            value=np.ascontiguousarray(self.value[:, rows]),
            place=np.ascontiguousarray(self.place[rows]),  # else loops were compiled for it once more
            doubt=None if self.doubt is None else self.doubt[:, rows],
            restless=None if self.restless is None else np.ascontiguousarray(self.restless[rows]),
        )

    def one_window(self) -> "Profiles":
        """Return the same profiles with brightnesses that hold for all frames."""
        return replace(self, window_start=np.zeros(1, np.int64))

    def windowed(self, frames_each: int) -> "Profiles":
        """Return the same profiles in windows of about this many frames.

        Where more are missing, a window ends, and the frame before is one by itself: the clock may bend there. Of 50
        frames in windows of 25, with 40 missing behind the 31st::

            place in time   0 ... 24 | 25 ... 29 | 30 | 71 ... 89
            window               0         1        2       3

        The clock runs straight within a window, from its first frame to the next one's. Window 2 takes up the whole
        gap, so that windows 1 and 3 are held only by frames that lie close together.
        """
        count = max(len(self.value) // max(frames_each, 1), 1)
        starts = np.linspace(0, len(self.value), count, endpoint=False).astype(np.int64)
        after = np.flatnonzero(np.diff(self.index) > max(frames_each, 1)) + 1
        return replace(self, window_start=np.union1d(starts, np.concatenate([after - 1, after])))

    @property
    def window_frames(self) -> int:
        """How many frames a window usually has."""
        return int(np.median(np.diff(self.window_start, append=len(self.value))))

    def binned(self, bins: int) -> "Profiles":
        """Average neighbouring rows, so that at most ``bins`` are left."""
        height = self.value.shape[1]
        if height <= bins:
            return self
        edges = np.linspace(0, height, bins + 1).astype(np.int64)[:-1]
        counts = np.diff(np.append(edges, height))
        return replace(
            self,
            value=np.ascontiguousarray(np.add.reduceat(self.value, edges, axis=1) / counts),
            place=np.add.reduceat(self.place, edges) / counts,
            doubt=None if self.doubt is None else np.add.reduceat(self.doubt, edges, axis=1) / counts,
            restless=None,
        )

    def turned(self) -> "Profiles":
        """Return the profiles of the same picture read from the other end."""
        return replace(
            self,
            value=np.ascontiguousarray(self.value[:, ::-1]),
            place=np.ascontiguousarray(self.place.max() + self.place.min() - self.place[::-1]),
            doubt=None if self.doubt is None else np.ascontiguousarray(self.doubt[:, ::-1]),
            restless=None if self.restless is None else np.ascontiguousarray(self.restless[::-1]),
        )

    @property
    def spread(self) -> Doubles:
        """How much each row changes over time, shape (row,); rows in the dark are held at a thousandth."""
        spread = self.value.std(axis=0)
        held: Doubles = np.maximum(spread, 1e-3 * spread.max() + 1e-12)
        return held

    @property
    def clipped_share(self) -> float:
        """Share of the rows' changes that is of pixels which clip, 0 to 1 and more."""
        return 0.0 if self.doubt is None else float(self.doubt.std(axis=0).mean() / self.spread.mean())

    @property
    def unclipped(self) -> Doubles:
        """How far each sample shows the light that fell, shape (frame, row): 1 where no pixel clips, and the less the
        more clipped ones may hide of what its row usually changes by."""
        if self.doubt is None:
            return np.ones_like(self.value)
        share: Doubles = 1.0 / (1.0 + (self.doubt / (HIDDEN * self.spread)) ** 2)
        return share

    @property
    def ends_s(self) -> Doubles:
        """Where each window begins and the last one ends, shape (window + 1,)."""
        start_s = self.frame_start_s
        return np.append(start_s[self.window_start], start_s[-1] + self.period_s)


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
        hessian = np.zeros((len(rows.window_start), row_model.SIGNALS, row_model.SIGNALS))
        score = np.zeros((len(rows.value), row_model.SIGNALS))
        apart = np.zeros((len(rows.window_start), row_model.PLACES if honest else 0, row_model.SIGNALS))
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
