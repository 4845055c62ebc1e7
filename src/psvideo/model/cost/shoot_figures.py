"""The figures that decide a shoot, as a pure function of the plan.

The paper's equations are special cases: with dark time = exposure = frame period the rate of flashes is eq. 5 and 6,
for flashes of different length eq. 15; the dark row's move is eq. 13.
"""

import math
from collections import Counter
from dataclasses import dataclass

from psvideo.model.cost.rows_of_flashes import dark_row_move_px, frames_per_flash, row_shares
from psvideo.model.plan import Plan, PlannedFlash

SEIZURE_HZ = (3.0, 70.0)
"""Flashes at these rates can harm people with photosensitive epilepsy (IEEE 1789-2015)."""
LEAST_MISSING = 0.005
"""A smaller share of missing rows, which rounds to 0 %, is not worth a word."""


@dataclass(frozen=True, kw_only=True)
class SlotFigures:
    """One flash of the round.

    ``light_share``: what a row receives against the same lights left on at full power for the exposure, and ``stops``
    the same as a number of stops lost. ``partial_row_share`` and ``missing_row_share``: of the rows of its plate, mean
    over all start phases, those that no single frame holds whole, and those that no frame saw at all (below 360°).
    ``frames_min`` to ``frames_max`` frames see something of the flash, the larger number for ``most_frames_share`` of
    the start phases; None where the readout is unknown. ``dark_row_move_px``: how many rows further down than the dark
    row before this flash the nearest dark row of the next frame (in half-rate mode of the next but one) lies; None
    where no dark row is seen in both.
    """

    slot: int
    label: str
    is_dark: bool
    duration_s: float
    light_share: float
    stops: float | None
    partial_row_share: float
    missing_row_share: float
    frames_min: int | None
    frames_max: int | None
    most_frames_share: float | None
    dark_row_move_px: float | None
    blur_px: float | None


@dataclass(frozen=True, kw_only=True)
class LightFigures:
    """One light: how often it flashes, and for what share of the time it is on (``duty``, power not counted)."""

    name: str
    rate_hz: float
    duty: float
    longest_pulse_s: float


@dataclass(frozen=True, kw_only=True)
class ShootFigures:
    """The whole shoot, in strobe time. ``motion_*_px`` are how far the subject moves at the given speed, else None.

    ``flash_rate_hz`` counts lit flashes, ``result_rate_hz`` rounds (each gives one result), ``dark_slot_rate_hz`` dark
    slots. ``margin_ppm`` is how much faster than nominal the strobe may run against the camera before rows hold two
    flashes; negative where they do already, None in synced mode.
    """

    flash_rate_hz: float
    result_rate_hz: float
    dark_slot_rate_hz: float
    round_s: float
    cycle_s: float
    partial_row_share: float
    missing_row_share: float
    margin_ppm: float | None
    motion_per_flash_px: float | None
    motion_per_round_px: float | None
    slots: tuple[SlotFigures, ...]
    lights: tuple[LightFigures, ...]

    @property
    def pattern_hz(self) -> float | None:
        """The lowest rate, of 3 Hz or more, at which a pattern of dark slots that is longer than a round flickers: they
        come unevenly, so the light swings at multiples of the cycle's rate, however many there are a second. None where
        they come in each round, once a cycle, or less than three times a second."""
        even = self.cycle_s < 1.5 * self.round_s or self.dark_slot_rate_hz * self.cycle_s < 1.5
        if even or self.dark_slot_rate_hz < SEIZURE_HZ[0]:
            return None
        return max(math.ceil(SEIZURE_HZ[0] * self.cycle_s), 1) / self.cycle_s


def shoot_figures(plan: Plan, *, speed_px_s: float | None = None) -> ShootFigures:
    """Return the figures of a plan; ``speed_px_s`` is how fast the subject moves in the picture."""
    times = Counter(plan.cycle_slots)
    lit = sum(times[slot] for slot in plan.lit_slots)
    slots = tuple(_slot_figures(plan, slot, speed_px_s) for slot in range(len(plan.flashes)))
    cycle_s = cycle_length_s(plan)

    def mean(share: str) -> float:
        return float(sum(times[slot] * getattr(slots[slot], share) for slot in plan.lit_slots) / lit)

    no_margin = plan.mode == "synced" or not plan.dark_s  # flashes without a dark time between them have none to lose
    margin_ppm = None if no_margin else (1 - plan.camera.exposure_s / plan.dark_s) * 1e6
    return ShootFigures(
        flash_rate_hz=lit / cycle_s,
        result_rate_hz=len(plan.dark_rounds) / cycle_s,
        dark_slot_rate_hz=(len(plan.cycle_slots) - lit) / cycle_s,
        round_s=cycle_s / len(plan.dark_rounds),
        cycle_s=cycle_s,
        partial_row_share=mean("partial_row_share"),
        missing_row_share=mean("missing_row_share"),
        margin_ppm=margin_ppm,
        motion_per_flash_px=None if speed_px_s is None else speed_px_s * cycle_s / lit,
        motion_per_round_px=None if speed_px_s is None else speed_px_s * cycle_s / len(plan.dark_rounds),
        slots=slots,
        lights=tuple(_light_figures(plan, name, times) for name in plan.lights),
    )


def cycle_length_s(plan: Plan) -> float:
    """Return how long a cycle takes: what the strobe plays by itself, or one frame per flash where it is triggered."""
    return len(plan.cycle_slots) * plan.camera.frame_period_s if plan.mode == "synced" else plan.cycle_s


def slot_label(flash: PlannedFlash) -> str:
    """Return the lights that a flash has on, as people call them; ``dark slot`` where none is."""
    return "+".join(flash.lit) or "dark slot"


def _slot_figures(plan: Plan, slot: int, speed_px_s: float | None) -> SlotFigures:
    flash = plan.flashes[slot]
    shines_s = min(flash.duration_s, plan.camera.exposure_s)
    share = max(flash.lights.values(), default=0.0) * shines_s / plan.camera.exposure_s
    partial, missing = row_shares(plan, flash.duration_s)
    frames = frames_per_flash(plan, flash.duration_s)
    return SlotFigures(
        slot=slot,
        label=slot_label(flash),
        is_dark=flash.is_dark,
        duration_s=flash.duration_s,
        light_share=share,
        stops=-math.log2(share) if share > 0 else None,
        partial_row_share=partial,
        missing_row_share=missing,
        frames_min=frames[0] if frames else None,
        frames_max=frames[1] if frames else None,
        most_frames_share=frames[2] if frames else None,
        dark_row_move_px=dark_row_move_px(plan, slot),
        blur_px=None if speed_px_s is None else speed_px_s * flash.duration_s,
    )


def _light_figures(plan: Plan, name: str, times: Counter[int]) -> LightFigures:
    cycle_s = cycle_length_s(plan)
    own = [slot for slot, flash in enumerate(plan.flashes) if name in flash.lit]
    return LightFigures(
        name=name,
        rate_hz=sum(times[slot] for slot in own) / cycle_s,
        duty=sum(times[slot] * plan.flashes[slot].duration_s for slot in own) / cycle_s,
        longest_pulse_s=max(plan.flashes[slot].duration_s for slot in own),
    )
