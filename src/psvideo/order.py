"""Which light is which, from the rig's known directions: for plans whose cycle has no marker.

Turning the names by one flash changes nothing in when light comes, but it does in where it comes from. A matte surface
fits the right directions and misfits the others, unless the rig looks the same after the turn (a regular ring), or has
only three lights, which any picture fits. Then nothing is claimed.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from psvideo.camera import FloatArray
from psvideo.plan import Plan
from psvideo.rig import Light, Rig
from psvideo.timing import Timing

Image = NDArray[np.float32]

WELL, CLEARLY = 0.1, 2.0
"""The right turn leaves less than this share of the light unexplained, and every other one that many times more."""
LIT, SATURATED = 0.05, 0.95
"""Pixels count that every flash lights at least so much of the brightest one, and none of them saturates."""
LEAST_PIXELS = 50


def alike_turns(plan: Plan) -> tuple[int, ...]:
    """Return by how many flashes the cycle can be turned without a change in when light comes, 0 first."""
    kinds = [(plan.flashes[slot].duration_s, plan.flashes[slot].is_dark) for slot in plan.cycle_slots]
    return tuple(turn for turn in range(len(kinds)) if kinds[turn:] + kinds[:turn] == kinds)


def turned(plan: Plan, timing: Timing, turn: int) -> Timing:
    """Return the timing with every flash named as the one ``turn`` places further on in the cycle."""
    cycle = plan.cycle_slots
    slots = {slot: cycle[(cycle.index(slot) + turn) % len(cycle)] for slot in cycle}
    flashes = tuple(
        replace(flash, slot=slots[flash.slot], lights=plan.flashes[slots[flash.slot]].lights)
        for flash in timing.flashes
    )
    return replace(timing, flashes=flashes)


def order_by_rig(plan: Plan, rig: Rig, plates: Mapping[int, Image]) -> int | None:
    """Return the turn of the cycle that the rig's directions tell, or None where they do not tell it.

    ``plates`` holds a small linear picture, (row, col) or (row, col, channel), ambient light taken off, for every lit
    slot as it is named so far. Raises PsvideoError where the rig lacks a light of the plan.
    """
    lights = {light.name: light for light in rig.select(plan.lights)}
    turns = alike_turns(plan)
    redundant = len(plan.lit_slots) > 3
    if (
        not redundant
        or len(plan.cycle_slots) != len(plan.flashes)
        or any(light.direction is None for light in lights.values())
    ):
        return None
    light = np.stack(
        [plates[slot].reshape(*plates[slot].shape[:2], -1).mean(axis=2).ravel() for slot in plan.lit_slots]
    )
    shown = (light.min(axis=0) > LIT * light.max(axis=0)) & (light.max(axis=0) < SATURATED)
    shown &= light.max(axis=0) > 0.1 * np.percentile(light, 99)
    if shown.sum() < LEAST_PIXELS or len(turns) < 2:
        return None
    left = [_misfit(_directions(plan, lights, turn), light[:, shown].astype(np.float64)) for turn in turns]
    order = np.argsort(left)
    sure = left[order[0]] < WELL and left[order[1]] > CLEARLY * left[order[0]] + 1e-3
    return turns[order[0]] if sure else None


def _directions(plan: Plan, lights: Mapping[str, Light], turn: int) -> FloatArray:
    """Return the light vector that each lit slot's picture would show after a turn, shape (lit slot, 3)."""
    cycle = plan.cycle_slots
    vectors = []
    for slot in plan.lit_slots:
        flash = plan.flashes[cycle[(cycle.index(slot) + turn) % len(cycle)]]
        parts = [
            power * flash.duration_s * float(np.mean(lights[name].intensity)) * np.asarray(lights[name].direction)
            for name, power in flash.lights.items()
            if power > 0
        ]
        vectors.append(np.sum(parts, axis=0))
    return np.array(vectors, np.float64)


def _misfit(directions: FloatArray, light: FloatArray) -> float:
    """Return the share of the light (slot, pixel) that no surface explains; 1 where most normals would face away."""
    normals, *_ = np.linalg.lstsq(directions, light, rcond=None)
    rest = light - directions @ normals
    share = np.sqrt((rest**2).sum(axis=0) / (light**2).sum(axis=0))
    return 1.0 if np.median(normals[2]) <= 0 else float(np.median(share))
