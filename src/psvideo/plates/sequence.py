"""Plates in the order of flashes, gathered into one set per round: each light once, at its full flash.

Every flash is a sum of lights, ``plate[k] = sum_l power[k, l] * light[l]``. One light per flash is the identity; other
patterns are demultiplexed by the pseudo-inverse. A light that flashes alone several times a round, at different powers
or durations (HDR), is merged: what is saturated is left out and the rest is summed, which weights it by photon noise. A
light's full flash is power 1 for its longest planned duration.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.errors import PsvideoError
from psvideo.model.camera import FloatArray
from psvideo.model.plan import Plan, mixing_matrix
from psvideo.model.timing import Flash
from psvideo.plates.split import Image, Plate

FIRST_NUMBER = 1001
AMBIENT = "ambient"
"""What stands for a light where a dark slot showed the ambient light."""


@dataclass(frozen=True, kw_only=True)
class LightPlate:
    """The scene under one light at its full flash, at one instant.

    ``seen`` (row,) is as in a Plate, or (row, col) where motion hid parts of the plate.

    ``saturation`` is the value from which on a pixel is clipped: 1.0, or more where the flash was weaker than full.
    ``shown_s`` (row,) are the instants that the rows show, None where all show ``time_s``.
    """

    light: str
    number: int
    time_s: float
    image: Image
    seen: NDArray[np.bool_]
    saturation: float = 1.0
    shown_s: FloatArray | None = None

    @property
    def flashed_s(self) -> FloatArray:
        """The instant that every row shows, shape (row,)."""
        return np.full(len(self.image), self.time_s) if self.shown_s is None else self.shown_s

    @property
    def rows_seen(self) -> NDArray[np.bool_]:
        """Which rows any frame saw, also where motion hid something in them, shape (row,)."""
        return self.seen if self.seen.ndim == 1 else np.asarray(self.seen.any(axis=1))

    @property
    def pixels_seen(self) -> NDArray[np.bool_]:
        """What is known of the plate, shape (row, col)."""
        known = self.seen if self.seen.ndim == 2 else self.seen[:, None]
        return np.broadcast_to(known, self.image.shape[:2])


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


def check_separable(plan: Plan) -> None:
    """Raise PsvideoError where the plan's flashes cannot separate its lights in any picture."""
    matrix = mixing_matrix(plan)
    if np.linalg.matrix_rank(matrix, tol=1e-6) == len(plan.lights):
        return
    reach = np.abs(np.linalg.svd(matrix)[2][np.linalg.matrix_rank(matrix, tol=1e-6) :]).max(axis=0)
    mixed = [light for light, share in zip(plan.lights, reach, strict=True) if share > 1e-6]
    raise PsvideoError(
        f"The plan's flashes cannot separate the lights {', '.join(mixed)}: they flash together in the same "
        "mixture, or there are fewer different flashes than lights. Flash each by itself, use as many patterns as "
        "lights, or give lights that always flash together one name."
    )


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


def light_plates(
    plates: Iterable[Plate],
    plan: Plan,
    flashes: tuple[Flash, ...],
    *,
    start: int = FIRST_NUMBER,
    with_ambient: bool = False,
) -> Iterator[LightPlate]:
    """Yield every light's plate as soon as the flashes that it is made of are there; dark slots if they are wanted.

    Numbers are those of ``rounds``. Only flashes are held that a light still waits for.
    """
    numbers = round_numbers(flashes, start=start)
    recipes = _recipes(plan)
    waiting: list[_Recipe] = []
    lit: dict[int, Plate] = {}
    number: int | None = None
    for plate in plates:
        now = numbers[plate.flash.index]
        if now != number:
            number, waiting, lit = now, recipes, {}
        if any(plate.flash.lights.values()):
            lit[plate.flash.slot] = plate
        elif with_ambient:
            yield _of_dark(plate, now)
        del plate
        for recipe in waiting:
            if recipe.slots <= lit.keys():
                yield _of_light(recipe, lit, now)
        waiting = [recipe for recipe in waiting if not recipe.slots <= lit.keys()]
        needed = {slot for recipe in waiting for slot in recipe.slots}
        lit = {slot: held for slot, held in lit.items() if slot in needed}


def _gathered(held: list[Plate], plan: Plan, number: int) -> Iterator[Round]:
    lit = {plate.flash.slot: plate for plate in held if any(plate.flash.lights.values())}
    dark = [plate for plate in held if not any(plate.flash.lights.values())]
    plates = _demultiplexed(lit, plan, number)
    if not plates:
        return
    yield Round(number=number, plates=tuple(plates), ambient=_of_dark(dark[0], number) if dark else None)


