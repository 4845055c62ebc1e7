"""The capture plan: which lights flash, how long, how far apart, and for which camera.

A plan is frozen data that expands to arrays of flash times; it neither acts nor draws. A *round* is one pass through
the list of flashes. Dark slots are kept in every ``dark_every``-th round, or in those that a code names; the others
skip them. The *cycle*, which repeats exactly, is as many rounds as that pattern has. Flash ``k + 1`` starts
``duration_s[k] + dark_s`` after flash ``k`` starts, in seconds of the strobe's clock (Hudon et al. 2015, eq. 1 and 14).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles
from psvideo.model.camera import Camera
from psvideo.model.maximal_length import maximal_length

Mode = Literal["rolling", "half-rate", "synced"]

UNKNOWN_CLOCK_PPM = 10_000.0
"""How far apart clocks of unknown tolerance are at most (a resonator-driven board is off by 2,000 to 5,000)."""


class HasLights:
    """What has the power (0 to 1) of lights by name: a flash of the plan, of a clip, of the virtual shoot."""

    lights: Mapping[str, float]

    @property
    def lit(self) -> tuple[str, ...]:
        """The names of the lights that are on, in the order in which they are listed; one of power 0 is off."""
        return tuple(name for name, power in self.lights.items() if power > 0)

    @property
    def is_dark(self) -> bool:
        """True for a dark slot: no light is on; it shows the ambient light and marks the cycle."""
        return not self.lit


@dataclass(frozen=True, kw_only=True)
class PlannedFlash(HasLights):
    """One flash of a round: the power (0 to 1) of every light that is on, and its length on the strobe's clock."""

    lights: Mapping[str, float]
    duration_s: float


@dataclass(frozen=True, kw_only=True)
class FlashTrain:
    """Consecutive flashes as arrays of shape (flash,): slot in the round's list, start and length in strobe seconds."""

    slot: NDArray[np.intp]
    start_s: Doubles
    duration_s: Doubles


@dataclass(frozen=True, kw_only=True)
class Plan:
    """What the strobe plays and the camera records.

    Attributes
    ----------
    camera
        Size, rate, exposure, readout and how its files code light.
    flashes
        One round, in order: of each flash the lights with their power, 0 to 1, and its duration. No light: a dark slot.
    dark_s
        From a flash's end to the next one's start, in seconds.
    mode
        "rolling", "half-rate" or "synced" (one flash per frame).
    rise_s, fall_s
        The LEDs' 1/e times in seconds.
    clock_tolerance_ppm
        How far the strobe's and the camera's clocks may be apart; None where that is unknown.
    dark_every
        Dark slots are kept only in every Nth round.
    dark_code
        The order of a maximal-length sequence: dark slots are kept in the rounds in which it is 1. 0: no code.
    """

    camera: Camera
    flashes: tuple[PlannedFlash, ...]
    dark_s: float
    mode: Mode = "rolling"
    rise_s: float = 0.0
    fall_s: float = 0.0
    clock_tolerance_ppm: float | None = 100.0
    dark_every: int = 1
    dark_code: int = 0

    @cached_property
    def lights(self) -> tuple[str, ...]:
        """The lights' names in the order in which the plan first lights them."""
        return tuple(dict.fromkeys(name for flash in self.flashes for name in flash.lit))

    @cached_property
    def lit_slots(self) -> tuple[int, ...]:
        """The slots in which any light is on."""
        return tuple(slot for slot, flash in enumerate(self.flashes) if not flash.is_dark)

    @cached_property
    def shortest_flash_s(self) -> float:
        """How long the shortest flash lasts that lights anything. Raises ValueError where all slots are dark."""
        return min(self.flashes[slot].duration_s for slot in self.lit_slots)

    @cached_property
    def dark_rounds(self) -> tuple[bool, ...]:
        """Which rounds of a cycle keep their dark slots, the first always."""
        return maximal_length(self.dark_code) if self.dark_code else (True, *[False] * (self.dark_every - 1))

    @cached_property
    def cycle_slots(self) -> tuple[int, ...]:
        """The slots of one cycle, round by round, with dark slots in those that keep them."""
        every, lit = tuple(range(len(self.flashes))), self.lit_slots
        return tuple(slot for dark in self.dark_rounds for slot in (every if dark else lit))

    @property
    def clock_range_ppm(self) -> float:
        """How far the strobe's clock may be from the camera's, either way."""
        return UNKNOWN_CLOCK_PPM if self.clock_tolerance_ppm is None else self.clock_tolerance_ppm

    @cached_property
    def cycle_s(self) -> float:
        """The cycle's length in strobe seconds."""
        return sum(self.flashes[slot].duration_s + self.dark_s for slot in self.cycle_slots)

    @property
    def marker_s(self) -> float:
        """How long a stretch shows the place in the cycle: a cycle, or a whole run of a code and a round to spare."""
        return self.cycle_s * min(1.0, (self.dark_code + 1) / len(self.dark_rounds) if self.dark_code else 1.0)

    @property
    def power(self) -> Doubles:
        """The power matrix of the lit slots, shape (lit slot, light)."""
        rows = [[self.flashes[slot].lights.get(name, 0.0) for name in self.lights] for slot in self.lit_slots]
        return np.array(rows, np.float64).reshape(len(self.lit_slots), len(self.lights))

    @cached_property
    def _cycle(self) -> tuple[NDArray[np.intp], Doubles, Doubles]:
        """Slots, starts and lengths of one cycle's flashes: a fit asks for its train some hundred times."""
        slots = np.array(self.cycle_slots, np.intp)
        durations_s = np.array([self.flashes[slot].duration_s for slot in slots], np.float64)
        return slots, np.concatenate([[0.0], np.cumsum(durations_s + self.dark_s)[:-1]]), durations_s

    def powers(self, light: str) -> tuple[float, ...]:
        """Return a light's power in every flash of the list, 0 where it is off."""
        return tuple(flash.lights.get(light, 0.0) for flash in self.flashes)

    def train(self, first: int, count: int) -> FlashTrain:
        """Return flashes ``first`` to ``first + count - 1``, counted from a cycle's start, which is at 0 s.

        Flash 0 is the cycle's first; negative ``first`` reaches into the cycles before.
        """
        slots, starts_s, durations_s = self._cycle
        cycle, place = np.divmod(np.arange(first, first + count), len(slots))
        return FlashTrain(
            slot=slots[place], start_s=cycle * self.cycle_s + starts_s[place], duration_s=durations_s[place]
        )


