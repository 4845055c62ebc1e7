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
