"""One light out of the flashes that hold it: patterns of several are demultiplexed, flashes of one light are merged.

Every flash is a sum of lights, ``plate[k] = sum_l power[k, l] * light[l]``. One light per flash is the identity; other
patterns are demultiplexed by the pseudo-inverse. A light that flashes alone several times a round, at different powers
or durations (HDR), is merged: what is saturated is left out and the rest is summed, which weights it by photon noise. A
light's full flash is power 1 for its longest planned duration.
"""

from dataclasses import dataclass, replace

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan, mixing_matrix
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.mixing.several_pictures import combined
from psvideo.plates.split import Plate


@dataclass(frozen=True, kw_only=True)
class Making:
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


def makings_of(plan: Plan) -> list[Making]:
    """Return how every light of a plan is had from the flashes of a round, in the order of the plan's lights."""
    matrix = mixing_matrix(plan)
    inverse = np.linalg.pinv(matrix)
    inverse[np.abs(inverse) < 1e-12] = 0.0
    makings = []
    for light, column, shares in zip(plan.lights, matrix.T, inverse, strict=True):
        needed = [row for row, share in enumerate(shares) if share]
        makings.append(
            Making(
                light=light,
                shares={plan.lit_slots[row]: float(shares[row]) for row in needed},
                exposures={plan.lit_slots[row]: float(column[row]) for row in needed},
                alone=all(np.count_nonzero(matrix[row]) == 1 for row in needed),
            )
        )
    return makings


def plate_of_light(making: Making, lit: dict[int, Plate], number: int) -> LightPlate:
    """Return the plate of a light at its full flash, from the plates of a round's ``lit`` flashes by slot."""
    parts = [lit[slot] for slot in making.shares]
    if making.alone:
        return _merged(parts, np.array(list(making.exposures.values())), making.light, number)
    plate = _mixed(parts, np.array(list(making.shares.values())), making.light, number)
    return replace(plate, brightest_share=max(making.exposures.values()))


def _merged(parts: list[Plate], exposures: Doubles, light: str, number: int) -> LightPlate:
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
        picture = mixture_of(merged)
    time_s = _time_s(parts, exposures)
    return LightPlate(
        light=light,
        number=number,
        time_s=time_s,
        picture=picture,
        seen=seen,
        saturation=float(1 / exposures.min()),
        brightest_share=float(exposures.max()),
    )


def _mixed(parts: list[Plate], shares: Doubles, light: str, number: int) -> LightPlate:
    """Take a light out of patterns of several; ``shares`` (part,) are what of each pattern makes up the light."""
    saturation = max(float(shares[shares > 0].sum()), 1.0)
    seen = np.all([part.seen for part in parts], axis=0)
    picture = combined([part.picture for part in parts], [float(share) for share in shares], ceiling=saturation)
    time_s = _time_s(parts, shares)
    return LightPlate(
        light=light,
        number=number,
        time_s=time_s,
        picture=picture.within(seen),
        seen=seen,
        saturation=saturation,
        unmixed=True,
    )


def _time_s(parts: list[Plate], shares: Doubles) -> float:
    """Return the instant that a light's plate shows: the mean of its flashes', by how much each counts."""
    return float(np.average([plate.time_s for plate in parts], weights=np.abs(shares)))
