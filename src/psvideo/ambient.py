"""Ambient light: seen alone in the dark slots, taken off every other plate.

Dark slots are noisy too, so they are averaged over time; where the picture has changed from one to the next by more
than noise (someone moved, a lamp went on), the average begins anew at that place.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import cv2
import numba as nb
import numpy as np
from numpy.typing import NDArray

from psvideo.split import Image, Plate

LONGEST_MEMORY = 16
"""Dark slots that the running average spans at most."""
NEIGHBOURHOOD_PX = 9
"""Changes are judged over a square of this width, which averages noise away."""
CHANGED = 4.0
"""A neighbourhood's mean change of this many standard deviations of noise means that the scene has changed there."""


@dataclass(frozen=True, kw_only=True)
class Ambient:
    """The running average of the dark slots: its image, and how many slots it spans at each pixel."""

    image: Image
    slots: Image


def update(ambient: Ambient | None, dark: Image) -> Ambient:
    """Return the average with one more dark slot in it."""
    if ambient is None:
        return Ambient(image=dark, slots=np.ones(dark.shape[:2], np.float32))
    changed = _changed(dark - ambient.image)
    slots = np.where(changed, np.float32(1), np.minimum(ambient.slots + 1, np.float32(LONGEST_MEMORY)))
    share = 1 / slots if dark.ndim == 2 else (1 / slots)[..., None]
    return Ambient(image=ambient.image + share * (dark - ambient.image), slots=slots)


def _changed(difference: Image) -> NDArray[np.bool_]:
    """Return where two dark slots differ by more than their noise, shape (row, col)."""
    change = difference if difference.ndim == 2 else difference.mean(axis=2)
    noise = 1.4826 * float(np.median(np.abs(change))) + 1e-6
    local = cv2.blur(change, (NEIGHBOURHOOD_PX, NEIGHBOURHOOD_PX))
    changed: NDArray[np.bool_] = np.abs(local) > CHANGED * noise / NEIGHBOURHOOD_PX
    return changed


def subtract(plates: Iterable[Plate], *, first: Ambient | None = None) -> Iterator[Plate]:
    """Yield the plates with ambient light taken off the lit ones; dark slots pass as the average that was used.

    ``first`` is the ambient light before the first dark slot comes by. Without any, plates pass unchanged.
    """
    ambient = first
    for plate in plates:
        if not any(plate.flash.lights.values()):
            ambient = update(ambient, plate.image)
            yield replace(plate, image=ambient.image, exposures=np.ones_like(plate.exposures))
        elif ambient is None:
            yield plate
        else:
            yield replace(plate, image=_without(plate, ambient.image), exposures=np.zeros_like(plate.exposures))


def _without(plate: Plate, ambient: Image) -> Image:
    """Take the ambient light of every exposure off; what is saturated stays at 1.0 or above."""
    rows = plate.image.shape[0]
    lit = np.empty_like(plate.image)
    exposures = plate.exposures.astype(np.float32)
    _subtract_rows(plate.image.reshape(rows, -1), ambient.reshape(rows, -1), exposures, lit.reshape(rows, -1))
    return lit


@nb.njit(cache=True, nogil=True)
def _subtract_rows(image, ambient, exposures, lit):  # type: ignore[no-untyped-def]
    for row in range(image.shape[0]):
        count = exposures[row]
        for col in range(image.shape[1]):
            value = image[row, col]
            lit[row, col] = value if value >= np.float32(1.0) else value - count * ambient[row, col]
