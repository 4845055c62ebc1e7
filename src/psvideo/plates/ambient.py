"""Ambient light: seen alone in the dark slots, followed through time, taken off every other plate.

A flash lies between two dark slots, and its ambient light is interpolated between what they show: light that changes
steadily is followed. Dark slots are noisy, so each is averaged with those before it, once these are brought to its
level (a dimmer or a cloud changes a whole neighbourhood by one factor): light that does not change costs hardly any
noise. Where the picture still differs by more than noise (someone moved, a shadow fell), the average restarts. Mains
light, which swings from exposure to exposure, is separated row by row (``mains``) and put back for each plate.
"""

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.compute.compiled import EXACT
from psvideo.compute.threads import over_ranges
from psvideo.model.camera import FloatArray
from psvideo.model.coded import Image
from psvideo.model.row_profiles import row_profile
from psvideo.model.timing import Timing
from psvideo.plates.mains import Exposures, Mains, RowLight
from psvideo.plates.mixture import made
from psvideo.plates.split import Plate

LONGEST_MEMORY = 16
"""Dark slots that the average spans at most."""
BLOCKS_PX = ((100, 2), (600, 4))
"""Levels are compared over blocks of so many pixels a side from pictures of so many rows and columns on; those of
smaller pictures as they are."""
LEVEL_SIGMA_PX = {1: 4.0, 2: 8.0, 4: 8.0}
"""Over how many pixels, by a block's size: about 14 blocks of one or two pixels, 7 of four, so that the factor adds
hardly any noise. The window is a Gaussian: a box turns some ripples of the average around, and the average would feed
on them."""
STEADY = 2e-4
"""Ambient light that changed by less than this, in units of saturation, is taken as it is now: interpolating it would
change plates by half of that at most, and reading two pictures costs more than reading a plate's frames."""
LEAST_GAIN, MOST_GAIN = 0.5, 2.0
"""Where light changed by more than these factors between dark slots, the average starts again."""
SPARSE, MOST_JUDGED = 5, 20_000
"""Noise is judged from every fifth pixel of every fifth row, or so many pixels, which is plenty."""
BAND_ROWS = 64
"""Rows that are worked on at a time: a whole number of blocks that fit into a core's second cache."""
NEIGHBOURHOOD_PX = 9
"""What the level does not explain is judged over a square of this width, which averages noise away."""
CHANGED = 4.0
"""A neighbourhood's mean change of this many standard deviations of noise means that the scene has changed there."""


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
    blocks = _block_rows(len(dark.seen), len(coarse))
    coarse = _times_rows(coarse, np.bincount(blocks, factor) / np.bincount(blocks))
    whole = np.bincount(blocks, ~(ambient.known & dark.seen)) == 0
    change = _Change.between(ambient.coarse, coarse, whole, block=_block_px(dark.picture.shape))
    again = ~ambient.known | _first_ripple(ambient.mains, mains)
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
    each = _rows_at_a_time(shape)

    read = dark.picture.reader()

    def look(first: int, last: int) -> tuple[FloatArray, FloatArray, Image]:
        band = read(first, last)
        most = band.reshape(last - first, -1).max(axis=1).astype(np.float64)
        return row_profile(band), most, _reduced(band, shape)

    means, peaks, smalls = zip(*over_ranges(look, shape[0], each=each), strict=True)
    rows = RowLight.of(dark, np.concatenate(means), np.concatenate(peaks))
    return rows, np.concatenate(smalls)


def _block_px(shape: tuple[int, ...]) -> int:
    """Return how many pixels a side of the blocks has over which levels are compared."""
    return max([px for least, px in BLOCKS_PX if min(shape[:2]) >= least], default=1)


def _rows_at_a_time(shape: tuple[int, ...]) -> int:
    """Return how many rows are worked on at a time: all of them where they are no whole number of blocks."""
    block = _block_px(shape)
    return BAND_ROWS if block > 1 and shape[0] % block == 0 else shape[0]


def _coarse_size(shape: tuple[int, ...]) -> tuple[int, int]:
    return shape[0] // _block_px(shape), shape[1] // _block_px(shape)


def _reduced(band: Image, shape: tuple[int, ...]) -> Image:
    """Return the means over blocks of some whole rows of blocks of a picture of that shape, or of all its rows."""
    rows, cols = _coarse_size(shape)
    rows = rows if len(band) == shape[0] else len(band) // _block_px(shape)
    small = cv2.resize(band, (cols, rows), interpolation=cv2.INTER_AREA)
    return np.asarray(small, np.float32).reshape(rows, cols, *shape[2:])


