"""Plates in the order of flashes, gathered into one set per round: each light once, at its full flash.

Every flash is a sum of lights, ``plate[k] = sum_l power[k, l] * light[l]``. One light per flash is the identity; other
patterns are demultiplexed by the pseudo-inverse. A light that flashes alone several times a round, at different powers
or durations (HDR), is merged: what is saturated is left out and the rest is summed, which weights it by photon noise. A
light's full flash is power 1 for its longest planned duration.
"""

from collections.abc import Callable, Iterable, Iterator, Set
from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from psvideo.errors import PsvideoError
from psvideo.model.camera import FloatArray
from psvideo.model.coded import Image
from psvideo.model.plan import Plan, mixing_matrix
from psvideo.model.timing import Flash
from psvideo.plates.mixture import Mixture, combined, made
from psvideo.plates.split import Plate

FIRST_NUMBER = 1001
AMBIENT = "ambient"
"""What stands for a light where a dark slot showed the ambient light."""


@dataclass(frozen=True, kw_only=True)
class LightPlate:
    """The scene under one light at its full flash, at one instant.

    ``seen`` (row,) is as in a Plate, or (row, col) where motion hid parts of the plate.

    ``saturation`` is the value from which on a pixel is clipped: 1.0, or more where the flash was weaker than full.
    ``shown_s`` (row,) are the instants that the rows show, or (row, col) where the picture was turned, None where all
    show ``time_s``.
    """

    light: str
    number: int
    time_s: float
    picture: Mixture
    seen: NDArray[np.bool_]
    saturation: float = 1.0
    shown_s: FloatArray | None = None

    @property
    def image(self) -> Image:
        """The picture, (row, col) or (row, col, channel), in linear light; made when it is asked for."""
        return self.picture.image()

    @property
    def shape(self) -> tuple[int, ...]:
        """The picture's shape."""
        return self.picture.shape

    @property
    def flashed_s(self) -> FloatArray:
        """The instant that every row shows, shape (row,), or every pixel, (row, col), where the picture was turned."""
        return np.full(self.shape[0], self.time_s) if self.shown_s is None else self.shown_s

    @property
    def rows_seen(self) -> NDArray[np.bool_]:
        """Which rows any frame saw, also where motion hid something in them, shape (row,)."""
        return self.seen if self.seen.ndim == 1 else np.asarray(self.seen.any(axis=1))

    @property
    def own(self) -> NDArray[np.bool_]:
        """What the plate's own flash showed, (row, 1), or (row, col) where the picture was turned; the rest comes from
        flashes before or after."""
        seen = self.rows_seen[:, None]
        if self.shown_s is None:
            return seen
        return np.asarray(seen & (self.shown_s == self.time_s).reshape(len(seen), -1))

    @property
    def pixels_seen(self) -> NDArray[np.bool_]:
        """What is known of the plate, shape (row, col)."""
        known = self.seen if self.seen.ndim == 2 else self.seen[:, None]
        return np.broadcast_to(known, self.shape[:2])


@dataclass(frozen=True, kw_only=True)
class Round:
    """What one pass through the plan's flashes showed: the plates of the lights that are complete in it.

    Attributes
    ----------
    number
        Counts from 1001, as files do.
    plates
        One for each light: ``light``, its name; ``time_s``, the middle of its flash on the camera's clock; ``image``
        (row, col[, 3]), float32, linear light.
    ambient
        Such a plate of the dark slot, None where there is none.
    """

    number: int
    plates: tuple[LightPlate, ...]
    ambient: LightPlate | None = None

    @property
    def time_s(self) -> float:
        """The middle of the instants that the round's plates show."""
        return float(np.mean([plate.time_s for plate in self.plates]))

    @property
    def age_s(self) -> FloatArray:
        """How far from the instant, before or after, the farthest of the flashes is that a row shows, shape (row,), or
        that a pixel shows, (row, col), where pictures were turned."""
        away_s = [np.abs(plate.flashed_s - self.time_s) for plate in self.plates]
        if any(one.ndim == 2 for one in away_s):
            away_s = [one if one.ndim == 2 else one[:, None] for one in away_s]
        return reduce(np.maximum, away_s)

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
    whole = [n for n, flash in zip(numbers, flashes, strict=True) if flash.complete and not flash.is_dark]
    shift = start - whole[0] if whole else start
    return tuple(number + shift for number in numbers)


@dataclass(frozen=True, kw_only=True)
class _Making:
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


def _makings(plan: Plan) -> list[_Making]:
    matrix = mixing_matrix(plan)
    inverse = np.linalg.pinv(matrix)
    inverse[np.abs(inverse) < 1e-12] = 0.0
    makings = []
    for light, column, shares in zip(plan.lights, matrix.T, inverse, strict=True):
        needed = [row for row, share in enumerate(shares) if share]
        makings.append(
            _Making(
                light=light,
                shares={plan.lit_slots[row]: float(shares[row]) for row in needed},
                exposures={plan.lit_slots[row]: float(column[row]) for row in needed},
                alone=all(np.count_nonzero(matrix[row]) == 1 for row in needed),
            )
        )
    return makings


