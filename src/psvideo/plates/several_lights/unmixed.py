"""Flashes of several colours separated: a round of flashes in, a round of plates under white light out.

Where lamps exchange their colours between a round's flashes, each channel of a lamp's plate is a sum of that channel of
the flashes, and nothing need be known of the surface. What moved between them, and flow could not bring together, is
taken from one flash alone, by the colour that the smallest neighbourhood shows in which the flashes agree.
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace

import cv2
import numpy as np

from psvideo.model.arrays import Doubles, Flags, Image
from psvideo.model.irradiance.colours import WHITE, Unmixing
from psvideo.model.plan import Plan
from psvideo.model.timing import Flash
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixing_kernel import COUNTS
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.sequence import AMBIENT, Round, round_numbers
from psvideo.plates.several_lights.surface_colour import colours_of, contradicted
from psvideo.plates.split import Plate

DOUBT = 0.1
"""What a surface's colour is taken to be off by, where the report says what that costs."""


def unmixing_note(how: Unmixing) -> str:
    """Return in whole sentences how flashes were separated by colour, and what that leaves in doubt."""
    if how.shares is not None:
        return (
            "Several colours flashed at once and were exchanged between flashes: plates are those of the lamps under "
            f"white light, whatever the surface's colour (condition number {how.condition:.2f}, by which noise is "
            "raised at most). What moved between the flashes of a round, so that flow could not follow it, comes from "
            "one flash, by the colour that its surroundings show; it is valid only where what rests nearby has the "
            "same colour, or the rig's [surface] gives it."
        )
    known = "white" if how.surface_colour is None else "of the colour that the rig's [surface] gives"
    turned = _turned_deg(how)
    cost = "" if turned is None else f": a channel that is off by {DOUBT:.0%} turns normals by {turned:.1f} degrees"
    return (
        f"Every flash lights several colours at once, the same each time, and the surface was taken to be {known} "
        f"everywhere{cost}. Give its `colour` under [surface] in the rig, or exchange the lamps' colours between "
        f"flashes. Condition number of the colours: {how.condition:.2f}."
    )


def _turned_deg(how: Unmixing) -> float | None:
    """Return by how much the normal of a surface that faces the camera turns at worst where one channel is off."""
    first = how.alone[0]
    lights = [how.rig.select([how.shown.lights[place]])[0] for place in first.lights]
    if len(lights) != 3 or any(light.direction is None for light in lights):
        return None
    towards = np.array([light.direction for light in lights])
    facing = np.array([0.0, 0.0, 1.0])
    seen = np.linalg.inv(first.inverse) @ (towards @ facing)
    turned = []
    for channel in range(len(seen)):
        off = seen * (1 + DOUBT * (np.arange(len(seen)) == channel))
        normal = np.linalg.solve(towards, first.inverse @ off)
        turned.append(np.degrees(np.arccos(min(normal @ facing / np.linalg.norm(normal), 1.0))))
    return float(max(turned))


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
        colour = np.array(how.surface_colour or WHITE, np.float32)
        apart = [flashes.alone(place, how, colour / colour.max()) for place in range(len(one.plates))]
        by_name = {plate.light: plate for plates in apart for plate in plates}
        plates = tuple(by_name[name] for name in how.shown.lights)
        off = [_unsure_alone(one, place, how) for place in range(len(one.plates))]
        return replace(one, plates=plates, unsure=None if one.unsure is None else np.sum(off, axis=0))
    plates = tuple(flashes.together(how, how.shares))
    unsure = None if one.unsure is None else _unsure_together(one.unsure, how.shares)
    apart_round = replace(one, plates=plates, unsure=unsure)
    return flashes.corrected(apart_round, how) if how.alone else apart_round


def _unsure_together(unsure: Image, shares: Doubles) -> Image:
    """Return by how much lamps' plates may be off, (light, row, col), where the flashes may be, (slot, row, col)."""
    weights = np.abs(shares).mean(axis=-1) ** 2  # (light, slot)
    return np.asarray(np.sqrt(np.einsum("ls,srx->lrx", weights, unsure**2)), np.float32)


