"""Ambient light: seen alone in the dark slots, followed through time, taken off every other plate.

A flash lies between two dark slots, and its ambient light is interpolated between what they show: light that changes
steadily is followed. Dark slots are noisy, so each is averaged with those before it, once these are brought to its
level (a dimmer or a cloud changes a whole neighbourhood by one factor): light that does not change costs hardly any
noise. Where the picture still differs by more than noise (someone moved, a shadow fell), the average restarts. Mains
light, which swings from exposure to exposure, is separated row by row (``mains``) and put back for each plate.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.compute.compiled import EXACT
from psvideo.model.camera import FloatArray
from psvideo.model.coded import Image
from psvideo.plates.mains import Exposures, Mains, RowLight
from psvideo.plates.mixture import made
from psvideo.plates.split import Plate

LONGEST_MEMORY = 16
"""Dark slots that the average spans at most."""
COARSE, LEVEL_SIGMA_PX = 4, 2.0
"""Levels are compared over about 7 pixels of pictures a quarter as large: the factor adds hardly any noise. The window
is a Gaussian: a box turns some ripples of the average around, and the average would feed on them."""
LEAST_GAIN, MOST_GAIN = 0.5, 2.0
"""Where light changed by more than these factors between dark slots, the average starts again."""
SPARSE = 5
"""Noise is judged from every fifth pixel of every fifth row, which is plenty."""
NEIGHBOURHOOD_PX = 9
"""What the level does not explain is judged over a square of this width, which averages noise away."""
CHANGED = 4.0
"""A neighbourhood's mean change of this many standard deviations of noise means that the scene has changed there."""


@dataclass(frozen=True, kw_only=True)
class Ambient:
    """What one exposure collects of the ambient light, from the dark slots up to one of them.

    ``image`` is averaged over ``slots`` (row, col) and holds for the moments ``middle_s`` (row,). ``known`` (row,) is
    False where no dark slot was seen yet: nothing can be taken off there. The image is free of the ripple of ``mains``,
    where one is known.
    """

    image: Image
    slots: Image
    middle_s: FloatArray
    known: NDArray[np.bool_]
    mains: Mains
    index: int


def update(ambient: Ambient | None, dark: Plate) -> Ambient:
    """Return the ambient light with one more dark slot in it."""
    image = dark.image
    rows = RowLight.of(dark, image)
    if ambient is None:
        slots = np.broadcast_to(dark.seen[:, None], image.shape[:2]).astype(np.float32)
        return Ambient(
            image=image,
            slots=slots,
            middle_s=rows.opened.middle_s,
            known=dark.seen,
            mains=Mains(rows=rows),
            index=dark.flash.index,
        )
    mains = ambient.mains.next(rows)
    new = image if mains.ripple is None else _times_rows(image, 1 / mains.ripple.swing(rows.opened))
    blended, slots = np.empty_like(new), np.empty_like(ambient.slots)
    change = _Change.between(ambient.image, new, ambient.known & dark.seen)
    restarts = change.restarts | ~ambient.known[:, None] | _first_ripple(ambient.mains, mains)
    old, now, gain, out = (
        picture.reshape(*new.shape[:2], -1) for picture in (ambient.image, new, change.gain, blended)
    )
    _blend(old, now, gain, ambient.slots, restarts, dark.seen, out, slots)
    return Ambient(
        image=blended,
        slots=slots,
        middle_s=np.where(dark.seen, rows.opened.middle_s, ambient.middle_s),
        known=ambient.known | dark.seen,
        mains=mains,
        index=dark.flash.index,
    )


def _first_ripple(before: Mains, after: Mains) -> bool:
    """Tell whether a ripple is known that is still in the earlier picture."""
    return before.ripple is None and after.ripple is not None


def _times_rows(image: Image, factor: NDArray[np.floating]) -> Image:
    scaled: Image = image * factor.astype(np.float32).reshape(-1, *[1] * (image.ndim - 1))
    return scaled