def reference_duration_s(plan: Plan, light: str) -> float:
    """Return the duration of a light's full flash in strobe seconds: the longest for which the plan lights it."""
    return max(flash.duration_s for flash in plan.flashes if light in flash.lit)


def mixing_matrix(plan: Plan) -> Doubles:
    """Return how much of each light's full flash every lit slot holds, shape (lit slot, light)."""
    reference_s = np.array([reference_duration_s(plan, light) for light in plan.lights])
    duration_s = np.array([plan.flashes[slot].duration_s for slot in plan.lit_slots])
    matrix: Doubles = plan.power * duration_s[:, None] / reference_s
    return matrix


def default_dark_s(
    camera: Camera, durations_s: Sequence[float], *, mode: Mode, clock_tolerance_ppm: float | None
) -> float:
    """Return the dark time where a plan gives none, in strobe seconds.

    Rolling: the exposure (eq. 1) plus the margin by which a strobe clock that runs fast would shorten it. Half-rate:
    what makes the longest flash start every two frames (Bradley 2009). Synced: what fills the frame.
    """
    period_s = camera.frame_period_s
    if mode == "rolling":
        tolerance = (UNKNOWN_CLOCK_PPM if clock_tolerance_ppm is None else clock_tolerance_ppm) * 1e-6
        return camera.exposure_s / (1.0 - tolerance)
    frames = 2 if mode == "half-rate" else 1
    return max(frames * period_s - max(durations_s), 0.0)


def assemble_plan(
    *,
    camera: Camera,
    flashes: Sequence[PlannedFlash],
    dark_s: float | None,
    mode: Mode = "rolling",
    rise_s: float = 0.0,
    fall_s: float = 0.0,
    clock_tolerance_ppm: float | Literal["unknown"] | None = 100.0,
    dark_every: int = 1,
    dark_code: int = 0,
) -> Plan:
    """Return the plan of these flashes; where ``dark_s`` is None, with the dark time that its mode needs.

    ``clock_tolerance_ppm`` is ``"unknown"`` or None where it is unknown.
    """
    tolerance_ppm = None if clock_tolerance_ppm == "unknown" else clock_tolerance_ppm
    if dark_s is None:
        durations_s = [flash.duration_s for flash in flashes]
        dark_s = default_dark_s(camera, durations_s, mode=mode, clock_tolerance_ppm=tolerance_ppm)
    return Plan(
        camera=camera,
        flashes=tuple(flashes),
        dark_s=dark_s,
        mode=mode,
        rise_s=rise_s,
        fall_s=fall_s,
        clock_tolerance_ppm=tolerance_ppm,
        dark_every=dark_every,
        dark_code=dark_code,
    )
