"""From a request to the plan, with its figures and cautions: the one call behind ``psvideo capture-plan``."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from psvideo.capture.caution import Caution
from psvideo.capture.cautions import request_cautions, shoot_cautions
from psvideo.capture.request import ShootRequest
from psvideo.capture.wish import LONG_MARKER, longest_flash, refuse_blur_of_unknown_speed
from psvideo.errors import UsageError
from psvideo.model.cost.shoot_figures import ShootFigures, shoot_figures
from psvideo.model.maximal_length import TAPS
from psvideo.model.plan import UNKNOWN_CLOCK_PPM, Plan, PlannedFlash, assemble_plan
from psvideo.model.units import no_less, show_seconds

DARK_SLOT_EVERY_S = 0.5
"""Dark slots come about twice a second, where a board holds that many flashes: often enough to follow ambient light,
below any flicker that is felt."""


MOST_CYCLE_S = 60.0
"""No board plays a longer cycle (lights/protocol.md)."""
BOARD_STEPS = 240
"""Flashes of a cycle that every known board holds (lights/protocol.toml)."""


@dataclass(frozen=True, kw_only=True)
class Shoot:
    """A planned shoot. ``chosen`` says what decided the flash where the user left its duration open."""

    plan: Plan
    figures: ShootFigures
    cautions: tuple[Caution, ...]
    chosen: str | None


def plan_shoot(request: ShootRequest) -> Shoot:
    """Plan the shoot. Raises UsageError that names the option where what is asked for cannot be."""
    chosen = None
    flash_s = request.flash_s
    refuse_blur_of_unknown_speed(request.limits)
    if flash_s is None:
        bound = longest_flash(request)
        flash_s = dict.fromkeys(request.lights, bound.flash_s)
        chosen = f"{show_seconds(bound.flash_s)}, decided by {bound.why}"
    plan = make_plan(request, flash_s)
    _refuse_slow(plan)
    figures = shoot_figures(plan, speed_px_s=request.limits.speed_px_s)
    cautions = request_cautions(request) + shoot_cautions(plan, figures, limits=request.limits)
    return Shoot(plan=plan, figures=figures, cautions=cautions, chosen=chosen)


def make_plan(request: ShootRequest, flash_s: Mapping[str, float]) -> Plan:
    """Return the plan: one flash per light in the order of the lights, and the marker.

    A long marker is the first light's flash; a dark slot ends the round and takes the shortest flash's duration. A
    coded marker keeps the dark slot in the rounds of the longest code that every board plays.
    """
    lit = [_lit(request, name, flash_s[name], is_first=index == 0) for index, name in enumerate(request.lights)]
    dark = []
    if request.marker in ("dark", "coded"):
        dark_slot_s = request.dark_slot_s or min(flash.duration_s for flash in lit)
        dark = [PlannedFlash(lights={}, duration_s=dark_slot_s)]
    flashes = (*lit, *dark)
    _refuse_overfull(request, max(flash.duration_s for flash in flashes))
    plan = assemble_plan(
        camera=request.camera,
        flashes=flashes,
        dark_s=request.dark_s,
        mode=request.mode,
        clock_tolerance_ppm=request.clock_tolerance_ppm,
    )
    _refuse_short_dark(request, plan.dark_s)
    if not dark:
        return plan
    if request.marker == "coded":
        return replace(plan, dark_code=_longest_code(len(lit)))
    round_s = sum(flash.duration_s + plan.dark_s for flash in lit)
    dark_slot_s += plan.dark_s
    most = _most_dark_every(len(lit), round_s, dark_slot_s)
    if request.dark_every is not None:
        cycle_s = request.dark_every * round_s + dark_slot_s
        _refuse_long_cycle(request.dark_every, most, lights=len(lit), cycle_s=cycle_s)
    return replace(plan, dark_every=request.dark_every or min(most, math.ceil(DARK_SLOT_EVERY_S / round_s)))


def _most_dark_every(lights: int, round_s: float, dark_slot_s: float) -> int:
    """Return how many rounds a cycle with one dark slot can have that every board holds and plays, 1 at least."""
    return max(1, min((BOARD_STEPS - 1) // lights, int((MOST_CYCLE_S - dark_slot_s) / round_s)))


def _refuse_long_cycle(dark_every: int, most: int, *, lights: int, cycle_s: float) -> None:
    if dark_every > most:
        raise UsageError(
            f"`dark_every` {dark_every}: the cycle would be {dark_every * lights + 1} flashes in "
            f"{cycle_s:.3g} s, and boards hold {BOARD_STEPS} flashes and play {MOST_CYCLE_S:.0f} s at "
            f"most. Give {most}{' or fewer' if most > 1 else ''}."
        )


def _refuse_slow(plan: Plan) -> None:
    if plan.mode != "synced" and plan.cycle_s > MOST_CYCLE_S:
        raise UsageError(
            f"The cycle would be {plan.cycle_s:.3g} s long, and no board plays more than {MOST_CYCLE_S:.0f} s. Give a "
            "shorter `dark_s`, shorter flashes, or fewer lights."
        )


def _longest_code(lights: int) -> int:
    """Return the order of the longest code whose cycle of this many lights every board plays."""
    steps = {order: lights * (2**order - 1) + 2 ** (order - 1) for order in TAPS}
    playable = [order for order, count in steps.items() if count <= BOARD_STEPS]
    if not playable:
        raise UsageError(
            f"`marker` coded: the shortest code of {lights} lights is a cycle of {min(steps.values())} flashes, and a "
            f"board holds {BOARD_STEPS}. Take fewer lights, or leave `marker` dark."
        )
    return max(playable)


def _lit(request: ShootRequest, name: str, duration_s: float, *, is_first: bool) -> PlannedFlash:
    is_marker = is_first and request.marker == "long"
    return PlannedFlash(lights={name: request.power[name]}, duration_s=duration_s * (LONG_MARKER if is_marker else 1.0))


def _refuse_overfull(request: ShootRequest, longest_s: float) -> None:
    exposure_s = request.camera.exposure_s
    if longest_s > exposure_s:
        raise UsageError(
            f"A flash of {show_seconds(longest_s)} is longer than the exposure of {show_seconds(exposure_s)}, so no "
            "row can "
            "hold all of it. Give a shorter `flash_s`, or a slower `fps`."
        )


def _refuse_short_dark(request: ShootRequest, dark_s: float) -> None:
    exposure_s = request.camera.exposure_s
    if request.mode != "synced" and dark_s < exposure_s * (1 - 1e-9):
        ppm = UNKNOWN_CLOCK_PPM if request.clock_tolerance_ppm is None else request.clock_tolerance_ppm
        raise UsageError(
            f"A dark time of {show_seconds(dark_s)} is shorter than the exposure of {show_seconds(exposure_s)}: some "
            "rows "
            f"would hold two flashes, which nothing can part again (eq. 1). Leave `dark_s` out, or give at least "
            f"{no_less(exposure_s / (1 - ppm * 1e-6) * 1e3, figures=6):.6g}ms, the exposure and the clocks' margin."
        )
