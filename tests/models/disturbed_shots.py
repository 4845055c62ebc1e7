"""Virtual shots of rows whose clock, pulses or frames are disturbed, and how far times found are off."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from psvideo.model.plan import Plan
from psvideo.model.timing import Timing
from psvideo.sync.find import timing_from_rows
from psvideo.synth import Exposure, Noise, TrueClock, expose

PlanMaker = Callable[..., Plan]


NOISE = Noise(full_well_e=20_000, read_e=8)
ROWS, COLUMNS = 96, 12


def plates(plan: Plan, seed: int = 3, bright: float = 1.0) -> dict[int, np.ndarray]:
    """One picture a slot: noise under a gradient, in proportion to the flash's length and powers."""
    rng = np.random.default_rng(seed)
    shape = (plan.camera.height_px, plan.camera.width_px)
    pictures = {name: bright * (0.2 + 0.5 * rng.random(shape)) for name in plan.lights}
    longest_s = max(flash.duration_s for flash in plan.flashes)
    return {
        slot: np.asarray(
            sum(power * pictures[name] for name, power in plan.flashes[slot].lights.items())
            * (plan.flashes[slot].duration_s / longest_s),
            np.float32,
        )
        for slot in plan.lit_slots
    }


def shoot(plan: Plan, *, frames: int = 72, ppm: float = 30.0, drift: float = 0.0, **options: Any) -> Exposure:
    clock = TrueClock(
        phase_s=0.0123, offset_ppm=ppm, drift_ppm_per_s=drift, jitter_s=float(options.pop("jitter_s", 0.0))
    )
    scene = options.pop("scene", None) or plates(plan)
    asked: dict[str, Any] = {"noise": NOISE, "bits": 12} | options
    return expose(scene, plan, frames=frames, clock=clock, **asked)


def timing_of(plan: Plan, shot: Exposure, *, indices: object = None, **options: object) -> Timing:
    """Time the shot by its frames' true indices, unless others are said."""
    said = np.arange(len(shot.frames)) if indices is None else np.asarray(indices)
    return timing_from_rows(plan, said, shot.frames.mean(axis=2, dtype=np.float64), **options)  # type: ignore[arg-type]


def rms_rows(timing: Timing, shot: Exposure, plan: Plan, scale: float = 1.0) -> float:
    """Return the RMS distance of every flash found from the nearest true flash with the same lights, in true rows."""
    error_s = []
    for flash in timing.flashes:
        alike = [true.start_s * scale for true in shot.flashes if dict(true.lights) == dict(flash.lights)]
        error_s.append(np.abs(np.array(alike) - flash.start_s).min())
    row_s = abs(plan.camera.row_time_s) or plan.camera.frame_period_s / plan.camera.height_px
    return float(np.sqrt(np.mean(np.square(error_s)))) / row_s


def unknown_readout(plan: Plan) -> Plan:
    return replace(plan, camera=replace(plan.camera, readout_s=None))
