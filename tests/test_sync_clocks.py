"""Timing found where readout, exposure or a clock is not what the plan says."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from disturbed_shots import COLUMNS, ROWS, PlanMaker, rms_rows, shoot, timing_of, unknown_readout

from psvideo.errors import PsvideoError
from psvideo.model.plan import Plan
from psvideo.sync.find import timing_from_rows
from psvideo.sync.rowfit.beat import FoundClock
from psvideo.sync.verdict.remarks import OF_MISNAMED_PPM
from psvideo.synth import Noise, TrueClock, expose


@pytest.fixture
def plan(make_plan: PlanMaker) -> Plan:
    return make_plan(height_px=ROWS, width_px=COLUMNS)


@pytest.mark.parametrize("readout", [1.0, 0.35, 0.0, -0.7])
def test_an_unknown_readout_is_found_with_its_direction(readout: float, make_plan: PlanMaker) -> None:
    plan = make_plan(height_px=ROWS, width_px=COLUMNS, readout=readout)
    shot = shoot(plan)
    timing = timing_of(unknown_readout(plan), shot)
    assert rms_rows(timing, shot, plan) < 0.05
    assert timing.row_time_s * ROWS == pytest.approx(plan.camera.readout_s, abs=1e-3 * plan.camera.frame_period_s)
    assert timing.order == "marker"


@pytest.mark.parametrize("error", [0.97, 1.002])
def test_an_exposure_that_is_only_nominal_is_refined(error: float, make_plan: PlanMaker) -> None:
    plan = make_plan(height_px=ROWS, width_px=COLUMNS, shutter=0.5, readout=0.6)
    shot = shoot(plan)
    nominal = replace(plan, camera=replace(plan.camera, exposure_s=error * plan.camera.exposure_s))
    timing = timing_of(nominal, shot)
    assert rms_rows(timing, shot, plan) < 0.05
    assert timing.exposure_s == pytest.approx(plan.camera.exposure_s, rel=1e-4)


def test_a_published_readout_that_is_slightly_wrong_is_corrected(plan: Plan) -> None:
    shot = shoot(plan)
    published = replace(plan, camera=replace(plan.camera, readout_s=0.99 * (plan.camera.readout_s or 0.0)))
    timing = timing_of(published, shot)
    assert rms_rows(timing, shot, plan) < 0.05
    assert timing.row_time_s == pytest.approx(plan.camera.row_time_s, rel=1e-3)


@pytest.mark.parametrize("ppm", [9900.0, -9900.0])
def test_clocks_of_unknown_tolerance_are_found(ppm: float, make_plan: PlanMaker) -> None:
    plan = replace(make_plan(height_px=ROWS, width_px=COLUMNS, clock_tolerance_ppm=10_000), clock_tolerance_ppm=None)
    shot = shoot(plan, ppm=ppm)
    timing = timing_of(plan, shot)
    assert rms_rows(timing, shot, plan) < 0.05
    assert timing.clock_offset_ppm == pytest.approx(ppm, abs=1.0)


@pytest.mark.parametrize(("drift", "bar"), [(20.0, 0.05), (4.0, 0.01)])
def test_a_clock_that_drifts_is_followed(drift: float, bar: float, plan: Plan) -> None:
    shot = shoot(plan, frames=400, ppm=100.0, drift=drift)
    timing = timing_of(plan, shot)
    assert rms_rows(timing, shot, plan) < bar
    assert timing.phase_error_rows < bar


def test_a_clock_that_runs_straight_stays_straight(plan: Plan) -> None:
    timing = timing_of(plan, shoot(plan, frames=150))
    gaps_s = np.diff([flash.start_s for flash in timing.flashes])
    assert np.ptp(gaps_s) < 1e-12


def test_a_misnamed_frame_rate_is_found_and_said(make_plan: PlanMaker) -> None:
    plan = make_plan(height_px=ROWS, width_px=COLUMNS, duration_s=0.00025, clock_tolerance_ppm=50)
    shot = shoot(plan)
    misnamed = replace(plan, camera=replace(plan.camera, fps=Fraction(120)))
    timing = timing_of(misnamed, shot)
    assert rms_rows(timing, shot, plan, scale=1 / 1.001) < 0.05
    assert timing.frame_period_s == 1 / 120
    assert any("misnamed by 1.001" in note for note in timing.notes)
    assert not timing_of(plan, shot).notes


def test_a_misnamed_rate_is_recognised_by_what_it_makes_of_the_strobes_period() -> None:
    """A strobe of 12.5 ms spans 12.5e-3 * (true rate) frames, which the plan's rate takes for other seconds."""
    exact, broadcast = Fraction(120), Fraction(120000, 1001)
    for ppm, (true_fps, named_fps) in zip(OF_MISNAMED_PPM, ((broadcast, exact), (exact, broadcast)), strict=True):
        seen_s = Fraction(125, 10000) * true_fps / named_fps
        assert ppm == pytest.approx(float(1e6 * (seen_s / Fraction(125, 10000) - 1)), abs=1e-6)


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        pytest.param(0.55, "flashes mixed", marks=pytest.mark.campaign),
        pytest.param(0.9, "but only if frames are missing or repeated at", marks=pytest.mark.campaign),
        pytest.param(1.4, "and not every", marks=pytest.mark.campaign),
    ],
)
def test_a_strobe_that_flashes_at_another_rate_is_not_timed_but_told(factor: float, words: str, plan: Plan) -> None:
    shot = shoot(replace(plan, dark_s=factor * plan.dark_s), frames=96)
    with pytest.raises(PsvideoError, match=words):
        timing_of(plan, shot)


