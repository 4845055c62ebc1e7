"""Flashes of several colours taken apart: a round of flashes in, a round of plates under white light out.

Where lamps exchange their colours between a round's flashes, each channel of a lamp's plate is a sum of that channel of
the flashes, and nothing need be known of the surface. What moved between them, and flow could not bring together, is
taken from one flash alone, by the colour that the smallest neighbourhood shows in which the flashes agree.
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from psvideo.model.camera import FloatArray
from psvideo.model.coded import Image
from psvideo.model.colours import WHITE, OneFlash, Unmixing
from psvideo.model.plan import Plan
from psvideo.model.timing import Flash
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing_kernel import COUNTS
from psvideo.plates.mixture import made
from psvideo.plates.sequence import AMBIENT, Round, round_numbers
from psvideo.plates.split import Plate

Flags = NDArray[np.bool_]


def slot_names(plan: Plan) -> tuple[str, ...]:
    """Return what stands for a light where flashes are still mixtures: the lit slots."""
    return tuple(f"flash {slot}" for slot in plan.lit_slots)


def slot_plates(plates: Iterable[Plate], flashes: tuple[Flash, ...], *, start: int) -> Iterator[LightPlate]:
    """Yield every flash as a plate of its own, under its slot's name, and every round's first dark slot."""
    numbers = round_numbers(flashes, start=start)
    shown_dark: int | None = None
    for plate in plates:
        number = numbers[plate.flash.index]
        if plate.flash.is_dark:
            if number == shown_dark:
                continue
            shown_dark = number
        name = AMBIENT if plate.flash.is_dark else f"flash {plate.flash.slot}"
        yield LightPlate(light=name, number=number, time_s=plate.time_s, picture=plate.picture, seen=plate.seen)
        del plate


def unmixed(one: Round, how: Unmixing) -> Round:
    """Return a round of all its flashes as a round of the shown lights."""
    flashes = _Flashes(one)
    if how.shares is None:
        parts = [_alone(flashes, place, how.alone[place], how) for place in range(len(one.plates))]
        return replace(one, plates=tuple(_in_order([plate for part in parts for plate in part], how)))
    return replace(one, plates=tuple(_exchanged(flashes, how.shares, how)))


class _Flashes:
    """A round's flashes as pictures (row, col, channel), and which samples of them are clipped."""

    def __init__(self, one: Round) -> None:
        self.one = one
        self.images = [plate.image for plate in one.plates]
        self.clipped = [image >= plate.saturation for image, plate in zip(self.images, one.plates, strict=True)]

    @property
    def nearest(self) -> int:
        """Which flash is nearest to the round's instant."""
        away_s = [np.abs(plate.flashed_s - self.one.time_s).min() for plate in self.one.plates]
        return int(np.argmin(away_s))

    def like(self, place: int, light: str, image: Image, seen: NDArray[np.bool_], most: float) -> LightPlate:
        """Return a plate with the times of one of the flashes."""
        return replace(self.one.plates[place], light=light, picture=made(image), seen=seen, saturation=most)


def _in_order(plates: list[LightPlate], how: Unmixing) -> list[LightPlate]:
    by_name = {plate.light: plate for plate in plates}
    return [by_name[name] for name in how.shown.lights]


def _exchanged(flashes: _Flashes, shares: FloatArray, how: Unmixing) -> Iterator[LightPlate]:
    seen = np.logical_and.reduce([plate.pixels_seen for plate in flashes.one.plates])
    for lamp, name in enumerate(how.shown.lights):
        image, clipped = np.zeros_like(flashes.images[0]), np.zeros(flashes.images[0].shape, np.bool_)
        for share, picture, at_end in zip(shares[lamp], flashes.images, flashes.clipped, strict=True):
            image += share.astype(np.float32) * picture
            clipped |= at_end & (np.abs(share) > COUNTS * np.abs(shares[lamp]).max())
        most = max(float(np.where(shares[lamp] > 0, shares[lamp], 0).sum(axis=0).max()), 1.0)
        image[clipped] = most
        image[~seen] = 0
        yield flashes.like(flashes.nearest, name, image, seen, most)


def _alone(flashes: _Flashes, place: int, flash: OneFlash, how: Unmixing) -> Iterator[LightPlate]:
    colour = np.array(how.surface_colour or WHITE, np.float32)
    colour = colour / colour.max()
    image, clipped = flashes.images[place], flashes.clipped[place].any(axis=-1)
    light = (image / colour) @ flash.inverse.T.astype(np.float32)  # (row, col, light)
    for n, shown in enumerate(flash.lights):
        most = max(float(np.maximum(flash.inverse[n] / colour, 0).sum()), 1.0)
        plate = light[..., n, None] * colour
        plate[clipped] = most
        own = flashes.one.plates[place]
        yield flashes.like(place, how.shown.lights[shown], np.asarray(plate, np.float32), own.seen, most)
