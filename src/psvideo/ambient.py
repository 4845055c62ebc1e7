"""Ambient light: seen alone in the dark slots, taken off every other plate.

Dark slots are noisy too, so they are averaged over time; where the picture has changed from one to the next by more
than noise (someone moved, a lamp went on), the average begins anew at that place.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.compiled import compiled
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
    rows, cols = dark.shape[:2]
    image, slots = np.empty_like(dark), np.empty((rows, cols), np.float32)
    old, new, blended = (picture.reshape(rows, cols, -1) for picture in (ambient.image, dark, image))
    _blend(old, new, ambient.slots, _changed(old, new), blended, slots)
    return Ambient(image=image, slots=slots)


def _changed(old: Image, new: Image) -> NDArray[np.bool_]:
    """Return where two dark slots differ by more than their noise, shape (row, col)."""
    change = np.empty(old.shape[:2], np.float32)
    _mean_change(old, new, change)
    noise = 1.4826 * float(np.median(np.abs(change[::4, ::4]))) + 1e-6
    local = cv2.blur(change, (NEIGHBOURHOOD_PX, NEIGHBOURHOOD_PX))
    changed: NDArray[np.bool_] = np.abs(local, out=local) > CHANGED * noise / NEIGHBOURHOOD_PX
    return changed


@compiled
def _mean_change(old: Image, new: Image, change: Image) -> None:
    rows, cols, channels = old.shape
    for row in range(rows):
        for col in range(cols):
            total = np.float32(0)
            for channel in range(channels):
                total += new[row, col, channel] - old[row, col, channel]
            change[row, col] = total / np.float32(channels)


@compiled
def _blend(old: Image, new: Image, old_slots: Image, changed: NDArray[np.bool_], blended: Image, slots: Image) -> None:
    """Average where nothing changed, begin anew where something did."""
    rows, cols, channels = old.shape
    for row in range(rows):
        for col in range(cols):
            spanned = min(old_slots[row, col] + np.float32(1), np.float32(LONGEST_MEMORY))
            count = np.float32(1) if changed[row, col] else spanned
            slots[row, col] = count
            for channel in range(channels):
                before = old[row, col, channel]
                blended[row, col, channel] = before + (new[row, col, channel] - before) / count


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


@compiled
def _subtract_rows(image: Image, ambient: Image, exposures: Image, lit: Image) -> None:
    for row in range(image.shape[0]):
        count = exposures[row]
        for col in range(image.shape[1]):
            value = image[row, col]
            lit[row, col] = value if value >= np.float32(1.0) else value - count * ambient[row, col]