def _of_dark(plate: Plate, number: int) -> LightPlate:
    return LightPlate(light=AMBIENT, number=number, time_s=plate.time_s, image=plate.image, seen=plate.seen)


def _demultiplexed(lit: dict[int, Plate], plan: Plan, number: int) -> list[LightPlate]:
    """Solve the round's mixture for the lights; a light is there once every flash that it depends on is."""
    return [_of_light(recipe, lit, number) for recipe in _recipes(plan) if recipe.slots <= lit.keys()]


@dataclass(frozen=True, kw_only=True)
class _Recipe:
    """How a light is had from the flashes of a round: ``shares`` by slot of what holds ``exposure`` of it (by slot);
    ``alone`` where no other light is in these flashes."""

    light: str
    shares: dict[int, float]
    exposures: dict[int, float]
    alone: bool

    @property
    def slots(self) -> set[int]:
        """The flashes that the light depends on."""
        return set(self.shares)


def _recipes(plan: Plan) -> list[_Recipe]:
    matrix = mixing_matrix(plan)
    inverse = np.linalg.pinv(matrix)
    inverse[np.abs(inverse) < 1e-12] = 0.0
    recipes = []
    for light, column, shares in zip(plan.lights, matrix.T, inverse, strict=True):
        needed = [row for row, share in enumerate(shares) if share]
        recipes.append(
            _Recipe(
                light=light,
                shares={plan.lit_slots[row]: float(shares[row]) for row in needed},
                exposures={plan.lit_slots[row]: float(column[row]) for row in needed},
                alone=all(np.count_nonzero(matrix[row]) == 1 for row in needed),
            )
        )
    return recipes


def _of_light(recipe: _Recipe, lit: dict[int, Plate], number: int) -> LightPlate:
    parts = [lit[slot] for slot in recipe.shares]
    if recipe.alone:
        return _merged(parts, np.array(list(recipe.exposures.values())), recipe.light, number)
    return _mixed(parts, np.array(list(recipe.shares.values())), recipe.light, number)


def _merged(parts: list[Plate], exposures: FloatArray, light: str, number: int) -> LightPlate:
    """Merge flashes of one light alone; ``exposures`` (part,) are their shares of its full flash.

    The sum of what is not clipped over the sum of its exposures is the best estimate under photon noise. Where all is
    clipped, the weakest flash says how bright it is at least. A row that some of the flashes did not show is taken from
    the others.
    """
    seen = np.any([part.seen for part in parts], axis=0)
    if len(parts) == 1 and exposures[0] == 1.0:
        image = parts[0].image
    else:
        light_sum, exposure_sum = np.zeros_like(parts[0].image), np.zeros_like(parts[0].image)
        for part, exposure in zip(parts, exposures, strict=True):
            good = (part.image < 1.0) & part.seen.reshape(-1, *[1] * (part.image.ndim - 1))
            light_sum += np.where(good, part.image, 0)
            exposure_sum += np.where(good, np.float32(exposure), 0)
        least = np.float32(1 / exposures.min())
        image = np.where(exposure_sum > 0, light_sum / np.maximum(exposure_sum, 1e-6), least).astype(np.float32)
        image[~seen] = 0
    time_s = _time_s(parts, exposures)
    return LightPlate(
        light=light, number=number, time_s=time_s, image=image, seen=seen, saturation=float(1 / exposures.min())
    )


def _mixed(parts: list[Plate], shares: FloatArray, light: str, number: int) -> LightPlate:
    """Take a light out of patterns of several; ``shares`` (part,) are what of each pattern makes up the light."""
    saturation = max(float(shares[shares > 0].sum()), 1.0)
    image = np.zeros_like(parts[0].image)
    for part, share in zip(parts, shares, strict=True):
        image += np.float32(share) * part.image
    image[np.any([part.image >= 1.0 for part in parts], axis=0)] = np.float32(saturation)
    seen = np.all([part.seen for part in parts], axis=0)
    image[~seen] = 0
    time_s = _time_s(parts, shares)
    return LightPlate(light=light, number=number, time_s=time_s, image=image, seen=seen, saturation=saturation)


def _time_s(parts: list[Plate], shares: FloatArray) -> float:
    """Return the instant that a light's plate shows: the mean of its flashes', by how much each counts."""
    return float(np.average([plate.time_s for plate in parts], weights=np.abs(shares)))
