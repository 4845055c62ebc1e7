"""Find when every flash fired, from the picture alone: row profiles in, Timing out.

One global fit over many frames instead of a search for each frame's darkest row: the phase of the strobe and the
ratio of the two clocks are the only unknowns that are searched; the brightness of every row under every light is
eliminated (``rowfit``). A coarse grid over a few dozen frames finds the place in the cycle, a robust Gauss-Newton fit
over ever more frames sharpens it, and the cycle's marker tells which light is which.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from psvideo.camera import FloatArray
from psvideo.errors import PsvideoError, UsageError
from psvideo.plan import FlashTrain, Plan
from psvideo.rowfit import Profiles, losses, residuals
from psvideo.shutter import frames_touched
from psvideo.timing import DroppedFrames, Flash, Order, Timing

SEARCH_ROWS = 36
COARSE_ROWS = 72
COARSE_FRAMES = 96
MOST_SAMPLES = 2_000_000
"""Row means that the last fit looks at; a clip that has more gets its rows averaged, which bounds memory and time."""
ROBUST_STEEPNESS = 20.0
"""Of the coarse loss ``log(1 + 20 r^2)``, r being a residual over its row's own spread (physics.md)."""
CAUCHY = 2.4
"""Residuals of this many standard deviations are trusted half as much (95 % efficiency for Gaussian noise)."""
FIRST_SCALE, LAST_SCALE = 0.3, 2e-3
"""The robust fit's residual scale as a share of each row's spread: it shrinks from step to step down to the noise, so
that the few rows that a flash splits, which tell the time, are not taken for outliers before the fit is near."""
MIN_EXPLAINED = 0.5
"""A fit that explains less of the rows' changes than this has not found a strobe."""
CLEAR_MARKER = 1.3
"""The next best order of the lights must fit worse by this factor before the marker is believed."""


@dataclass(frozen=True, kw_only=True)
class StrobeClock:
    """The strobe's clock on the camera's: flash 0 of a cycle starts at ``phase_s``; ``offset_ppm`` as in files."""

    phase_s: float
    offset_ppm: float

    @property
    def rate(self) -> float:
        """Camera seconds per strobe second."""
        return 1.0 + self.offset_ppm * 1e-6

    def shifted(self, shift_s: float, ppm: float, *, pivot_s: float) -> "StrobeClock":
        """Return this clock moved by ``shift_s`` and made faster by ``ppm``, turning about ``pivot_s``."""
        phase_s = self.phase_s + shift_s + (self.phase_s - pivot_s) * ppm * 1e-6
        return StrobeClock(phase_s=phase_s, offset_ppm=self.offset_ppm + ppm * self.rate)


@dataclass(frozen=True, kw_only=True)
class _Fit:
    clock: StrobeClock
    shift_error_s: float
    explained: float


def find_timing(
    plan: Plan,
    indices: NDArray[np.int64],
    profiles: FloatArray,
    *,
    clip: str = "clip",
    first_light: str | None = None,
    dropped: Sequence[DroppedFrames] = (),
) -> Timing:
    """Return when every flash of a clip fired.

    ``indices`` (frame,) are the frames' places in time and ``profiles`` (frame, row) their row means in linear light.
    Raises PsvideoError where the profiles do not look like the plan's strobe.
    """
    if plan.mode == "synced":
        return _synced_timing(plan, indices, clip=clip, dropped=dropped)
    if len(indices) < 4:
        raise PsvideoError(f"{clip}: holds {len(indices)} frame(s); finding the strobe's timing needs at least 4.")
    rows = _as_profiles(plan, indices, profiles)
    start = _search(plan, _binned(rows, SEARCH_ROWS).take(slice(0, _coarse_frames(plan, len(indices)))))
    fit = _refine_growing(plan, rows, start)
    if fit.explained < MIN_EXPLAINED:
        raise PsvideoError(
            f"{clip}: no strobe like the plan's was found in the picture: the best fit explains "
            f"{100 * max(fit.explained, 0):.0f} % of the rows' changes from frame to frame, expected at least "
            f"{100 * MIN_EXPLAINED:.0f} %. Check that plan.toml is the plan that the strobe played (frame rate, flash "
            "durations, dark time), that the lights flashed, and that the exposure was fixed."
        )
    clock, order = _order_of_lights(plan, _binned(rows, COARSE_ROWS), fit.clock, first_light)
    return _assemble(plan, indices, replace(fit, clock=clock), order=order, clip=clip, dropped=dropped)