def test_bends_add_up_and_run_straight_on_beyond_the_last_knot() -> None:
    clock = FoundClock(phase_s=0.0, offset_ppm=0.0).bent(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1e-6, 3e-6]))
    np.testing.assert_allclose(clock.bend(np.array([-1.0, 0.5, 3.0])), [-1e-6, 0.5e-6, 5e-6])
    twice = clock.bent(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1e-6, 3e-6]))
    np.testing.assert_allclose(twice.bend(np.array([0.5])), [1e-6])
    moved = clock.shifted(2e-6, 10.0, pivot_s=1.0)
    np.testing.assert_allclose([moved.phase_s, moved.offset_ppm], [2e-6 - 10e-6, 10.0])
    assert (moved.knot_s, moved.bend_s) == (clock.knot_s, clock.bend_s), "bends stay with the clock"


@pytest.mark.parametrize(("true", "planned"), [(1.0, 0.99), (0.97, 1.0), (0.5, 0.515)])
@pytest.mark.campaign
def test_an_exposure_that_is_off_by_more_than_a_flash_lasts_is_found(
    true: float, planned: float, make_plan: PlanMaker
) -> None:
    """Behind a short readout one end of the exposure explained the flashes, and all were off by what the plan was."""
    plan = make_plan(height_px=48, width_px=12, readout=0.11, shutter=true, fps=Fraction(25), duration_s=0.0003)
    plan = replace(plan, dark_s=1.1 * plan.camera.exposure_s)
    shot = shoot(plan, frames=100)
    told = replace(plan, camera=replace(plan.camera, exposure_s=planned * plan.camera.frame_period_s))
    timing = timing_from_rows(told, np.arange(100), shot.frames.mean(axis=2, dtype=np.float64))
    assert rms_rows(timing, shot, plan) < 0.05
    assert timing.exposure_s == pytest.approx(plan.camera.exposure_s, rel=1e-4)


def test_where_the_longer_flash_is_a_guess_so_are_the_times(make_plan: PlanMaker) -> None:
    """In heavy noise any of five flashes may be the longer one: times were off by what that changes, unclaimed."""
    plan = make_plan(
        height_px=48, width_px=12, readout=0.88, shutter=0.25, fps=Fraction(24), lights=tuple("abcde"), dark=False
    )
    flash = replace(plan.flashes[0], duration_s=0.00045)
    others = tuple(replace(one, duration_s=0.0003) for one in plan.flashes[1:])
    plan = replace(plan, flashes=(flash, *others))
    rng, down = np.random.default_rng(3), np.linspace(0, 1, 48)[:, None] * np.ones(12)
    waves = {slot: np.sin(rng.uniform(2, 6) * down + rng.uniform(0, 6)) for slot in plan.lit_slots}
    walls = {slot: np.asarray(0.3 + 0.2 * wave, np.float32) for slot, wave in waves.items()}
    noise = Noise(full_well_e=20_000, read_e=2000)
    shot = expose(walls, plan, frames=40, clock=TrueClock(phase_s=0.0123, offset_ppm=60.0), noise=noise, bits=12)
    timing = timing_from_rows(plan, np.arange(40), shot.frames.mean(axis=2, dtype=np.float64))
    assert timing.order == "guess"
    assert (timing.phase_error_s or 0.0) > 0.2 * (flash.duration_s - others[0].duration_s)
