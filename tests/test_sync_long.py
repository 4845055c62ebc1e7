"""Takes so long that what holds throughout is fitted to some stretches, and the clock chapter by chapter."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.model.timing import Timing
from psvideo.sync.find import timing_from_rows
from psvideo.sync.rowfit import long_takes
from psvideo.sync.rowfit.beat import FoundClock
from psvideo.sync.rowfit.coarse.seed import first_guess
from psvideo.sync.rowfit.long_takes import LEAST_WINDOWS, STRETCHES, stretches
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.unknowns import bend
from psvideo.synth import Exposure, Noise, TrueClock, expose

PlanMaker = Callable[..., Plan]
ROWS, FRAMES = 60, 1_200


@pytest.fixture
def plan(make_plan: PlanMaker) -> Plan:
    return make_plan(height_px=ROWS, width_px=6)


@pytest.fixture
def little_is_long(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make a take of 1,200 frames as long as one of 17,000."""
    monkeypatch.setattr(long_takes, "LONG", 24_000)
    monkeypatch.setattr(long_takes, "ENOUGH_SAMPLES", 12_000)


def drifting(plan: Plan, noise: Noise) -> Exposure:
    rng = np.random.default_rng(4)
    scene = {slot: (0.2 + 0.5 * rng.random((ROWS, 6))).astype(np.float32) for slot in plan.lit_slots}
    clock = TrueClock(phase_s=0.0123, offset_ppm=60.0, drift_ppm_per_s=30.0, jitter_s=0.0)
    return expose(scene, plan, frames=FRAMES, clock=clock, noise=noise, bits=12)


def timed(plan: Plan, shot: Exposure, profiles: Doubles) -> Timing:
    return timing_from_rows(plan, np.arange(FRAMES), profiles)


def errors_in_rows(timing: Timing, shot: Exposure, plan: Plan) -> Doubles:
    true_s = np.array([flash.start_s for flash in shot.flashes])
    off_s = timing.start_s - true_s[np.abs(true_s[:, None] - timing.start_s).argmin(axis=0)]
    rows: Doubles = np.abs(off_s) / plan.camera.row_time_s
    return rows


def means(shot: Exposure) -> Doubles:
    profiles: Doubles = shot.frames.mean(axis=2, dtype=np.float64)
    return profiles


@pytest.mark.usefixtures("little_is_long")
@pytest.mark.campaign
def test_a_clock_that_drifts_is_followed_through_frames_that_the_first_fit_left_out(plan: Plan) -> None:
    shot = drifting(plan, Noise(full_well_e=100, read_e=20))
    timing = timed(plan, shot, means(shot))
    off = errors_in_rows(timing, shot, plan)
    assert off.max() < 0.3
    assert float(np.sqrt(np.mean(off**2))) < 2 * timing.phase_error_rows


def test_a_chapter_in_the_dark_is_bridged_from_those_beside_it(plan: Plan, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(long_takes, "ENOUGH_SAMPLES", ROWS * 150)
    value = means(drifting(plan, Noise(full_well_e=20_000, read_e=8)))
    value[450:750] = 0.003 + 1e-4 * np.random.default_rng(1).standard_normal((300, ROWS))
    at_s = np.linspace(0.0, 10.5, 12)
    late_s = 15e-6 * at_s**2
    true = replace(first_guess(plan), clock=FoundClock(phase_s=0.0123, offset_ppm=60.0).bent(at_s, late_s))
    rough = replace(true, clock=true.clock.shifted(2e-5, 0.0, pivot_s=0.0))
    index, place = np.arange(FRAMES, dtype=np.int64), np.arange(ROWS, dtype=np.float64)
    start, period_s = np.zeros(1, np.int64), plan.camera.frame_period_s
    rows = Profiles(value=value, index=index, period_s=period_s, place=place, window_start=start).windowed(25)
    beat, _ = long_takes.clocks_of_chapters(plan, rows, rough)
    asked_s = np.linspace(0.2, 9.8, 97)
    off = np.abs(bend.late_s(true, beat, asked_s)) / plan.camera.row_time_s
    dark = (asked_s > 450 * period_s) & (asked_s < 750 * period_s)

    assert off[~dark].max() < 0.06  # of which the rough clock's own straight pieces are half
    assert off[dark].max() < 0.25


def some_profiles(frames: int, rows: int, **more: Any) -> Profiles:
    value = np.random.default_rng(0).random((frames, rows))
    index, place = np.arange(frames, dtype=np.int64), np.arange(rows, dtype=np.float64)
    start = np.zeros(1, np.int64)
    return Profiles(value=value, index=index, period_s=0.01, place=place, window_start=start, **more).windowed(25)


def test_stretches_are_whole_windows_spread_over_a_long_take(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(long_takes, "LONG", 29_999)
    monkeypatch.setattr(long_takes, "ENOUGH_SAMPLES", 15_000)
    rows = some_profiles(2_000, 15, doubt=np.full((2_000, 15), 0.5))
    part = stretches(rows)
    np.testing.assert_array_equal(part.value, rows.value[part.index])
    begins = np.append(0, np.flatnonzero(np.diff(part.index) > 1) + 1)
    assert len(begins) == STRETCHES
    lengths = np.diff(begins, append=len(part.index))
    assert (lengths == 6 * 25).all()
    assert LEAST_WINDOWS <= 6
    np.testing.assert_allclose(np.diff(part.index[begins]), 2_000 / STRETCHES, atol=1)
    np.testing.assert_array_equal(part.window_start[:8], [0, 25, 50, 75, 100, 125, 149, 150])


def test_clips_that_are_not_long_are_fitted_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = some_profiles(2_000, 15)
    assert stretches(rows) is rows
    monkeypatch.setattr(long_takes, "LONG", 29_999)
    assert stretches(rows) is rows
    monkeypatch.setattr(long_takes, "ENOUGH_SAMPLES", 9_000)
    assert stretches(rows) is not rows


def test_windows_end_where_more_than_one_is_missing() -> None:
    rows = some_profiles(100, 4)
    index = rows.index + np.where(rows.index >= 60, 200, 0)
    cut = Profiles(value=rows.value, index=index, period_s=0.01, place=rows.place, window_start=rows.window_start)
    np.testing.assert_array_equal(cut.windowed(25).window_start, [0, 25, 50, 59, 60, 75])
    np.testing.assert_array_equal(cut.windowed(250).window_start, [0])
    assert cut.windowed(25).window_frames == 20