def _unsure_alone(one: Round, place: int, how: Unmixing) -> Image:
    """Return the same of the lights of one flash; 0 of all others."""
    if one.unsure is None:
        return np.zeros((), np.float32)
    off = np.zeros((len(how.shown.lights), *one.unsure.shape[1:]), np.float32)
    for light, row in zip(how.alone[place].lights, how.alone[place].inverse, strict=True):
        off[light] = np.float32(np.linalg.norm(row)) * one.unsure[place]
    return off


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

    def together(self, how: Unmixing, shares: Doubles) -> Iterator[LightPlate]:
        """Yield every lamp's plate out of all flashes."""
        seen = np.logical_and.reduce([plate.pixels_seen for plate in self.one.plates])
        for share, name in zip(shares, how.shown.lights, strict=True):
            image, clipped = np.zeros_like(self.images[0]), np.zeros(self.images[0].shape, np.bool_)
            for part, picture, at_end in zip(share, self.images, self.clipped, strict=True):
                image += part.astype(np.float32) * picture
                clipped |= at_end & (np.abs(part) > COUNTS * np.abs(share).max())
            most = max(float(np.maximum(share, 0).sum(axis=0).max()), 1.0)
            image[clipped] = most
            image[~seen] = 0
            yield self._like(self.nearest, name, image, seen, most)

    def alone(self, place: int, how: Unmixing, colour: Image) -> list[LightPlate]:
        """Return the plates of the lights of one flash, given the surface's colour, (channel,) or (row, col, channel),
        at most 1."""
        flash, own = how.alone[place], self.one.plates[place]
        clipped = self.clipped[place].any(axis=-1)
        light = (self.images[place] / colour) @ flash.inverse.T.astype(np.float32)  # (row, col, light)
        plates = []
        for n, shown in enumerate(flash.lights):
            most = max(float(np.maximum(flash.inverse[n], 0).sum() / colour.min()), 1.0)
            image = np.asarray(light[..., n, None] * colour, np.float32)
            image[clipped] = most
            plates.append(self._like(place, how.shown.lights[shown], image, own.seen, most))
        return plates

    def corrected(self, one: Round, how: Unmixing) -> Round:
        """Return a round of lamps, where its flashes contradict each other, out of the nearest flash alone."""
        products = np.stack([plate.image for plate in one.plates])
        wrong = self._moved() & (contradicted(products) | ~one.plates[0].seen)
        if not wrong.any():
            return one
        if how.surface_colour is None:
            colour, sure = colours_of(products, wrong)
        else:
            given = np.array(how.surface_colour, np.float32)
            colour, sure = given / given.max(), wrong
        alone = {plate.light: plate for plate in self.alone(self.nearest, how, colour)}
        corrected = tuple(_within(plate, alone[plate.light], wrong) for plate in one.plates)
        unsure = one.unsure
        if unsure is not None:
            small = cv2.resize(wrong.astype(np.float32), unsure.shape[:0:-1], interpolation=cv2.INTER_AREA)
            unsure = unsure + small * (_unsure_alone(self.one, self.nearest, how) - unsure)
        return replace(one, plates=corrected, doubtful=wrong & ~sure, unsure=unsure)

    def _moved(self) -> Flags:
        stood, (rows, cols) = self.one.stood, self.images[0].shape[:2]
        if stood is None:
            return np.ones((rows, cols), np.bool_)
        wide = cv2.resize(stood.astype(np.uint8), (cols, rows), interpolation=cv2.INTER_NEAREST)
        return np.asarray(wide == 0)

    def _like(self, place: int, light: str, image: Image, seen: Flags, most: float) -> LightPlate:
        own = self.one.plates[place]
        return replace(own, light=light, time_s=self.one.time_s, picture=mixture_of(image), seen=seen, saturation=most)


def _within(plate: LightPlate, other: LightPlate, where: Flags) -> LightPlate:
    """Return a plate that is another one where that is asked for."""
    image, most = plate.image, max(plate.saturation, other.saturation)
    image = np.where(image >= plate.saturation, most, image)
    shown = np.where(other.image >= other.saturation, most, other.image)
    image[where] = shown[where]
    return replace(
        plate,
        picture=mixture_of(np.asarray(image, np.float32)),
        seen=np.where(where, other.pixels_seen, plate.pixels_seen),
        saturation=most,
    )
