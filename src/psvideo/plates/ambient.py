"""Ambient light: seen alone in the dark slots, followed through time, taken off every other plate.

A flash lies between two dark slots, and its ambient light is interpolated between what they show: light that changes
steadily is followed. Dark slots are noisy, so each is averaged with those before it, once these are brought to its
level (a dimmer or a cloud changes a whole neighbourhood by one factor): light that does not change costs hardly any
noise. Where the picture still differs by more than noise (someone moved, a shadow fell), the average restarts. Mains
light, which swings from exposure to exposure, is separated row by row (``mains``) and put back for each plate.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.compiled import EXACT
from psvideo.compute.threads import over_ranges
from psvideo.model.camera import FloatArray
from psvideo.model.coded import Image
from psvideo.model.row_profiles import row_profile
from psvideo.plates.ambient_blocks import block_px, block_rows, enlarged_rows, reduced, rows_at_a_time, times_rows
from psvideo.plates.ambient_change import AmbientChange
from psvideo.plates.mains import Mains, RowLight
from psvideo.plates.split import Plate

LONGEST_MEMORY = 16
"""Dark slots that the average spans at most."""


@dataclass(frozen=True, kw_only=True)
class Ambient:
    """What one exposure collects of the ambient light, from the dark slots up to one of them.

    ``image`` is averaged over ``slots`` (row, block) and holds for the moments ``middle_s`` (row,); ``coarse`` is its
    mean over blocks. ``known`` (row,) is False where no dark slot was seen yet: nothing can be taken off there. The
    image is free of the ripple of ``mains``, where one is known. ``steady``: since the slot before nothing changed that
    is worth interpolating.
    """

    image: Image
    coarse: Image
    slots: Image
    middle_s: FloatArray
    known: NDArray[np.bool_]
    mains: Mains
    index: int
    steady: bool = False


def update(ambient: Ambient | None, dark: Plate) -> Ambient:
    """Return the ambient light with one more dark slot in it."""
    rows, coarse = _looked_at(dark)
    if ambient is None:
        slots = np.broadcast_to(dark.seen[:, None], (len(dark.seen), coarse.shape[1])).astype(np.float32)
        return Ambient(
            image=dark.image,
            coarse=coarse,
            slots=slots,
            middle_s=rows.opened.middle_s,
            known=dark.seen,
            mains=Mains(rows=rows),
            index=dark.flash.index,
        )
    mains = ambient.mains.next(rows)
    factor = np.ones(len(dark.seen)) if mains.ripple is None else 1 / mains.ripple.swing(rows.opened)
    blocks = block_rows(len(dark.seen), len(coarse))
    coarse = times_rows(coarse, np.bincount(blocks, factor) / np.bincount(blocks))
    whole = np.bincount(blocks, ~(ambient.known & dark.seen)) == 0
    change = AmbientChange.between(ambient.coarse, coarse, whole, block=block_px(dark.picture.shape))
    again = ~ambient.known | first_ripple(ambient.mains, mains)
    restarts = change.restarts[blocks] | again[:, None]
    image, reduced, slots = _blended(ambient, dark, change.gain, restarts, factor)
    return Ambient(
        image=image,
        coarse=reduced,
        slots=slots,
        middle_s=np.where(dark.seen, rows.opened.middle_s, ambient.middle_s),
        known=ambient.known | dark.seen,
        mains=mains,
        index=dark.flash.index,
        steady=bool(whole.all()) and change.is_steady(coarse),
    )


def _looked_at(dark: Plate) -> tuple[RowLight, Image]:
    """Return a dark slot's rows and the means over its blocks, of which the image itself is not held."""
    shape = dark.picture.shape
    each = rows_at_a_time(shape)

    read = dark.picture.reader()

    def look(first: int, last: int) -> tuple[FloatArray, FloatArray, Image]:
        band = read(first, last)
        most = band.reshape(last - first, -1).max(axis=1).astype(np.float64)
        return row_profile(band), most, reduced(band, shape)

    means, peaks, smalls = zip(*over_ranges(look, shape[0], each=each), strict=True)
    rows = RowLight.of(dark, np.concatenate(means), np.concatenate(peaks))
    return rows, np.concatenate(smalls)


def _blended(
    ambient: Ambient, dark: Plate, gain: Image, restarts: NDArray[np.bool_], factor: FloatArray
) -> tuple[Image, Image, Image]:
    """Return the average with one more dark slot, its rows times a factor; its mean over blocks; and how many slots it
    spans then."""
    image, slots = np.empty_like(ambient.image), np.empty_like(ambient.slots)
    rows, cols = image.shape[:2]
    blocks = np.repeat(block_rows(cols, slots.shape[1]), image.size // (rows * cols))

    read = dark.picture.reader()

    def blend(first: int, last: int) -> Image:
        band = slice(first, last)
        new = times_rows(read(first, last), factor[band])
        old, now, level, out = (
            picture.reshape(last - first, -1)
            for picture in (ambient.image[band], new, enlarged_rows(gain, image.shape, first, last), image[band])
        )
        _blend(old, now, level, ambient.slots[band], restarts[band], dark.seen[band], blocks, out, slots[band])
        return reduced(image[band], image.shape)

    return image, np.concatenate(over_ranges(blend, rows, each=rows_at_a_time(image.shape))), slots


def first_ripple(before: Mains, after: Mains) -> bool:
    """Tell whether a ripple is known that is still in the earlier picture."""
    return before.ripple is None and after.ripple is not None


@EXACT.kept
def _blend(
    old: Image,
    new: Image,
    gain: Image,
    old_slots: Image,
    restarts: NDArray[np.bool_],
    seen: NDArray[np.bool_],
    blocks: NDArray[np.intp],
    blended: Image,
    slots: Image,
) -> None:
    """Average at the new level, start again where that explains nothing, and keep what was where nothing was seen.

    Pictures are (row, sample); ``blocks`` (sample,) are the blocks in which these lie.
    """
    share, shares = np.empty(slots.shape[1], np.float32), np.empty(old.shape[1], np.float32)
    for row in range(old.shape[0]):
        before, now, level, out = old[row], new[row], gain[row], blended[row]
        if not seen[row]:
            slots[row] = old_slots[row]
            out[:] = before
            continue
        for block in range(slots.shape[1]):
            spanned = min(old_slots[row, block] + np.float32(1), np.float32(LONGEST_MEMORY))
            slots[row, block] = np.float32(1) if restarts[row, block] else spanned
            share[block] = np.float32(1) / max(slots[row, block], np.float32(1))
        if share.min() == share.max():  # as usual
            shares[:] = share[0]
        else:
            for sample in range(len(shares)):
                shares[sample] = share[blocks[sample]]
        for sample in range(len(shares)):
            there = before[sample] * level[sample]
            out[sample] = there + (now[sample] - there) * shares[sample]
