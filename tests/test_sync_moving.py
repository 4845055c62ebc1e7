"""Timing found where the subject moves as fast as the dark row: from rows that two frames share a flash in."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from bench.timing import against_truth
from bench.timing_cases import Case, groups
from bench.timing_scenes import plan_of, rolling_stripes, tumbling

from psvideo.errors import NoStrobeError
from psvideo.model.plan import Plan
from psvideo.model.rows.row_profiles import collect_with_doubt
from psvideo.model.timing import DroppedFrames, Timing
from psvideo.sync.find import timing_from_rows
from psvideo.sync.rowfit.beat import FoundClock
from psvideo.sync.rowfit.coarse.seed import first_guess
from psvideo.sync.rowfit.compiled_profiles import compiled_flashes, compiled_rows, unexplained
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import Fit, robust_loss
from psvideo.sync.rowfit.row_model import seen_of
from psvideo.sync.rowfit.tracking.false_holes import without_false_holes
from psvideo.sync.rowfit.tracking.track import FrameTrack
from psvideo.sync.rowfit.unknowns.likelier import taken_away
from psvideo.sync.rowfit.unknowns.whitening import factors, whiten
from psvideo.synth import TrueFlash

EVERYTHING = groups()["Several at once"]["everything: void, tumbling, drift, tails, flicker, readout"]


def timed(case: Case, seed: int) -> tuple[Timing, float]:
    """Return a case's timing and the RMS error of its flashes in rows."""
    filmed = case.film(seed)
    index, profiles, doubt = collect_with_doubt(filmed.frames)
    timing = timing_from_rows(case.claimed or case.plan, index, profiles, doubt=doubt)
    error_s, named = against_truth(timing, filmed, 1.0)
    assert named
    return timing, float(np.sqrt(np.mean(error_s**2))) / case.plan.camera.row_time_s


@pytest.mark.campaign
def test_slow_leds_show_on_a_subject_that_tumbles_with_everything_else_unknown() -> None:
    timing, off_rows = timed(replace(EVERYTHING, frames=150), seed=1)
    assert timing.order == "marker"
    assert timing.dropped_frames == (DroppedFrames(after=119, count=1),)
    assert timing.fall_s == pytest.approx(5e-5, rel=0.1)
    assert off_rows < 0.15
    assert off_rows < 3 * timing.phase_error_rows


@pytest.mark.parametrize(("tail_rows", "seed"), [(0.09, 0), (0.09, 1), (0.35, 3)])
@pytest.mark.campaign
def test_tails_that_the_plan_does_not_tell_are_found_or_claimed_before_a_subject_that_tumbles(
    tail_rows: float, seed: int
) -> None:
    told = plan_of(durations_s=(0.0008,), height_px=48)
    tail_s = tail_rows * told.camera.row_time_s
    case = Case(plan=replace(told, rise_s=tail_s, fall_s=tail_s), claimed=told, scene=tumbling, frames=60, ambient=0.03)
    timing, off_rows = timed(case, seed)
    assert off_rows < 2 * timing.phase_error_rows
    assert timing.phase_error_rows < 0.1


@pytest.mark.parametrize("tail_rows", [0.0, 0.1])
def test_tails_that_no_row_shows_are_claimed_as_far_as_rows_make_them_likely(tail_rows: float) -> None:
    """A fit's error for tails is that of a straight line, while short ones change rows by their square: 0.09 was
    claimed here, and up to 2.5 rows before balls that slide through a void, of times that were 0.005 off."""
    told = plan_of(lights=tuple("abcdefg"), durations_s=(0.0008,), height_px=48)
    tail_s = tail_rows * told.camera.row_time_s
    case = Case(plan=replace(told, rise_s=tail_s, fall_s=tail_s), claimed=told, scene=tumbling, frames=40, ambient=0.02)
    timing, off_rows = timed(case, seed=1)
    assert off_rows < 2 * timing.phase_error_rows
    assert timing.phase_error_rows < 0.07


def test_rows_that_show_nothing_put_no_times_in_doubt() -> None:
    timing, off_rows = timed(groups()["Scenes"]["void"], seed=0)
    assert off_rows < timing.phase_error_rows < 0.01
    assert not any("come early or late" in note for note in timing.notes)


