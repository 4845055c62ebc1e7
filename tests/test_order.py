"""The order of the lights from a rig's directions: told where the rig tells it, refused where it cannot."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from psvideo.order import alike_turns, order_by_rig, turned
from psvideo.plan import Plan
from psvideo.rig import Light, Rig
from psvideo.timing import Flash, Timing

PlanMaker = Callable[..., Plan]
NAMES = ("a", "b", "c", "d", "e")


def ring(degrees: Sequence[float], heights: Sequence[float]) -> Rig:
    lights = []
    for name, turn, height in zip(NAMES, np.radians(degrees), heights, strict=False):
        across = np.sqrt(1 - height**2)
        direction = (float(across * np.cos(turn)), float(across * np.sin(turn)), height)
        lights.append(Light(name=name, intensity=(1.0,), direction=direction))
    return Rig(lights=tuple(lights))


def pictures(plan: Plan, rig: Rig, turn: int) -> dict[int, np.ndarray]:
    """A bump under the rig's lights; the slots are named ``turn`` places too early."""
    y, x = np.mgrid[-1:1:24j, -1:1:24j]
    normals = np.stack([0.5 * x, 0.5 * y, np.ones_like(x)], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    rng = np.random.default_rng(1)
    albedo = rng.uniform(0.3, 0.8, x.shape)
    shown = [(albedo * np.clip(normals @ np.array(light.direction), 0, None)) for light in rig.lights]
    noisy = [picture + 0.003 * rng.standard_normal(x.shape) for picture in shown]
    return {slot: noisy[(slot + turn) % len(noisy)].astype(np.float32) for slot in plan.lit_slots}


@pytest.mark.parametrize("turn", range(5))
def test_an_irregular_rig_tells_the_turn(turn: int, make_plan: PlanMaker) -> None:
    plan = make_plan(lights=NAMES, dark=False)
    rig = ring([0, 50, 130, 200, 300], [0.8, 0.6, 0.9, 0.7, 0.75])
    assert order_by_rig(plan, rig, pictures(plan, rig, turn)) == turn


def test_a_regular_ring_tells_nothing(make_plan: PlanMaker) -> None:
    plan = make_plan(lights=NAMES, dark=False)
    rig = ring([0, 72, 144, 216, 288], [0.8] * 5)
    assert order_by_rig(plan, rig, pictures(plan, rig, 2)) is None


def test_three_lights_fit_any_picture(make_plan: PlanMaker) -> None:
    plan = make_plan(lights=NAMES[:3], dark=False)
    rig = ring([0, 100, 220], [0.8, 0.6, 0.9])
    assert order_by_rig(plan, rig, pictures(plan, rig, 1)) is None


def test_a_dark_slot_leaves_no_turn(make_plan: PlanMaker) -> None:
    assert alike_turns(make_plan(dark=True)) == (0,)
    assert alike_turns(make_plan(dark=False)) == (0, 1, 2)


def test_turning_renames_the_flashes_and_nothing_else(make_plan: PlanMaker) -> None:
    plan = make_plan(dark=False)
    flash = Flash(index=0, slot=2, lights=plan.flashes[2].lights, start_s=0.1, duration_s=0.001, complete=True)
    timing = Timing(
        clip="",
        frame_period_s=0.01,
        exposure_s=0.01,
        row_time_s=1e-5,
        clock_offset_ppm=0.0,
        phase_error_rows=0.0,
        order="guess",
        flashes=(flash,),
    )
    assert turned(plan, timing, 1).flashes == (replace(flash, slot=0, lights=plan.flashes[0].lights),)
    assert turned(plan, timing, 0) == timing
