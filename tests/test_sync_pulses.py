"""Timing found where flashes have tails, stray from the plan or are of different lengths."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from disturbed_shots import COLUMNS, ROWS, PlanMaker, plates, rms_rows, shoot, timing_of
from memory_frame import MemoryFrame

from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan, PlannedFlash
from psvideo.model.rows.row_profiles import collect_with_doubt
from psvideo.model.timing import Timing
from psvideo.sync.find import timing_from_rows
from psvideo.synth import Exposure, Noise


@pytest.fixture
def plan(make_plan: PlanMaker) -> Plan:
    return make_plan(height_px=ROWS, width_px=COLUMNS)


def test_tails_that_the_plan_does_not_give_are_found(plan: Plan) -> None:
    slow = replace(plan, rise_s=2e-5, fall_s=8e-5)
    shot = shoot(slow)
    timing = timing_of(plan, shot)
    assert rms_rows(timing, shot, plan) < 0.3
    assert any("LEDs" in note for note in timing.notes)


def test_a_rise_and_a_fall_that_are_alike_are_found_though_no_flash_seems_longer(make_plan: PlanMaker) -> None:
    plan = make_plan(height_px=160, width_px=COLUMNS)
    slow = replace(plan, rise_s=2e-5, fall_s=2e-5)
    shot = shoot(slow)
    assert rms_rows(timing_of(slow, shot), shot, plan) < 0.02
    timing = timing_of(plan, shot)
    assert rms_rows(timing, shot, plan) < 0.02
    assert [timing.rise_s, timing.fall_s] == pytest.approx([2e-5, 2e-5], rel=0.1)


@pytest.mark.parametrize("tail_rows", [0.0, 0.1, pytest.param(0.2, marks=pytest.mark.campaign)])
def test_tails_of_a_part_of_a_row_are_found_or_claimed_where_nothing_moves(
    tail_rows: float, make_plan: PlanMaker
) -> None:
    """All flashes were up to 0.14 row late where 0.005 was claimed."""
    plan = make_plan(height_px=160, width_px=COLUMNS)
    tail_s = tail_rows * plan.camera.row_time_s
    shot = shoot(replace(plan, rise_s=tail_s, fall_s=tail_s))
    timing = timing_of(plan, shot)
    assert rms_rows(timing, shot, plan) < 3 * timing.phase_error_rows
    assert timing.phase_error_rows < 0.08


@pytest.mark.parametrize(("rise_s", "fall_s"), [(2e-5, 6e-5)])
def test_tails_far_shorter_than_the_time_from_row_to_row_are_found(
    rise_s: float, fall_s: float, make_plan: PlanMaker
) -> None:
    """A blur that reached only as far as these tails stood for them: all flashes were 25 us late, and 5 us claimed."""
    plan = make_plan(height_px=48, width_px=COLUMNS, fps=Fraction(30))
    assert max(rise_s, fall_s) < 0.1 * plan.camera.row_time_s
    shot = shoot(replace(plan, rise_s=rise_s, fall_s=fall_s), frames=120)
    timing = timing_of(plan, shot)
    assert [timing.rise_s, timing.fall_s] == pytest.approx([rise_s, fall_s], rel=0.15)
    assert rms_rows(timing, shot, plan) < 3 * timing.phase_error_rows < 0.02


@pytest.mark.parametrize("share", [0.01, pytest.param(0.03, marks=pytest.mark.campaign)])
def test_a_blur_between_rows_that_are_far_apart_in_time_is_not_taken_for_tails(
    share: float, make_plan: PlanMaker
) -> None:
    plan = make_plan(height_px=48, width_px=COLUMNS, fps=Fraction(30))
    shot = shoot(plan, frames=120)
    profiles = shot.frames.mean(axis=2, dtype=np.float64)
    padded = np.pad(profiles, ((0, 0), (1, 1)), mode="edge")
    blurred = (1 - 2 * share) * profiles + share * (padded[:, :-2] + padded[:, 2:])
    timing = timing_from_rows(plan, np.arange(len(profiles)), blurred)
    assert (timing.rise_s, timing.fall_s) == (0.0, 0.0)
    assert rms_rows(timing, shot, plan) < 0.02


def test_rows_that_are_blurred_are_not_taken_for_tails(plan: Plan) -> None:
    shot = shoot(plan)
    profiles = shot.frames.mean(axis=2, dtype=np.float64)
    padded = np.pad(profiles, ((0, 0), (1, 1)), mode="edge")
    timing = timing_from_rows(
        plan, np.arange(len(profiles)), 0.25 * padded[:, :-2] + 0.5 * profiles + 0.25 * padded[:, 2:]
    )
    assert (timing.rise_s, timing.fall_s) == (0.0, 0.0)
    assert rms_rows(timing, shot, plan) < 0.05


def strayed_s(timing: Timing, shot: Exposure) -> Doubles:
    """Return how far each complete flash is from the nearest true one."""
    true_s = np.array([flash.start_s for flash in shot.flashes])
    found = [flash for flash in timing.flashes if flash.complete and flash.lights]
    return np.array([np.abs(true_s - flash.start_s).min() for flash in found])


def test_flashes_that_stray_in_a_short_clip_are_followed_and_what_is_left_is_claimed(make_plan: PlanMaker) -> None:
    plan = make_plan(height_px=ROWS, width_px=COLUMNS)
    row_s = plan.camera.row_time_s
    shot = shoot(plan, frames=36, jitter_s=row_s)
    timing = timing_of(plan, shot)
    off_s = strayed_s(timing, shot)
    assert np.sqrt(np.mean(off_s**2)) < 2 * timing.phase_error_rows * row_s
    assert np.median(off_s) < 0.1 * row_s


def test_flashes_that_stray_are_followed_one_by_one(make_plan: PlanMaker) -> None:
    plan = make_plan(height_px=ROWS, width_px=COLUMNS, dark=False)
    shot = shoot(plan, jitter_s=1e-5)
    timing = timing_of(plan, shot)
    assert np.sqrt(np.mean(strayed_s(timing, shot) ** 2)) < 0.4e-5
    assert timing.phase_error_rows * timing.row_time_s < 1e-5


def test_flashes_that_stray_are_followed_where_few_rows_open_and_close_during_the_same_flash(
    make_plan: PlanMaker,
) -> None:
    plan = make_plan(height_px=96, width_px=COLUMNS, shutter=0.52, readout=0.55, duration_s=0.001)
    row_s = plan.camera.row_time_s
    ends = np.ones((96, 1), np.float32)
    ends[:14] = ends[-14:] = 0.04
    dim = {slot: plate * ends for slot, plate in plates(plan).items()}
    shot = shoot(plan, frames=60, jitter_s=0.3 * row_s, scene=dim, noise=Noise(full_well_e=8000, read_e=8))
    timing = timing_of(plan, shot)
    off_s = strayed_s(timing, shot)
    assert np.sqrt(np.mean(off_s**2)) < 2 * timing.phase_error_rows * row_s
    assert np.median(off_s) < 0.1 * row_s


@pytest.mark.parametrize(("full_well_e", "followed"), [(1500, True), (700, False)])
def test_flashes_that_stray_are_followed_or_in_the_error_where_rows_show_each_by_one_edge(
    full_well_e: float, followed: bool, make_plan: PlanMaker
) -> None:
    """No row opens in a flash that other rows close in: even and odd rows tell, since noise parts them."""
    plan = make_plan(height_px=128, width_px=COLUMNS, shutter=0.5, readout=0.41, duration_s=5e-4)
    row_s = plan.camera.row_time_s
    shot = shoot(plan, frames=80, jitter_s=0.08 * row_s, noise=Noise(full_well_e=full_well_e, read_e=8))
    timing = timing_of(plan, shot)
    off_s = strayed_s(timing, shot)
    assert not followed or np.median(off_s) < 0.03 * row_s
    assert np.sqrt(np.mean(off_s**2)) < 2 * timing.phase_error_rows * row_s


@pytest.mark.parametrize("dark", [True, False])
def test_flashes_of_different_lengths_are_timed_and_named(dark: bool, make_plan: PlanMaker) -> None:
    """Two lights, each long and short; without a dark slot the lengths alone show which is which, up to the light."""
    plan = make_plan(height_px=ROWS, width_px=COLUMNS, dark=dark)
    each = [("key", 0.0008), ("key", 0.0002), ("left", 0.0008), ("left", 0.0004)]
    lit = tuple(PlannedFlash(lights={name: 1.0}, duration_s=duration_s) for name, duration_s in each)
    plan = replace(plan, flashes=lit + plan.flashes[3:])
    shot = shoot(plan)
    timing = timing_of(plan, shot)
    assert rms_rows(timing, shot, plan) < 0.05
    assert timing.order == "marker"


def test_flashes_of_two_lights_that_clip_together_are_neither_flicker_nor_tails(plan: Plan) -> None:
    """Rows that split such a flash are the only ones that do not clip: what they say must not be outvoted."""
    patterns = [{"a": 1.0, "b": 1.0}, {"b": 1.0, "c": 1.0}, {"a": 1.0, "c": 1.0}]
    plan = replace(plan, flashes=tuple(PlannedFlash(lights=one, duration_s=0.0008) for one in patterns))
    shot = shoot(plan, scene=plates(plan, bright=1.2), frames=96)
    frames = (MemoryFrame(n, image) for n, image in enumerate(shot.frames))
    index, profiles, doubt = collect_with_doubt(frames)
    assert (shot.frames >= 0.998).mean() > 0.4
    timing = timing_from_rows(plan, index, profiles, doubt=doubt)
    true_s = np.array([flash.start_s for flash in shot.flashes])
    error_s = np.array([np.abs(true_s - flash.start_s).min() for flash in timing.flashes])
    assert np.sqrt(np.mean(error_s**2)) < 0.01 * plan.camera.row_time_s
    assert timing.notes == ()