def _block_rows(rows: int, blocks: int) -> NDArray[np.intp]:
    """Return the block in which each row lies, shape (row,)."""
    return np.arange(rows) * blocks // rows


def _blended(
    ambient: Ambient, dark: Plate, gain: Image, restarts: NDArray[np.bool_], factor: FloatArray
) -> tuple[Image, Image, Image]:
    """Return the average with one more dark slot, its rows times a factor; its mean over blocks; and how many slots it
    spans then."""
    image, slots = np.empty_like(ambient.image), np.empty_like(ambient.slots)
    rows, cols = image.shape[:2]
    blocks = np.repeat(_block_rows(cols, slots.shape[1]), image.size // (rows * cols))

    read = dark.picture.reader()

    def blend(first: int, last: int) -> Image:
        band = slice(first, last)
        new = _times_rows(read(first, last), factor[band])
        old, now, level, out = (
            picture.reshape(last - first, -1)
            for picture in (ambient.image[band], new, _enlarged_rows(gain, image.shape, first, last), image[band])
        )
        _blend(old, now, level, ambient.slots[band], restarts[band], dark.seen[band], blocks, out, slots[band])
        return _reduced(image[band], image.shape)

    return image, np.concatenate(over_ranges(blend, rows, each=_rows_at_a_time(image.shape))), slots


def _enlarged_rows(gain: Image, shape: tuple[int, ...], first: int, last: int) -> Image:
    """Return some rows of what is known of blocks, between whose middles it changes steadily."""
    if gain.shape[:2] == shape[:2]:
        return gain[first:last]
    place = np.clip((np.arange(first, last) + 0.5) * len(gain) / shape[0] - 0.5, 0, len(gain) - 1)
    upper = np.minimum(place.astype(np.intp), len(gain) - 2)
    share = (place - upper).astype(np.float32).reshape(-1, *[1] * (gain.ndim - 1))
    between = gain[upper] + share * (gain[upper + 1] - gain[upper])
    wide = cv2.resize(between, (shape[1], last - first), interpolation=cv2.INTER_LINEAR)
    return np.ascontiguousarray(wide, np.float32)


def _first_ripple(before: Mains, after: Mains) -> bool:
    """Tell whether a ripple is known that is still in the earlier picture."""
    return before.ripple is None and after.ripple is not None


def _times_rows(image: Image, factor: NDArray[np.floating]) -> Image:
    if (factor == 1).all():
        return image
    scaled: Image = image * factor.astype(np.float32).reshape(-1, *[1] * (image.ndim - 1))
    return scaled


@dataclass(frozen=True, kw_only=True)
class _Change:
    """From one dark slot to the next: the ``gain`` of each neighbourhood, (row, col[, channel]) of blocks, and where
    (row, col) it does not explain what is seen, so that the average ``restarts``."""

    gain: Image
    restarts: NDArray[np.bool_]

    @classmethod
    def between(cls, old: Image, new: Image, both: NDArray[np.bool_], *, block: int) -> "_Change":
        """Compare two pictures in the rows that both show; they are means over blocks of so many pixels a side."""
        gain = _gain(old, new, both, block=block)
        width = max(NEIGHBOURHOOD_PX // block | 1, 3) if block > 1 else NEIGHBOURHOOD_PX
        before, now, factor = (picture.reshape(*old.shape[:2], -1) for picture in (old, new, gain))
        rest, level = (
            np.where(both[:, None], _mean(picture), np.float32(0)) for picture in (now - factor * before, now)
        )
        local = np.asarray(cv2.blur(rest, (width, width)), np.float32)
        variance, per_level = _noise(rest[both].ravel(), level[both].ravel())
        shifts = np.float32(width * _bent(rest[both].mean(axis=1, keepdims=True)) ** 2)
        most = np.float32((CHANGED / width) ** 2) * (variance + shifts + per_level * np.maximum(level, 0))
        restarts = local * local > most
        limited = (factor <= np.float32(LEAST_GAIN)) | (factor >= np.float32(MOST_GAIN))
        return cls(gain=gain, restarts=restarts | limited.any(axis=2) if limited.any() else restarts)

    def is_steady(self, level: Image) -> bool:
        """Tell whether hardly anything of this light, (row, col[, channel]) of blocks, changed by more than noise."""
        change = np.abs(self.gain[::SPARSE] - 1) * np.maximum(level[::SPARSE], 0)
        return bool(np.quantile(change, 0.999) < STEADY and self.restarts.mean() < 1e-3)


def _mean(picture: Image) -> Image:
    """Return the mean over channels; numpy is slow along a short last axis."""
    channels = picture.shape[2]
    return np.asarray(cv2.transform(picture, np.full((1, channels), 1 / channels, np.float32)), np.float32)


def _gain(old: Image, new: Image, both: NDArray[np.bool_], *, block: int) -> Image:
    """Return by which factor each neighbourhood's light changed, of the pictures' shape; 1 where it is dark."""
    shown, sigma = both.astype(np.float32), LEVEL_SIGMA_PX[block] / block
    small = [
        cv2.GaussianBlur(picture if both.all() else _times_rows(picture, shown), (0, 0), sigma)
        for picture in (old, new)
    ]
    change = new - old
    noise = max(_usual(np.diff(change[::SPARSE], axis=1)), _bent(change[:, ::SPARSE])) * block
    floor = np.float32(2 * noise + 1e-5)
    gain = (np.maximum(small[1], 0) + floor) / (np.maximum(small[0], 0) + floor)
    return np.clip(gain, LEAST_GAIN, MOST_GAIN).reshape(old.shape).astype(np.float32, copy=False)


def _usual(step: Image) -> float:
    """Return the standard deviation of either sample of a step, by the quieter half, which texture spares."""
    return 2.1 * float(np.percentile(np.abs(step), 25)) if step.size else 0.0


def _bent(change: Image) -> float:
    """Return the standard deviation by how much a change bends from row to row: light that changes down the rows hardly
    bends it, rows that a codec or a sensor shifts as a whole do."""
    return _usual(np.diff(change, 2, axis=0)) / float(np.sqrt(3))


def _noise(rest: Image, level: Image) -> tuple[np.float32, np.float32]:
    """Return the variance of what is left without light, and per unit of light: read noise and photon noise."""
    step = max(len(rest) // MOST_JUDGED, 1)
    rest, level = rest[::step], level[::step]
    if len(rest) < 64:
        return np.float32(1e-12), np.float32(0)
    order = np.array_split(np.argsort(level), 8)
    levels = np.array([np.mean(level[part]) for part in order])
    variances = np.array([(1.4826 * np.median(np.abs(rest[part] - np.median(rest[part])))) ** 2 for part in order])
    per_level, variance = np.polyfit(levels, variances, 1) if np.ptp(levels) > 1e-4 else (0.0, variances.mean())
    return np.float32(max(variance, variances.min(), 1e-12)), np.float32(max(per_level, 0.0))


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


def with_darks_ahead(plates: Iterator[Plate], timing: Timing) -> tuple[Iterator[Plate], Iterator[Plate]]:
    """Return a clip's plates, and the dark slots among them ahead of the others, which wait meanwhile.

    No plate is made for waiting: it holds the frames that it will be made of.
    """
    waiting: deque[Plate] = deque()
    unseen: deque[Plate] = deque()
    complete = [flash.index for flash in timing.flashes if flash.is_dark and flash.complete]
    last = max(complete, default=-1)

    def pull() -> bool:
        plate = next(plates, None)
        if plate is None:
            return False
        waiting.append(plate)
        unseen.extend([plate] if plate.flash.is_dark else [])
        return True

    def coming() -> Iterator[Plate]:
        while waiting or pull():
            yield waiting.popleft()

    def darks() -> Iterator[Plate]:
        found = -1
        while found < last:
            while not unseen:
                if not pull():
                    return
            found = unseen[0].flash.index
            yield unseen.popleft()

    return coming(), darks()


def subtract(plates: Iterable[Plate], *, darks: Iterable[Plate] = (), waits: bool = True) -> Iterator[Plate]:
    """Yield the plates with ambient light taken off the lit ones; dark slots pass as the average at their moment.

    ``darks`` are the clip's dark slots, read ahead of the plates: no further than the one after the current plate.
    ``waits`` False: not even that while the light is steady, so that few frames are held; then the next dark slot is
    read when it passes. Before the first and after the last, its light is taken as it is. Without any, plates keep
    theirs.
    """
    coming = iter(darks)
    before = after = None
    for plate in plates:
        while after is None or _is_stale(after, plate, waits=waits or not after.steady):
            dark = next(coming, None)
            if dark is None:
                before = after
                break
            before = None
            later = update(after, dark)
            alone = after is None or later.steady or _first_ripple(after.mains, later.mains)
            before = later if alone else after
            after = later
            del dark, later  # pictures are held only as long as they are needed
        if after is not None and not plate.flash.is_dark:
            plate = _without(plate, before or after, after)
        elif after is not None:
            plate = replace(plate, picture=made(after.image), seen=after.known)
        yield plate
        del plate


def _is_stale(after: Ambient, plate: Plate, *, waits: bool) -> bool:
    """Tell whether a plate asks for a later dark slot: for the next one, or, where none waits, for itself."""
    return after.index < plate.flash.index and (plate.flash.is_dark or waits)


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