def light_plates(
    plates: Iterable[Plate], plan: Plan, flashes: tuple[Flash, ...], *, start: int = FIRST_NUMBER
) -> Iterator[LightPlate]:
    """Yield every light's plate as soon as the flashes that it is made of are there, and every round's first dark slot.

    Plates are numbered by ``round_numbers``. Only flashes are held that a light still waits for.
    """
    numbers = round_numbers(flashes, start=start)
    makings = _makings(plan)
    waiting: list[_Making] = []
    lit: dict[int, Plate] = {}
    number: int | None = None
    shown_dark: int | None = None
    for plate in plates:
        now = numbers[plate.flash.index]
        if now != number:
            number, waiting, lit = now, makings, {}
        if plate.flash.lit:
            lit[plate.flash.slot] = plate
        elif now != shown_dark:
            shown_dark = now
            yield _of_dark(plate, now)
        del plate
        for making in waiting:
            if making.slots <= lit.keys():
                yield _of_light(making, lit, now)
        waiting = [making for making in waiting if not making.slots <= lit.keys()]
        needed = {slot for making in waiting for slot in making.slots}
        lit = {slot: held for slot, held in lit.items() if slot in needed}


def coming(plan: Plan, flashes: tuple[Flash, ...], *, start: int = FIRST_NUMBER) -> dict[int, frozenset[str]]:
    """Return by number which lights every round will have a plate of, AMBIENT among them where it has a dark slot."""
    complete: dict[int, list[Flash]] = {}
    for flash, number in zip(flashes, round_numbers(flashes, start=start), strict=True):
        complete.setdefault(number, []).extend([flash] if flash.complete else [])
    makings = _makings(plan)
    return {number: frozenset(_names(makings, held)) for number, held in complete.items()}


def _names(makings: list[_Making], flashes: list[Flash]) -> Iterator[str]:
    slots = {flash.slot for flash in flashes}
    yield from (making.light for making in makings if making.slots <= slots)
    if not all(flash.lit for flash in flashes):
        yield AMBIENT


def gathered(
    plates: Iterable[LightPlate],
    lights: tuple[str, ...],
    *,
    expected: Callable[[int], Set[str]],
    whole: bool = False,
) -> Iterator[Round]:
    """Yield the rounds of a stream of plates as they are, each as soon as it holds what is expected of its number.

    A round that lacks some of that comes when the next one begins. ``whole`` leaves rounds out that lack any of the
    ``lights``; without it one plate of a light is enough.
    """
    least = len(lights) if whole else 1
    held: dict[str, LightPlate] = {}
    number = 0
    for plate in plates:
        if plate.number != number:
            if len(held.keys() & set(lights)) >= least:
                yield handed_over(held, number, lights)
            held.clear()
        number = plate.number
        held[plate.light] = plate
        del plate  # nothing but the round holds it now, so that it is gone once that is used
        if held.keys() >= expected(number) and len(held.keys() & set(lights)) >= least:
            yield handed_over(held, number, lights)
    if len(held.keys() & set(lights)) >= least:
        yield handed_over(held, number, lights)


def handed_over(held: dict[str, LightPlate], number: int, lights: tuple[str, ...]) -> Round:
    """Return a round of what is held by light, in the order of ``lights``, and hold nothing of it any more."""
    plates, ambient = tuple(held.pop(light) for light in lights if light in held), held.pop(AMBIENT, None)
    held.clear()
    return Round(number=number, plates=plates, ambient=ambient)


def _of_dark(plate: Plate, number: int) -> LightPlate:
    return LightPlate(light=AMBIENT, number=number, time_s=plate.time_s, picture=plate.picture, seen=plate.seen)


def _of_light(making: _Making, lit: dict[int, Plate], number: int) -> LightPlate:
    parts = [lit[slot] for slot in making.shares]
    if making.alone:
        return _merged(parts, np.array(list(making.exposures.values())), making.light, number)
    return _mixed(parts, np.array(list(making.shares.values())), making.light, number)


def _merged(parts: list[Plate], exposures: FloatArray, light: str, number: int) -> LightPlate:
    """Merge flashes of one light alone; ``exposures`` (part,) are their shares of its full flash.

    The sum of what is not clipped over the sum of its exposures is the best estimate under photon noise. Where all is
    clipped, the weakest flash says how bright it is at least. A row that some of the flashes did not show is taken from
    the others.
    """
    seen = np.any([part.seen for part in parts], axis=0)
    if len(parts) == 1 and exposures[0] == 1.0:
        picture = parts[0].picture
    else:
        shape = parts[0].picture.shape
        light_sum, exposure_sum = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
        for part, exposure in zip(parts, exposures, strict=True):
            image = part.image
            good = (image < 1.0) & part.seen.reshape(-1, *[1] * (image.ndim - 1))
            light_sum += np.where(good, image, 0)
            exposure_sum += np.where(good, np.float32(exposure), 0)
        least = np.float32(1 / exposures.min())
        merged = np.where(exposure_sum > 0, light_sum / np.maximum(exposure_sum, 1e-6), least).astype(np.float32)
        merged[~seen] = 0
        picture = made(merged)
    time_s = _time_s(parts, exposures)
    return LightPlate(
        light=light, number=number, time_s=time_s, picture=picture, seen=seen, saturation=float(1 / exposures.min())
    )


def _mixed(parts: list[Plate], shares: FloatArray, light: str, number: int) -> LightPlate:
    """Take a light out of patterns of several; ``shares`` (part,) are what of each pattern makes up the light."""
    saturation = max(float(shares[shares > 0].sum()), 1.0)
    seen = np.all([part.seen for part in parts], axis=0)
    picture = combined([part.picture for part in parts], [float(share) for share in shares], ceiling=saturation)
    time_s = _time_s(parts, shares)
    return LightPlate(
        light=light, number=number, time_s=time_s, picture=picture.within(seen), seen=seen, saturation=saturation
    )


def _time_s(parts: list[Plate], shares: FloatArray) -> float:
    """Return the instant that a light's plate shows: the mean of its flashes', by how much each counts."""
    return float(np.average([plate.time_s for plate in parts], weights=np.abs(shares)))
