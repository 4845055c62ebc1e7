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

from psvideo.model.arrays import Doubles, Image
from psvideo.model.rows.ripple import Ripple
from psvideo.plates.ambient.ambient_blocks import block_px, block_rows, no_blocks, over_bands, times_rows
from psvideo.plates.ambient.ambient_change import AmbientChange
from psvideo.plates.ambient.ambient_kernel import AveragedDarks, OneMore, average_rows, measure_rows
from psvideo.plates.ambient.ambient_level import AmbientLevel
from psvideo.plates.ambient.mains import Mains, RowLight
from psvideo.plates.split import Plate

LONGEST_MEMORY = 16
"""Dark slots that the average spans at most."""


@dataclass(frozen=True, kw_only=True)
class Ambient:
    """What one exposure collects of the ambient light, from the dark slots up to one of them.

    ``level`` is averaged over ``slots`` (row, block) and holds for the moments ``middle_s`` (row,); ``coarse`` is its
    mean over blocks. ``known`` (row,) is False where no dark slot was seen yet: nothing can be taken off there. The
    level is free of the ripple of ``mains``, where one is known. ``steady``: since the slot before nothing changed that
    is worth interpolating.
    """

    level: AmbientLevel
    coarse: Image
    slots: Image
    middle_s: Doubles
    known: NDArray[np.bool_]
    mains: Mains
    index: int
    steady: bool = False


def update(ambient: Ambient | None, dark: Plate, *, ripple: Ripple | None = None) -> Ambient:
    """Return the ambient light with one more dark slot in it; ``ripple`` is what the timing found of the mains."""
    rows, coarse = _looked_at(dark)
    if ambient is None:
        factor = _freeing(ripple, rows)
        slots = np.broadcast_to(dark.seen[:, None], (len(dark.seen), coarse.shape[1])).astype(np.float32)
        return Ambient(
            level=AmbientLevel.of(times_rows(dark.image, factor)),
            coarse=times_rows(coarse, _over_blocks(factor, len(coarse))),
            slots=slots,
            middle_s=rows.opened.middle_s,
            known=dark.seen,
            mains=Mains(rows=rows, timed=ripple),
            index=dark.flash.index,
        )
    mains = ambient.mains.next(rows)
    factor = _freeing(mains.ripple, rows)
    blocks = block_rows(len(dark.seen), len(coarse))
    coarse = times_rows(coarse, _over_blocks(factor, len(coarse)))
    whole = np.bincount(blocks, ~(ambient.known & dark.seen)) == 0
    change = AmbientChange.between(ambient.coarse, coarse, whole, block=block_px(dark.picture.shape))
    again = ~ambient.known | first_ripple(ambient.mains, mains)
    restarts = change.restarts[blocks] | again[:, None]
    level, reduced, slots = _blended(ambient, dark, change.gain, restarts, factor)
    return Ambient(
        level=level,
        coarse=reduced,
        slots=slots,
        middle_s=np.where(dark.seen, rows.opened.middle_s, ambient.middle_s),
        known=ambient.known | dark.seen,
        mains=mains,
        index=dark.flash.index,
        steady=bool(whole.all()) and change.is_steady(coarse),
    )


def _freeing(ripple: Ripple | None, rows: RowLight) -> Doubles:
    """Return by which factor a dark slot's rows are freed of a ripple, shape (row,)."""
    return np.ones(len(rows.mean)) if ripple is None else 1 / ripple.swing(rows.opened)


def _over_blocks(factor: Doubles, count: int) -> Doubles:
    """Return the means of rows' factors over ``count`` blocks of rows."""
    blocks = block_rows(len(factor), count)
    means: Doubles = np.bincount(blocks, factor) / np.bincount(blocks)
    return means


def _looked_at(dark: Plate) -> tuple[RowLight, Image]:
    """Return a dark slot's rows and the means over its blocks, of which the image itself is not held."""
    bound, shape = dark.picture.bound(), dark.picture.shape
    means, clipped, coarse = np.empty(shape[0]), np.empty(shape[0], np.bool_), no_blocks(shape)
    block = block_px(shape)

    def look(first: int, last: int) -> None:
        bound.run(measure_rows, range(first, last), block, first, last, means, clipped, coarse)

    over_bands(look, shape)
    return RowLight.of(dark, means, clipped), coarse


def _blended(
    ambient: Ambient, dark: Plate, gain: Image, restarts: NDArray[np.bool_], factor: Doubles
) -> tuple[AmbientLevel, Image, Image]:
    """Return the average with one more dark slot, its rows times a factor; its mean over blocks; and how many slots it
    spans then."""
    shape = dark.picture.shape
    level, coarse, slots = AmbientLevel.room(shape), np.empty_like(ambient.coarse), np.empty_like(ambient.slots)
    bound, block = dark.picture.bound(), block_px(shape)
    old, new = AveragedDarks(*ambient.level.planes, ambient.slots), AveragedDarks(*level.planes, slots)
    seen, gains = np.ascontiguousarray(dark.seen), gain.reshape(len(gain), -1)
    one = OneMore(factor=factor.astype(np.float32), seen=seen, restarts=restarts, gain=gains)

    def blend(first: int, last: int) -> None:
        bound.run(average_rows, range(first, last), block, LONGEST_MEMORY, one, old, first, last, new, coarse)

    over_bands(blend, shape)
    return level, coarse, slots


def first_ripple(before: Mains, after: Mains) -> bool:
    """Return whether a ripple is known that is still in the earlier picture."""
    return before.ripple is None and after.ripple is not None
