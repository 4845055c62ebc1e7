"""The standard errors that come with a timing are true: over many clips, errors made are as large as errors claimed."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from psvideo.model.plan import Plan
from psvideo.model.timing import Timing
from psvideo.sync.find import timing_from_rows
from psvideo.sync.rowfit.standard_error import standard_error_of
from psvideo.synth import Noise, TrueClock, expose

PlanMaker = Callable[..., Plan]
SEEDS = 40
ROWS, COLUMNS, FRAMES = 48, 4, 32
CAMERA_NOISE, HEAVY_NOISE = Noise(full_well_e=20_000, read_e=8), Noise(full_well_e=400, read_e=8)


def timed(plan: Plan, stated: Plan, seed: int, noise: Noise) -> tuple[Timing, float]:
    """Film a textured scene and time it by the plan ``stated``; return too the RMS error in seconds."""
    rng = np.random.default_rng(seed)
    plates: dict[int, np.ndarray] = {slot: 0.2 + 0.5 * rng.random((ROWS, COLUMNS)) for slot in plan.lit_slots}
    clock = TrueClock(phase_s=rng.uniform(0, plan.cycle_s), offset_ppm=rng.uniform(-100, 100))
    shot = expose(plates, plan, frames=FRAMES, clock=clock, noise=noise, bits=12, seed=seed)
    timing = timing_from_rows(stated, np.arange(FRAMES), shot.frames.mean(axis=2, dtype=np.float64))
    true_s = np.array([flash.start_s for flash in shot.flashes])
    off_s = timing.start_s - true_s[np.abs(true_s[:, None] - timing.start_s).argmin(axis=0)]
    return timing, float(np.sqrt(np.mean(off_s**2)))


KINDS = {
    "clean": ({}, CAMERA_NOISE, False),
    "heavy noise": ({}, HEAVY_NOISE, False),
    "readout unknown": ({"readout": 0.7}, CAMERA_NOISE, True),
}


@pytest.mark.parametrize(
    "kind", [kind if kind == "clean" else pytest.param(kind, marks=pytest.mark.campaign) for kind in KINDS]
)
def test_errors_made_are_those_that_are_claimed(kind: str, make_plan: PlanMaker) -> None:
    options, noise, unknown = KINDS[kind]
    plan = make_plan(height_px=ROWS, width_px=COLUMNS, **options)
    stated = replace(plan, camera=replace(plan.camera, readout_s=None)) if unknown else plan
    found = [timed(plan, stated, seed, noise) for seed in range(SEEDS)]
    ratios = np.array([error_s / (timing.phase_error_rows * timing.row_time_s) for timing, error_s in found])
    assert 0.7 < np.sqrt(np.mean(ratios**2)) < 1.4
    if unknown:
        off_s = np.array([timing.row_time_s - plan.camera.row_time_s for timing, _ in found])
        claimed_s = np.array([timing.row_time_error_s for timing, _ in found], np.float64)
        assert 0.6 < np.sqrt(np.mean((off_s / claimed_s) ** 2)) < 1.6


def test_an_unknown_that_rows_do_not_determine_is_not_known_at_all() -> None:
    assert standard_error_of(4e-12) == 2e-6
    assert standard_error_of(-1e-20) == np.inf


@pytest.mark.campaign
def test_what_black_cuts_off_noise_adds_to_rows_that_saw_little_is_in_the_error(make_plan: PlanMaker) -> None:
    """Where a file's black cuts off noise, dark rows are too bright: opening and closing edges err, each in its way."""
    plan = make_plan(height_px=96, width_px=64, shutter=0.5, readout=0.65, duration_s=6e-4, lights=tuple("abcdef"))
    ratios = []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        plates = {slot: (0.1 + 0.4 * rng.random((96, 64))).astype(np.float32) for slot in plan.lit_slots}
        clock = TrueClock(phase_s=rng.uniform(0, plan.cycle_s), offset_ppm=rng.uniform(-100, 100))
        noise = Noise(full_well_e=20_000, read_e=30)
        shot = expose(plates, plan, frames=30, clock=clock, noise=noise, bits=12, seed=seed)
        timing = timing_from_rows(plan, np.arange(30), np.maximum(shot.frames, 0).mean(axis=2, dtype=np.float64))
        true_s = np.array([flash.start_s for flash in shot.flashes])
        off_s = timing.start_s - true_s[np.abs(true_s[:, None] - timing.start_s).argmin(axis=0)]
        ratios.append(np.sqrt(np.mean(off_s**2)) / (timing.phase_error_rows * timing.row_time_s))
    assert 0.5 < np.sqrt(np.mean(np.square(ratios))) < 1.7
    assert np.max(ratios) < 2.3


@pytest.mark.parametrize(("power", "nominal"), [(1.02, 1.0), (0.98, 1.0), (0.98, 1.0003)])
@pytest.mark.campaign
def test_a_curve_that_is_two_percent_off_is_no_other_exposure(
    power: float, nominal: float, make_plan: PlanMaker
) -> None:
    """Freed, the exposure would move all flashes by half of what it seems to be off; a plan's that truly is, does."""
    plan = make_plan(height_px=96, width_px=16, shutter=0.5, readout=0.7)
    stated = replace(plan, camera=replace(plan.camera, exposure_s=nominal * plan.camera.exposure_s))
    ratios, off_rows = [], []
    for seed in range(4):
        rng = np.random.default_rng(seed)
        plates = {slot: (0.2 + 0.5 * rng.random((96, 16))).astype(np.float32) for slot in plan.lit_slots}
        clock = TrueClock(phase_s=rng.uniform(0, plan.cycle_s), offset_ppm=rng.uniform(-100, 100))
        shot = expose(plates, plan, frames=40, clock=clock, noise=CAMERA_NOISE, bits=12, seed=seed)
        read = np.maximum(shot.frames, 0.0) ** power
        timing = timing_from_rows(stated, np.arange(40), read.mean(axis=2, dtype=np.float64))
        true_s = np.array([flash.start_s for flash in shot.flashes])
        off_s = timing.start_s - true_s[np.abs(true_s[:, None] - timing.start_s).argmin(axis=0)]
        off_rows.append(float(np.sqrt(np.mean(off_s**2))) / timing.row_time_s)
        ratios.append(off_rows[-1] / timing.phase_error_rows)
    assert np.max(off_rows) < 0.02
    assert np.sqrt(np.mean(np.square(ratios))) < 1.5
    assert np.max(ratios) < 2.5
