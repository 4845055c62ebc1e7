"""Plates in the order of flashes, gathered into one set per round: each light once, at its full flash.

Every flash is a sum of lights, ``plate[k] = sum_l power[k, l] * light[l]``. One light per flash is the identity; other
patterns are demultiplexed by the pseudo-inverse. A light's full flash is power 1 for its longest planned duration.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.camera import FloatArray
from psvideo.plan import Plan
from psvideo.split import Image, Plate
from psvideo.timing import Flash

FIRST_NUMBER = 1001


@dataclass(frozen=True, kw_only=True)
class LightPlate:
    """The scene under one light at its full flash, at one instant. ``seen`` (row,) as in a Plate."""

    light: str
    number: int
    time_s: float
    image: Image
    seen: NDArray[np.bool_]


@dataclass(frozen=True, kw_only=True)
class Round:
    """What one pass through the plan's flashes showed: the plates of the lights that are complete in it."""

    number: int
    plates: tuple[LightPlate, ...]
    ambient: LightPlate | None = None

    @property
    def time_s(self) -> float:
        """The middle of the instants that the round's plates show."""
        return float(np.mean([plate.time_s for plate in self.plates]))

    @property
    def lights(self) -> tuple[str, ...]:
        """The lights that this round has a plate of, in the plan's order."""
        return tuple(plate.light for plate in self.plates)


def reference_duration_s(plan: Plan, light: str) -> float:
    """Return the duration of a light's full flash in strobe seconds: the longest for which the plan lights it."""
    return max(flash.duration_s for flash in plan.flashes if flash.lights.get(light, 0.0) > 0)


def mixing_matrix(plan: Plan) -> FloatArray:
    """Return how much of each light's full flash every lit slot holds, shape (lit slot, light)."""
    reference_s = np.array([reference_duration_s(plan, light) for light in plan.lights])
    duration_s = np.array([plan.flashes[slot].duration_s for slot in plan.lit_slots])
    matrix: FloatArray = plan.power * duration_s[:, None] / reference_s
    return matrix


def round_numbers(flashes: tuple[Flash, ...], *, start: int = FIRST_NUMBER) -> tuple[int, ...]:
    """Return every flash's round; the first round that holds a complete lit flash is number ``start``."""
    numbers: list[int] = []
    for flash, before in zip(flashes, (None, *flashes), strict=False):
        begins = before is not None and flash.slot <= before.slot
        numbers.append((numbers[-1] if numbers else 0) + begins)
    whole = [n for n, flash in zip(numbers, flashes, strict=True) if flash.complete and any(flash.lights.values())]
    shift = start - whole[0] if whole else start
    return tuple(number + shift for number in numbers)


def rounds(
    plates: Iterable[Plate], plan: Plan, flashes: tuple[Flash, ...], *, start: int = FIRST_NUMBER
) -> Iterator[Round]:
    """Yield one set of light plates per round in which any light is complete; ``start`` numbers the first."""
    numbers = round_numbers(flashes, start=start)
    last = {numbers[flash.index]: flash.index for flash in flashes if flash.complete}
    held: list[Plate] = []
    for plate in plates:
        number = numbers[plate.flash.index]
        if held and numbers[held[0].flash.index] != number:
            yield from _gathered(held, plan, numbers[held[0].flash.index])
            held = []
        held.append(plate)
        del plate  # nothing but the list holds it now, so that a round is gone once it is used
        if held[-1].flash.index == last[number]:
            yield from _gathered(held, plan, number)
            held = []
    if held:
        yield from _gathered(held, plan, numbers[held[0].flash.index])


def _gathered(held: list[Plate], plan: Plan, number: int) -> Iterator[Round]:
    lit = {plate.flash.slot: plate for plate in held if any(plate.flash.lights.values())}
    dark = [plate for plate in held if not any(plate.flash.lights.values())]
    plates = _demultiplexed(lit, plan, number)
    if not plates:
        return
    ambient = (
        LightPlate(light="ambient", number=number, time_s=dark[0].time_s, image=dark[0].image, seen=dark[0].seen)
        if dark
        else None
    )
    yield Round(number=number, plates=tuple(plates), ambient=ambient)


def _demultiplexed(lit: dict[int, Plate], plan: Plan, number: int) -> Iterator[LightPlate] | list[LightPlate]:
    """Solve the round's mixture for the lights; a light is there once every flash that it depends on is."""
    matrix = mixing_matrix(plan)
    inverse = np.linalg.pinv(matrix)
    inverse[np.abs(inverse) < 1e-12] = 0.0
    plates = []
    for light, shares in zip(plan.lights, inverse, strict=True):
        needed = [(slot, share) for slot, share in zip(plan.lit_slots, shares, strict=True) if share]
        if all(slot in lit for slot, _ in needed):
            plates.append(_combined([(lit[slot], share) for slot, share in needed], light, number))
    return plates


def _combined(parts: list[tuple[Plate, float]], light: str, number: int) -> LightPlate:
    """Return a light's plate from the flashes that hold it, each times its share."""
    if len(parts) == 1 and parts[0][1] == 1.0:
        image = parts[0][0].image
    else:
        image = np.sum([np.float32(share) * plate.image for plate, share in parts], axis=0, dtype=np.float32)
        image[np.any([plate.image >= 1.0 for plate, _ in parts], axis=0)] = np.float32(1.0)
    total = sum(abs(share) for _, share in parts)
    time_s = sum(abs(share) * plate.time_s for plate, share in parts) / total
    return LightPlate(
        light=light,
        number=number,
        time_s=time_s,
        image=image,
        seen=np.all([plate.seen for plate, _ in parts], axis=0),
    )