def test_stripes_that_move_with_the_dark_row_are_no_clock_that_jumps() -> None:
    timing, off_rows = timed(groups()["Scenes"]["stripes moving with the dark row"], seed=0)
    assert off_rows < timing.phase_error_rows < 0.02
    assert not any("come early or late" in note for note in timing.notes)


@pytest.mark.parametrize("share", [0.3, pytest.param(0.5, marks=pytest.mark.campaign)])
def test_stripes_that_keep_pace_with_the_dark_row_are_timed(share: float) -> None:
    plan = plan_of(lights=tuple("abcde"), durations_s=(0.0016,), height_px=160, readout=0.9)
    scene = rolling_stripes(speed=1.1, share=share, pitch=1.0, light=0.3)
    timing, off_rows = timed(Case(plan=plan, scene=scene, ambient=0.02), seed=3)
    assert off_rows < 0.02
    assert timing.phase_error_rows < 0.02


def turning(plan: Plan, rng: np.random.Generator) -> Callable[[TrueFlash], np.ndarray]:
    """A bumpy wall that turns before the lights and sinks through the picture."""
    height, width = plan.camera.height_px, plan.camera.width_px
    waves = np.maximum(np.hypot(np.fft.fftfreq(height)[:, None] * height, np.arange(width // 2 + 1)), 1)

    def rough(steepness: float) -> np.ndarray:
        bumps = np.fft.irfft2(np.fft.rfft2(rng.standard_normal((height, width))) / waves**steepness, (height, width))
        return np.asarray((bumps - bumps.min()) / np.ptp(bumps))

    down, across = np.gradient(rough(2.0) * height / 8)
    normal = np.stack([-across, down, np.ones_like(down)]) / np.sqrt(1 + across**2 + down**2)
    albedo = 0.2 + 0.8 * rough(1.0)

    def plate(flash: TrueFlash) -> np.ndarray:
        at = flash.middle_s / plan.camera.frame_period_s
        turn, light = 0.7 * np.sin(8.7 / height * at), np.zeros((height, width))
        for name, power in flash.lights.items():
            around = 2 * np.pi * plan.lights.index(name) / len(plan.lights)
            x, y, z = 0.6 * np.cos(around), 0.6 * np.sin(around), 0.8
            seen = np.array([np.cos(turn) * x + np.sin(turn) * z, y, np.cos(turn) * z - np.sin(turn) * x])
            light += power * np.maximum(np.tensordot(seen, normal, 1), 0) * albedo
        return np.asarray(0.6 * np.roll(light, round(0.87 * at), 0), np.float32)

    return plate


TURNING = Case(
    plan=plan_of(lights=tuple("abcd"), dark=False, durations_s=(0.00024,), shutter=0.5, height_px=64, width_px=32),
    scene=turning,
    frames=60,
    ambient=0.02,
    marker=False,
)


@pytest.mark.campaign
def test_a_subject_that_turns_is_timed_without_a_marker() -> None:
    """Holes were found before it, and the clip was refused or flashes were 4 ms off at a claim of 56 us."""
    filmed = replace(TURNING, frames=85).film(1)
    index, profiles, doubt = collect_with_doubt(filmed.frames)
    timing = timing_from_rows(TURNING.plan, index, profiles, doubt=doubt)
    error_s, _ = against_truth(timing, filmed, 1.0)
    assert not timing.dropped_frames
    assert np.sqrt(np.mean(error_s**2)) < 2 * (timing.phase_error_s or 0.0) < 2e-4


@pytest.mark.parametrize("seed", [slice(0, 24), slice(36, 60)])
@pytest.mark.parametrize("true", [False, True])
def test_holes_are_believed_where_short_stretches_show_them_too(seed: slice, *, true: bool) -> None:
    """Before a subject that turns, lights of eight frames later fitted better than what these lights had given."""
    at, missing = 30, 8
    filmed = replace(TURNING, dropped=tuple(range(at, at + missing)) if true else ()).film(1)
    _, profiles, _ = collect_with_doubt(filmed.frames)
    count = len(profiles)
    rows = Profiles(
        value=profiles,
        index=np.arange(count),
        period_s=TURNING.plan.camera.frame_period_s,
        place=np.arange(64.0),
        window_start=np.zeros(1, np.int64),
    )
    with_hole = np.arange(count) + missing * (np.arange(count) >= at)
    seen_late = seed.start > 0 and not true  # of a clip that is whole, frames before the hole were put too early
    begins_s = next(flash.start_s for flash in filmed.exposure.flashes if flash.slot == 0)
    phase_s = begins_s + (missing * rows.period_s if seen_late else 0.0)
    beat = replace(first_guess(TURNING.plan), clock=FoundClock(phase_s=phase_s, offset_ppm=TURNING.clock.offset_ppm))
    tracked = FrameTrack(index=with_hole, beat=beat, at_s=np.empty(0), late_s=np.empty(0))
    found = without_false_holes(TURNING.plan, rows, tracked, seed)
    steps = np.diff(found.index)
    assert steps.tolist() == np.diff(with_hole).tolist() if true else (steps == 1).all()
    assert found.index[seed.start] == with_hole[seed.start], "the clock fits these"


@pytest.mark.campaign
def test_stripes_that_feign_another_shutter_are_refused() -> None:
    plan = plan_of(lights=tuple("abcdefgh"), shutter=0.5, height_px=48)
    case = Case(plan=plan, scene=rolling_stripes(share=0.5, pitch=1.0), frames=64)
    with pytest.raises(NoStrobeError, match="no strobe like the plan's"):
        timed(case, seed=0)


def test_residuals_are_whitened_by_what_flashes_of_one_light_differ_by() -> None:
    plan = plan_of(height_px=12)
    beat = replace(first_guess(plan), clock=FoundClock(phase_s=0.004, offset_ppm=0.0))
    rows = Profiles(
        value=np.random.default_rng(2).random((20, 12)),
        index=np.arange(20),
        period_s=plan.camera.frame_period_s,
        place=np.arange(12.0),
        window_start=np.zeros(1, np.int64),
        restless=np.full(12, 40.0),
    )
    seen, flashes = compiled_rows(rows, beat), compiled_flashes(plan, rows, beat)
    row = 7
    shares = np.array([[seen_of(seen, flashes, n, row, j) for j in range(len(flashes.start_s))] for n in range(20)])
    assert ((shares > 0.01) & (shares < 0.99)).any(), "no frame saw a part of a flash"
    diagonal, below, column = np.empty(20), np.empty(20), rows.value[:, row].copy()
    factors(seen, flashes, row, diagonal, below)
    whiten(column, diagonal, below)
    factor = np.linalg.cholesky(np.eye(20) + 40.0 * shares @ shares.T)
    assert np.allclose(column, np.linalg.solve(factor, rows.value[:, row]), atol=1e-12)


def test_the_same_times_gain_nothing_whichever_samples_were_trusted() -> None:
    filmed = replace(EVERYTHING, plan=plan_of(height_px=48), claimed=None, frames=40, mains=None, dropped=()).film(0)
    index, profiles, _ = collect_with_doubt(filmed.frames)
    plan = plan_of(height_px=48)
    rows = Profiles(
        value=np.asarray(profiles, np.float64),
        index=index,
        period_s=plan.camera.frame_period_s,
        place=np.arange(48.0),
        window_start=np.zeros(1, np.int64),
        restless=np.full(48, 40.0),
    )
    beat = replace(first_guess(plan), clock=FoundClock(phase_s=filmed.exposure.flashes[0].start_s, offset_ppm=3000.0))
    even, some = np.ones_like(rows.value), np.random.default_rng(3).random(rows.value.shape) ** 4
    one, other = (
        Fit(
            beat=beat,
            rest=unexplained(plan, rows, beat, weight),
            weight=weight,
            shift_error_s=0.0,
            errors_s={},
            explained=0.0,
        )
        for weight in (even, some)
    )
    assert robust_loss(rows, one.rest, one.rest) != robust_loss(rows, other.rest, one.rest)
    assert taken_away(plan, rows, one, other) == taken_away(plan, rows, other, one) == 0.0
    still = replace(rows, restless=None)
    assert taken_away(plan, still, one, other) != 0.0
