"""Plates that wait for the next round, held in half the memory: 16-bit codes over the range of what they show."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from psvideo.plates.sequence import LightPlate

MOST_CODE = 65535


@dataclass(frozen=True, kw_only=True)
class Packed:
    """A plate whose light is ``least + step * codes``, good to half a step; codes from ``clipped`` on are saturated.

    ``plate`` holds all else, and no image.
    """

    plate: LightPlate
    codes: NDArray[np.uint16]
    least: float
    step: float
    clipped: int


def packed(plate: LightPlate) -> Packed:
    """Return a plate in half its memory."""
    least, most = float(plate.image.min()), float(plate.image.max())
    step = max((most - least) / MOST_CODE, 1e-12)
    codes = _codes(plate.image, least, step)
    clipped = (
        int(_codes(np.full(1, plate.saturation, np.float32), least, step)[0])
        if most >= plate.saturation
        else MOST_CODE + 1
    )
    empty = np.empty((0, 0), np.float32)
    return Packed(plate=replace(plate, image=empty), codes=codes, least=least, step=step, clipped=clipped)


def _codes(image: NDArray[np.float32], least: float, step: float) -> NDArray[np.uint16]:
    code = image - np.float32(least)
    code *= np.float32(1 / step)
    code += np.float32(0.5)
    return np.asarray(np.clip(code, 0, MOST_CODE, out=code).astype(np.uint16))


def unpacked(held: Packed) -> LightPlate:
    """Return the plate; what was saturated is so still."""
    image = held.codes.astype(np.float32)
    image *= np.float32(held.step)
    image += np.float32(held.least)
    if held.clipped <= MOST_CODE:
        saturation = np.float32(held.plate.saturation)
        image[held.codes >= held.clipped] = saturation
    return replace(held.plate, image=image)