@dataclass(frozen=True, kw_only=True)
class _Change:
    """From one dark slot to the next: the ``gain`` of each neighbourhood, of the image's shape, and where (row, col)
    it does not explain what is seen, so that the average ``restarts``."""

    gain: Image
    restarts: NDArray[np.bool_]

    @classmethod
    def between(cls, old: Image, new: Image, both: NDArray[np.bool_]) -> "_Change":
        """Compare two pictures in the rows that both show."""
        gain = _gain(old, new, both)
        before, now, factor = (picture.reshape(*old.shape[:2], -1) for picture in (old, new, gain))
        rest, level = np.empty(old.shape[:2], np.float32), np.empty(old.shape[:2], np.float32)
        _rest(before, now, factor, both, rest, level)
        local = np.asarray(cv2.blur(rest, (NEIGHBOURHOOD_PX, NEIGHBOURHOOD_PX)), np.float32)
        some = np.flatnonzero(both[::SPARSE]) * SPARSE
        variance, per_level = _noise(rest[some, ::SPARSE].ravel(), level[some, ::SPARSE].ravel())
        restarts = np.empty(rest.shape, np.bool_)
        most = np.float32((CHANGED / NEIGHBOURHOOD_PX) ** 2)
        _beyond(local, level, factor, most * variance, most * per_level, restarts)
        return cls(gain=gain, restarts=restarts)


def _gain(old: Image, new: Image, both: NDArray[np.bool_]) -> Image:
    """Return by which factor each neighbourhood's light changed, of the image's shape; 1 where it is dark."""
    rows, cols = old.shape[:2]
    shrink = COARSE if min(rows, cols) >= 50 * LEVEL_SIGMA_PX else 1
    shown = both.astype(np.float32)
    coarse = [_coarse(picture if both.all() else _times_rows(picture, shown), shrink) for picture in (old, new)]
    small = [cv2.GaussianBlur(picture, (0, 0), LEVEL_SIGMA_PX) for picture in coarse]
    across = np.diff(new[::SPARSE, ::SPARSE] - old[::SPARSE, ::SPARSE], axis=1)
    floor = np.float32(2 * float(np.median(np.abs(across))) + 1e-5) if across.size else np.float32(1e-5)
    gain = (np.maximum(small[1], 0) + floor) / (np.maximum(small[0], 0) + floor)
    gain = np.clip(gain, LEAST_GAIN, MOST_GAIN)
    full = cv2.resize(gain, (cols, rows), interpolation=cv2.INTER_LINEAR) if shrink > 1 else gain
    return np.ascontiguousarray(full, np.float32).reshape(old.shape)


