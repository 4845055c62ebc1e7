"""Plates in the order of flashes, gathered into one set per round: each light once, at its full flash."""

from collections.abc import Callable, Iterable, Iterator, Set
from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from psvideo.errors import PsvideoError
from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan, mixing_matrix
from psvideo.model.timing import Flash
from psvideo.plates.align.velocity.followed import Followed
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.several_lights.demultiplexed import Making, makings_of, plate_of_light
from psvideo.plates.split import Plate

FIRST_NUMBER = 1001
AMBIENT = "ambient"
"""What stands for a light where a dark slot showed the ambient light."""
POOLED_ROUNDS = 16
"""Rounds whose results are pooled where nothing moves: a step is then a 16th of what noise makes of one."""
VOTING_BLOCKS = 3
"""So many times as many rounds vote on a pixel's class: near a limit twice as many rounds let a third as many pixels
change it."""


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
    stood
        On a coarse grid over the picture, (row, col), True where nothing changed since the round before; None where
        nobody looked.
    motion
        How everything moved when the plates were brought to one instant; None where nothing did.
    unsure
        By how much every light's plate may be off where motion does not explain what it is made from, (light, row, col)
        on a coarse grid over the picture, a standard error in units of the plates' light; None where nothing moved.
    open_plates
        Of each light what an open shutter shows about the instant; empty where none is wanted.
    doubtful
        (row, col), True where plates depend on a colour of the surface that was guessed; None where none do.
    calm
        On a coarse grid over the picture, (row, col), True where nothing changed by more than a codec leaves, and
        nothing beside it; None where no codec makes plates differ.
    """

    number: int
    plates: tuple[LightPlate, ...]
    ambient: LightPlate | None = None
    stood: NDArray[np.bool_] | None = None
    motion: Followed | None = None
    unsure: NDArray[np.float32] | None = None
    open_plates: tuple[LightPlate, ...] = ()
    doubtful: NDArray[np.bool_] | None = None
    calm: NDArray[np.bool_] | None = None

    @property
    def moved(self) -> NDArray[np.bool_] | None:
        """On a coarse grid over the picture, (row, col), True where plates were moved, or no motion explains them, for
        more than what a codec leaves; None where nothing moved."""
        if self.motion is None or self.unsure is None:
            return None
        moved = self.motion.moves | (self.unsure > 0).any(axis=0)
        if self.calm is None:
            return np.asarray(moved)
        high, wide = (np.arange(size) * each // size for size, each in zip(moved.shape, self.calm.shape, strict=True))
        return np.asarray(moved & ~self.calm[np.ix_(high, wide)])

    @property
    def time_s(self) -> float:
        """The middle of the instants that the round's plates show."""
        return float(np.mean([plate.time_s for plate in self.plates]))

    @property
    def age_s(self) -> Doubles:
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
        "lights, or give lights that always flash together one name. Where the lights have different colours, name the "
        "rig and give each its `colour` there: psvideo calibrate colours measures them."
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


def light_plates(
    plates: Iterable[Plate], plan: Plan, flashes: tuple[Flash, ...], *, start: int = FIRST_NUMBER
) -> Iterator[LightPlate]:
    """Yield every light's plate as soon as the flashes that it is made of are there, and every round's first dark slot.

    Plates are numbered by ``round_numbers``. Only flashes are held that a light still waits for.
    """
    numbers = round_numbers(flashes, start=start)
    makings = makings_of(plan)
    waiting: list[Making] = []
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
                yield plate_of_light(making, lit, now)
        waiting = [making for making in waiting if not making.slots <= lit.keys()]
        needed = {slot for making in waiting for slot in making.slots}
        lit = {slot: held for slot, held in lit.items() if slot in needed}


def coming(
    plan: Plan, flashes: tuple[Flash, ...], *, start: int = FIRST_NUMBER, within: tuple[Flash, ...] | None = None
) -> dict[int, frozenset[str]]:
    """Return by number which lights every round will have a plate of, AMBIENT among them where it has a dark slot.

    ``within`` are the same flashes, complete where a part of the frames holds them; they number nothing.
    """
    complete: dict[int, list[Flash]] = {}
    for flash, number in zip(within or flashes, round_numbers(flashes, start=start), strict=True):
        complete.setdefault(number, []).extend([flash] if flash.complete else [])
    makings = makings_of(plan)
    return {number: frozenset(_names(makings, held)) for number, held in complete.items()}


def _names(makings: list[Making], flashes: list[Flash]) -> Iterator[str]:
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


def handed_over(
    held: dict[str, LightPlate], number: int, lights: tuple[str, ...], stood: NDArray[np.bool_] | None = None
) -> Round:
    """Return a round of what is held by light, in the order of ``lights``, and hold nothing of it any more."""
    plates, ambient = tuple(held.pop(light) for light in lights if light in held), held.pop(AMBIENT, None)
    held.clear()
    return Round(number=number, plates=plates, ambient=ambient, stood=stood)


def _of_dark(plate: Plate, number: int) -> LightPlate:
    return LightPlate(light=AMBIENT, number=number, time_s=plate.time_s, picture=plate.picture, seen=plate.seen)