def train_until(plan: Plan, clock: StrobeClock, until_s: float) -> FlashTrain:
    """Return the flashes that can touch frames from 0 s to ``until_s``, as times on the camera's clock."""
    cycle = len(plan.cycle_slots)
    first = -cycle * (1 + int(np.floor(clock.phase_s / (plan.cycle_s * clock.rate))))
    count = cycle * (2 + int(np.ceil(until_s / (plan.cycle_s * clock.rate))))
    train = plan.train(first, count)
    return FlashTrain(
        slot=train.slot,
        start_s=clock.phase_s + train.start_s * clock.rate,
        duration_s=train.duration_s * clock.rate,
    )


def _as_profiles(plan: Plan, indices: NDArray[np.int64], values: FloatArray) -> Profiles:
    """Lay out the profiles for fitting, with windows long enough to see every light several times."""
    window = max(24, 6 * (len(plan.lit_slots) + 1))
    count = max(len(indices) // window, 1)
    starts = np.linspace(0, len(indices), count, endpoint=False).astype(np.int64)
    return Profiles(
        value=np.ascontiguousarray(values, np.float64),
        frame_start_s=np.asarray(indices, np.float64) * plan.camera.frame_period_s,
        row_offset_s=plan.camera.row_offsets_s(),
        exposure_s=plan.camera.exposure_s,
        window_start=starts,
    )


def _binned(rows: Profiles, bins: int) -> Profiles:
    """Average neighbouring rows for the coarse search."""
    edges = np.linspace(0, rows.value.shape[1], min(bins, rows.value.shape[1]) + 1).astype(np.int64)[:-1]
    counts = np.diff(np.append(edges, rows.value.shape[1]))
    value = np.add.reduceat(rows.value, edges, axis=1) / counts
    offset_s = np.add.reduceat(rows.row_offset_s, edges) / counts
    return replace(rows, value=np.ascontiguousarray(value), row_offset_s=offset_s)


def _coarse_frames(plan: Plan, frames: int) -> int:
    """Return how many frames the coarse search looks at: a cycle and a half, so that the marker is among them."""
    cycle_frames = plan.cycle_s / plan.camera.frame_period_s
    return min(frames, max(COARSE_FRAMES, int(1.5 * cycle_frames) + 2))


def _unknowns(plan: Plan) -> NDArray[np.int64]:
    """Return which brightness each slot shows: 1, 2, … for the lit slots, 0 for dark ones."""
    number = np.zeros(len(plan.flashes), np.int64)
    number[list(plan.lit_slots)] = np.arange(1, len(plan.lit_slots) + 1)
    return number


def _unexplained(plan: Plan, rows: Profiles, clock: StrobeClock, weight: FloatArray) -> FloatArray:
    """Return the residuals (frame, row) under one guess of the clock."""
    until_s = float(rows.frame_start_s[-1] + rows.row_offset_s.max() + rows.exposure_s)
    train = train_until(plan, clock, until_s)
    return residuals(rows, train.start_s, train.duration_s, _unknowns(plan)[train.slot], weight)


def _spread(rows: Profiles) -> FloatArray:
    """Return how much each row changes over time, shape (row,); rows in the dark are held at a thousandth."""
    spread = rows.value.std(axis=0)
    spread_floor: FloatArray = np.maximum(spread, 1e-3 * spread.max() + 1e-12)
    return spread_floor


def _search(plan: Plan, rows: Profiles) -> StrobeClock:
    """Return the best clock of a grid: a third of a flash in phase, half a flash's slip in clock ratio."""
    shortest_s = min(plan.flashes[slot].duration_s for slot in plan.lit_slots)
    span_s = float(rows.frame_start_s[-1] - rows.frame_start_s[0]) + plan.camera.frame_period_s
    slips = int(np.ceil(plan.clock_range_ppm * 1e-6 * span_s / (0.5 * shortest_s)))
    phases_s = np.arange(0.0, plan.cycle_s, shortest_s / 3)
    ppm = np.linspace(-1, 1, 2 * slips + 1) * plan.clock_range_ppm if slips else np.zeros(1)
    clocks = [
        StrobeClock(phase_s=phase_s, offset_ppm=0.0).shifted(0.0, offset_ppm, pivot_s=float(rows.frame_start_s.mean()))
        for offset_ppm in ppm
        for phase_s in phases_s
    ]
    before = 1 + int(np.ceil(max(clock.phase_s for clock in clocks) / plan.cycle_s))
    after = 2 + int(np.ceil((span_s + plan.camera.frame_period_s) / plan.cycle_s))
    cycle = len(plan.cycle_slots)
    train = plan.train(-before * cycle, (before + after) * cycle)
    found = losses(
        rows,
        train.start_s,
        train.duration_s,
        _unknowns(plan)[train.slot],
        phase_s=np.array([clock.phase_s for clock in clocks]),
        rate=np.array([clock.rate for clock in clocks]),
        spread=_spread(rows),
        steepness=ROBUST_STEEPNESS,
    )
    return clocks[int(np.argmin(found))]


def _refine_growing(plan: Plan, rows: Profiles, clock: StrobeClock) -> _Fit:
    """Sharpen a clock over twice as many frames each time, so that it never slips by a flash on the way."""
    frames = len(rows.value)
    count = _coarse_frames(plan, frames)
    while count < frames:
        clock = _refine(plan, _binned(rows, 4 * COARSE_ROWS).take(slice(0, count)), clock, steps=6).clock
        count *= 2
    return _refine(plan, _binned(rows, max(4 * COARSE_ROWS, MOST_SAMPLES // frames)), clock, steps=10)


def _refine(plan: Plan, rows: Profiles, clock: StrobeClock, *, steps: int) -> _Fit:
    """Fit shift and clock ratio by robust Gauss-Newton steps, each taken only as far as it helps."""
    pivot_s = float(rows.frame_start_s.mean())
    half_span_s = max(pivot_s - float(rows.frame_start_s[0]), plan.camera.frame_period_s)
    reach_s = 0.02 * min(plan.flashes[slot].duration_s for slot in plan.lit_slots)
    probes = ((reach_s, 0.0), (0.0, reach_s / half_span_s * 1e6))
    trust = np.ones_like(rows.value)
    rest = _unexplained(plan, rows, clock, trust)
    gradient = np.empty((2, *rest.shape))
    spread = _spread(rows)
    for step in range(steps):
        scale = np.maximum(_row_noise(rest), spread * max(FIRST_SCALE * 0.4**step, LAST_SCALE))
        trust = 1.0 / (1.0 + (rest / (CAUCHY * scale)) ** 2)
        rest = _unexplained(plan, rows, clock, trust)
        for number, (shift_s, ppm) in enumerate(probes):
            ahead = _unexplained(plan, rows, clock.shifted(shift_s, ppm, pivot_s=pivot_s), trust)
            behind = _unexplained(plan, rows, clock.shifted(-shift_s, -ppm, pivot_s=pivot_s), trust)
            gradient[number] = (ahead - behind) / 2
        weight = trust / scale**2
        hessian = np.einsum("anr,nr,bnr->ab", gradient, weight, gradient, optimize=True)
        slope = np.einsum("anr,nr->a", gradient, weight * rest)
        move = -np.linalg.solve(hessian + 1e-12 * np.trace(hessian) * np.eye(2), slope)
        clock, rest, gained = _line_search(plan, rows, clock, move, probes, pivot_s, trust, weight, rest)
        if step > 6 and (not gained or np.abs(move).max() < 1e-3):
            break
    error = _shift_error(gradient, weight, rest)
    return _Fit(clock=clock, shift_error_s=error * reach_s, explained=_explained(rows, rest))


def _line_search(
    plan: Plan,
    rows: Profiles,
    clock: StrobeClock,
    move: FloatArray,
    probes: tuple[tuple[float, float], ...],
    pivot_s: float,
    trust: FloatArray,
    weight: FloatArray,
    rest: FloatArray,
) -> tuple[StrobeClock, FloatArray, bool]:
    """Take a step of at most a third of a flash, halved until it explains more; say whether it did."""
    move = move * min(1.0, 16.0 / max(float(np.abs(move).max()), 1e-12))
    loss = float((weight * rest**2).sum())
    for _ in range(5):
        shift_s, ppm = move[0] * probes[0][0], move[1] * probes[1][1]
        moved = clock.shifted(shift_s, ppm, pivot_s=pivot_s)
        moved_rest = _unexplained(plan, rows, moved, trust)
        if float((weight * moved_rest**2).sum()) < loss:
            return moved, moved_rest, True
        move = move / 2
    return clock, rest, False


def _row_noise(rest: FloatArray) -> FloatArray:
    """Return each row's own residual spread (from the median, so that outliers do not count), shape (row,)."""
    spread = 1.4826 * np.median(np.abs(rest), axis=0)
    noise: FloatArray = np.maximum(spread, 0.1 * np.median(spread) + 1e-9)
    return noise


def _shift_error(gradient: FloatArray, weight: FloatArray, rest: FloatArray) -> float:
    """Return the standard error of the shift in units of its probe.

    Rows of one frame err together (a subject that moves), so whole frames are the independent pieces: the sandwich
    estimator with one cluster a frame (Liang and Zeger 1986).
    """
    hessian = np.einsum("anr,nr,bnr->ab", gradient, weight, gradient, optimize=True)
    bread = np.linalg.inv(hessian + 1e-12 * np.trace(hessian) * np.eye(2))
    pieces = np.einsum("anr,nr->na", gradient, weight * rest)
    return float(np.sqrt((bread @ (pieces.T @ pieces) @ bread)[0, 0]))


def _explained(rows: Profiles, rest: FloatArray) -> float:
    """Return which share of the rows' changes from frame to frame the fit explains."""
    change = rows.value - rows.value.mean(axis=0)
    return 1.0 - float((rest**2).sum() / max(float((change**2).sum()), 1e-30))


def _order_of_lights(
    plan: Plan, rows: Profiles, clock: StrobeClock, first_light: str | None
) -> tuple[StrobeClock, Order]:
    """Turn the cycle to every place that puts flashes on flashes, and say how clearly one of them fits best."""
    if len(plan.cycle_slots) == 1:
        return clock, "given"
    spread, ones = _spread(rows), np.ones_like(rows.value)
    train = plan.train(0, len(plan.cycle_slots))
    turned = [replace(clock, phase_s=clock.phase_s - start_s * clock.rate) for start_s in train.start_s]
    losses = np.array([float(((_unexplained(plan, rows, turn, ones) / spread) ** 2).sum()) for turn in turned])
    alike = [turn for turn, loss in zip(turned, losses, strict=True) if loss < CLEAR_MARKER * losses.min()]
    names = {_first_complete_light(plan, rows, turn) for turn in alike}
    if first_light is not None:
        return _given_order(plan, rows, alike, first_light), "given"
    return clock, "marker" if len(alike) == 1 or len(names) == 1 else "guess"


def _given_order(plan: Plan, rows: Profiles, alike: list[StrobeClock], first_light: str) -> StrobeClock:
    if first_light not in plan.lights:
        raise UsageError(
            f"--first-light {first_light}: no such light in the plan; its lights are {', '.join(plan.lights)}."
        )
    for turn in alike:
        if first_light == _first_complete_light(plan, rows, turn):
            return turn
    seen = _first_complete_light(plan, rows, alike[0])
    raise PsvideoError(
        f"--first-light {first_light} does not fit the footage: by the cycle's marker the clip's first complete flash "
        f"is {seen}'s. Leave the option out, or check that plan.toml is the plan that the strobe played."
    )


def _first_complete_light(plan: Plan, rows: Profiles, clock: StrobeClock) -> str:
    """Return the light (or lights, joined by +) of the first lit flash that the clip holds from the first row on."""
    train = train_until(plan, clock, float(rows.frame_start_s[-1]))
    for slot, start_s in zip(train.slot, train.start_s, strict=True):
        if start_s >= rows.row_offset_s.max() and not plan.flashes[slot].is_dark:
            return "+".join(plan.flashes[slot].lights)
    return ""


def _assemble(
    plan: Plan,
    indices: NDArray[np.int64],
    fit: _Fit,
    *,
    order: Order,
    clip: str,
    dropped: Sequence[DroppedFrames],
) -> Timing:
    """List every flash that the clip saw any of, and mark those that its start or end cuts."""
    camera = plan.camera
    train = train_until(plan, fit.clock, (int(indices[-1]) + 2) * camera.frame_period_s)
    first, last = frames_touched(camera, train.start_s, train.duration_s)
    seen = (last >= indices[0]) & (first <= indices[-1])
    complete = (first >= indices[0]) & (last <= indices[-1])
    flashes = tuple(
        Flash(
            index=index,
            slot=int(train.slot[k]),
            lights=plan.flashes[train.slot[k]].lights,
            start_s=float(train.start_s[k]),
            duration_s=float(train.duration_s[k]),
            complete=bool(complete[k]),
        )
        for index, k in enumerate(np.flatnonzero(seen))
    )
    row_time_s = camera.row_time_s
    return Timing(
        clip=clip,
        frame_period_s=camera.frame_period_s,
        exposure_s=camera.exposure_s,
        row_time_s=row_time_s,
        clock_offset_ppm=fit.clock.offset_ppm,
        phase_error_rows=fit.shift_error_s / abs(row_time_s) if row_time_s else 0.0,
        order=order,
        dropped_frames=tuple(dropped),
        flashes=flashes,
    )


def _synced_timing(plan: Plan, indices: NDArray[np.int64], *, clip: str, dropped: Sequence[DroppedFrames]) -> Timing:
    """One flash a frame, in the plan's order: nothing is left to find."""
    period_s = plan.camera.frame_period_s
    train = plan.train(0, int(indices[-1]) + 1)
    flashes = tuple(
        Flash(
            index=n,
            slot=int(slot),
            lights=plan.flashes[slot].lights,
            start_s=n * period_s,
            duration_s=min(float(duration_s), plan.camera.exposure_s),
            complete=True,
        )
        for n, (slot, duration_s) in enumerate(zip(train.slot, train.duration_s, strict=True))
    )
    return Timing(
        clip=clip,
        frame_period_s=period_s,
        exposure_s=plan.camera.exposure_s,
        row_time_s=plan.camera.row_time_s,
        clock_offset_ppm=0.0,
        phase_error_rows=0.0,
        order="given",
        dropped_frames=tuple(dropped),
        flashes=flashes,
    )