def _coarse(image: Image, shrink: int) -> Image:
    rows, cols = image.shape[:2]
    return np.asarray(cv2.resize(image, (cols // shrink, rows // shrink), interpolation=cv2.INTER_AREA), np.float32)


def _noise(rest: Image, level: Image) -> tuple[np.float32, np.float32]:
    """Return the variance of what is left without light, and per unit of light: read noise and photon noise."""
    if len(rest) < 64:
        return np.float32(1e-12), np.float32(0)
    order = np.array_split(np.argsort(level), 8)
    levels = np.array([np.mean(level[part]) for part in order])
    variances = np.array([(1.4826 * np.median(np.abs(rest[part] - np.median(rest[part])))) ** 2 for part in order])
    per_level, variance = np.polyfit(levels, variances, 1) if np.ptp(levels) > 1e-4 else (0.0, variances.mean())
    return np.float32(max(variance, variances.min(), 1e-12)), np.float32(max(per_level, 0.0))


@EXACT.kept
def _rest(old: Image, new: Image, gain: Image, both: NDArray[np.bool_], rest: Image, level: Image) -> None:
    """Average over channels what the gain leaves unexplained, and the light itself; 0 where a row was not shown."""
    rows, cols, channels = old.shape
    for row in range(rows):
        for col in range(cols):
            total, light = np.float32(0), np.float32(0)
            if both[row]:
                for channel in range(channels):
                    total += new[row, col, channel] - gain[row, col, channel] * old[row, col, channel]
                    light += new[row, col, channel]
            rest[row, col] = total / np.float32(channels)
            level[row, col] = light / np.float32(channels)


@EXACT.kept
def _beyond(
    local: Image,
    level: Image,
    gain: Image,
    variance: np.float32,
    per_level: np.float32,
    restarts: NDArray[np.bool_],
) -> None:
    """Mark where a neighbourhood changed by more than noise, or by a factor beyond its limits."""
    rows, cols, channels = gain.shape
    for row in range(rows):
        for col in range(cols):
            light = max(level[row, col], np.float32(0))
            far = local[row, col] * local[row, col] > variance + per_level * light
            for channel in range(channels):
                factor = gain[row, col, channel]
                far = far or factor <= np.float32(LEAST_GAIN) or factor >= np.float32(MOST_GAIN)
            restarts[row, col] = far


@EXACT.kept
def _blend(
    old: Image,
    new: Image,
    gain: Image,
    old_slots: Image,
    restarts: NDArray[np.bool_],
    seen: NDArray[np.bool_],
    blended: Image,
    slots: Image,
) -> None:
    """Average at the new level, start again where that explains nothing, and keep what was where nothing was seen."""
    rows, cols, channels = old.shape
    for row in range(rows):
        for col in range(cols):
            spanned = min(old_slots[row, col] + np.float32(1), np.float32(LONGEST_MEMORY))
            count = np.float32(1) if restarts[row, col] else spanned
            slots[row, col] = count if seen[row] else old_slots[row, col]
            for channel in range(channels):
                before = old[row, col, channel]
                if seen[row]:
                    before *= gain[row, col, channel]
                    before += (new[row, col, channel] - before) / count
                blended[row, col, channel] = before


def subtract(plates: Iterable[Plate], *, darks: Iterable[Plate] = ()) -> Iterator[Plate]:
    """Yield the plates with ambient light taken off the lit ones; dark slots pass as the average at their moment.

    ``darks`` are the clip's dark slots, read ahead of the plates: no further than the one after the current plate.
    Before the first and after the last, its light is taken as it is. Without any, plates keep theirs.
    """
    coming = iter(darks)
    before = after = None
    for plate in plates:
        while after is None or after.index < plate.flash.index:
            dark = next(coming, None)
            if dark is None:
                before = after
                break
            before = None
            later = update(after, dark)
            before = later if after is None or _first_ripple(after.mains, later.mains) else after
            after = later
            del dark, later  # pictures are held only as long as they are needed
        if after is not None and not plate.flash.is_dark:
            plate = _without(plate, before or after, after)
        elif after is not None:
            plate = replace(plate, picture=made(after.image), seen=after.known)
        yield plate
        del plate


def _without(plate: Plate, before: Ambient, after: Ambient) -> Plate:
    """Take the ambient light of every exposure off, interpolated in time.

    Rows in which the ambient light is not known are no longer seen.
    """
    opened = Exposures(shares=plate.shares, middles_s=plate.middles_s)
    gap_s = after.middle_s - before.middle_s
    late = np.clip((opened.middle_s - before.middle_s) / np.where(gap_s > 0, gap_s, np.inf), 0, 1)
    late = np.where(before.known, np.where(after.known, late, 0.0), 1.0)
    ripple = after.mains.ripple
    exposures = plate.exposures * (1.0 if ripple is None else ripple.swing(opened))
    seen = plate.seen & (before.known | after.known)
    if before is after:
        picture = plate.picture.without((after.image,), exposures[None])
    else:
        picture = plate.picture.without((before.image, after.image), np.stack([1 - late, late]) * exposures)
    return replace(plate, picture=picture.within(seen), shares=np.zeros_like(plate.shares), seen=seen)
