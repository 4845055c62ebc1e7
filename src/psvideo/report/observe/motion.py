"""How fast things move through the picture: flow between the plates of one light, round after round, on small pictures.

Only what changed by more than noise is asked for its flow, so that noise does not pass for motion.
"""

from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.compute.ranks import median, quantile
from psvideo.model.arrays import Bytes, Flags, Floats
from psvideo.plates.align.shake.registered import Shift, correlation, registered, shifted
from psvideo.plates.align.velocity.flow import TOE, pixel_places
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.several_lights.clipped_flashes import coarser, filled_of, vague_between
from psvideo.report.observe.shown_alike import Place, shown_alike, thinner

WIDTH_PX = 480
LEAST_CHANGE, NOISE_FACTOR = 1.5, 5.0
"""Blocks of 8 pixels moved where they changed by more codes than the first, and by the second times their noise."""
LEAST_BLOCKS, FEW_BLOCKS = 0.002, 0.02
"""A share of the blocks that changed which is no more than chance; and one that is hardly more: little moved, or so
much that it passes for noise."""
FASTEST = 0.95
"""The speed reported is that of the fastest twentieth of what moves."""
BESIDE_PX = 9
"""What changes lies well within the blocks that changed: these reach beyond it by half of this."""
RETURN_PX = 0.7
EXPLAINED, DETAIL_PX, SHADING_CODES = 0.7, 9, 12.0
"""What changed is explained where plates differ along the flow by less than this share of what they do at rest,
over this many pixels: flow that fits by chance leads there and back as well. Less than the last may be shading that
turns."""
WHITE, AGREE, ALIKE = 0.15, 0.02, 0.8
"""What changes is noise where neighbours change alike by less than the first; and a picture did not shift where one
shift makes details alike by less than the second more, or by less than the third."""
ALIKE_PX, GAINS, BEYOND_CHANCE = 17, 0.05, 3.0
"""By how much a shift makes detail more alike is averaged over so many pixels. Something goes by where that is more
than the second share of the most of it, and so many times what chance makes of it: as much is lost by it elsewhere."""
DARK_CODES, NEARLY_ALL = 30, 0.8
"""What has no more of the first is dark; where more than the second of the rest goes by, all of the picture does."""
FOLLOWED = 0.3
"""Where there and back meet for less than this share of what changed, or explain less of it, flow gives no speed."""


@dataclass(frozen=True, kw_only=True)
class Glimpse:
    """A plate as motion is judged by: ``codes`` (row, col), how many picture pixels one of theirs is, and when; which
    rows it shows, ``shown`` (row, 1), or (1, col) where they are columns, and where it says nothing, ``filled``."""

    codes: NDArray[np.uint8]
    scale: float
    time_s: float
    white: float
    shown: Flags
    filled: Bytes | None = None


@dataclass(frozen=True, kw_only=True)
class Motion:
    """Speed of the fastest things in pixels of the picture per second, and which share of the picture moves: all of it
    where nearly all that is lit shifts alike. The speed
    is None where most of what changes cannot be followed from one round to the next. ``changed`` (row, col), of the
    glimpses' pixels, is what they do not show alike, moving shadows too; None where nothing changed."""

    speed_px_s: float | None
    share: float
    changed: Flags | None = None


def glimpse(plate: LightPlate, white: float | None = None) -> Glimpse:
    """Return what to keep of a plate; ``white`` is the light of the brightest code, left out: the plate's own.

    What is clipped is white: in rows that two frames share it would seem brighter, and they roll.
    """
    rows, cols = plate.shape[:2]
    step = max(round(cols / (2 * WIDTH_PX)), 1)
    step *= 2 if -(-cols // step) > WIDTH_PX else 1
    step = min(step, rows)
    chosen = range(0, rows - step + 1, step)  # few rows are made, and means taken along them
    grey = plate.picture.channel(1, chosen)
    if step > 1:
        grey = np.asarray(cv2.resize(grey, (cols // step, len(grey)), interpolation=cv2.INTER_AREA), np.float32)
    white = white or min(max(1.2 * quantile(grey[::2, ::2], 0.995), 1e-3), plate.saturation)
    grey /= np.float32(white)
    np.maximum(np.minimum(grey, 1, out=grey), 0, out=grey)
    grey += np.float32(TOE)
    np.sqrt(grey, out=grey)
    grey -= np.float32(np.sqrt(TOE))
    grey *= np.float32(255 / (np.sqrt(1 + TOE) - np.sqrt(TOE)))
    codes = (grey + np.float32(0.5)).astype(np.uint8)
    shown = thinner(plate.lines_seen, chosen, step)
    scale_px = plate.shape[1] / grey.shape[1]
    filled = coarser(filled_of(plate, chosen), 1, step)
    return Glimpse(codes=codes, scale=scale_px, time_s=plate.time_s, white=white, shown=shown, filled=filled)


def motion_between(before: Glimpse, after: Glimpse) -> Motion | None:
    """Return what moved between two plates of one light, as a share of what both show; None where that is little."""
    place = shown_alike(before.codes, after.codes, before.shown & after.shown)
    if place is None:
        return None
    if (vague := vague_between(before.filled, after.filled)) is not None:
        after = replace(after, codes=np.where(vague, before.codes, after.codes))
    found = _motion(before, after, place)
    if found.changed is None:
        return found
    changed = np.zeros(before.codes.shape, np.bool_)
    changed[place] = found.changed
    return replace(found, changed=changed)


def _motion(before: Glimpse, after: Glimpse, place: Place) -> Motion:
    """Return what moved in the place that two pictures both show."""
    one, other = (picture.codes[place].astype(np.float32) for picture in (before, after))
    change = _change(one, other)
    changed = _changed(change)
    share, still = np.count_nonzero(changed) / changed.size, Motion(speed_px_s=0.0, share=0.0)
    if share <= FEW_BLOCKS and (shift := _shifted(one, other, change)) is not None:
        speed_px_s = float(np.hypot(*shift.px)) * before.scale / abs(after.time_s - before.time_s)
        goes_by = _goes_by(one, other, shift)
        if np.count_nonzero(goes_by & (one > DARK_CODES)) > NEARLY_ALL * np.count_nonzero(one > DARK_CODES):
            goes_by = np.ones_like(changed)  # what is dark is alike wherever it goes
        return Motion(speed_px_s=speed_px_s, share=float(goes_by.mean()), changed=goes_by)
    if share <= LEAST_BLOCKS:
        return still
    forward, backward = _flow(before.codes, after.codes, place)
    returns = changed & _returns(forward, backward)
    followed = returns & _explained(one, other, forward)
    if followed.sum() < FOLLOWED * changed.sum():
        return Motion(speed_px_s=None, share=share, changed=_well_within(changed))
    way = np.hypot(forward[..., 0], forward[..., 1])[followed] * before.scale
    speed = quantile(way, FASTEST) / abs(after.time_s - before.time_s)
    return Motion(speed_px_s=speed, share=float(returns.mean()), changed=_well_within(changed))


def _flow(before: Bytes, after: Bytes, place: Place) -> tuple[Floats, Floats]:
    """Return the flow there and back in a place, (row, col, 2), mirrored beyond it: OpenCV's search ends the process on
    a piece of 31 rows and 96 columns, and is held back by what rests beside it."""
    search: Any = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_FAST)
    beyond = [(part.start, size - part.stop) for part, size in zip(place, before.shape, strict=True)]
    one, other = (np.pad(picture[place], beyond, mode="symmetric") for picture in (before, after))
    forward, backward = (search.calc(*pair, None)[place] for pair in ((one, other), (other, one)))
    return forward, backward


def _changed(change: Floats) -> NDArray[np.bool_]:
    """Return where the change from one picture to another is more than noise, (row, col)."""
    mean = cv2.blur(change, (3, 3))
    noise = 1.4826 * median(np.abs(change[::2, ::2] - mean[::2, ::2])) * np.sqrt(9 / 8)
    squares = cv2.blur(mean * mean, (8, 8))
    local = np.sqrt(np.maximum(squares, 0))  # running sums may leave a little less than nothing
    return np.asarray(local > max(LEAST_CHANGE, NOISE_FACTOR * noise / 3))


def _change(one: Floats, other: Floats) -> Floats:
    """Return by how much pictures differ beside one factor of all light, whose change is none."""
    early, late = one[::2, ::2], other[::2, ::2]  # medians of a quarter are as good
    bright = early > DARK_CODES
    level = median(late[bright] / early[bright]) if bright.any() else 1.0
    return np.asarray(other - one * np.float32(level), np.float32)


def _shifted(one: Floats, other: Floats, change: Floats) -> Shift | None:
    """Return by how much fine detail shifted, None where it did not: what goes by everywhere looks like noise, but
    neighbours go by together, and one shift brings it back."""
    change = change[::2]
    size = max(float(np.mean(change * change, dtype=np.float64)), 1e-12)
    if abs(float(np.mean(change[:, 1:] * change[:, :-1], dtype=np.float64))) < WHITE * size:
        return None
    details = _detail(one), _detail(other)
    shift = registered(*details)
    if shift.alike < max(correlation(*details) + AGREE, ALIKE) or not shift.px.any():
        return None
    return shift


def _goes_by(one: Floats, other: Floats, shift: Shift) -> Flags:
    """Return where a shift makes detail more alike than the same shift the other way, which smooths it as much, (row,
    col): all of a wall that goes by, and of a cloth before a smooth wall the cloth alone. What is smooth looks the same
    wherever it goes."""
    detail, there = _detail(one), _detail(other)
    back, forth = (shifted(there, way * shift.px) for way in (-1, 1))
    gains = cv2.blur(detail * (back - forth), (ALIKE_PX, ALIKE_PX))
    chance = float(np.sqrt(np.mean(np.minimum(gains, 0) ** 2, dtype=np.float64)))
    return np.asarray(gains > max(GAINS * float(gains.max()), BEYOND_CHANCE * chance))


def _detail(picture: Floats) -> Floats:
    return np.asarray(picture - cv2.blur(picture, (DETAIL_PX, DETAIL_PX)), np.float32)


def _well_within(changed: Flags) -> Flags:
    return np.asarray(cv2.erode(changed.view(np.uint8), np.ones((BESIDE_PX, BESIDE_PX), np.uint8)) > 0)


def _explained(one: NDArray[np.float32], other: NDArray[np.float32], way: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Return where flow explains most of what two pictures differ by, or leaves no more than shading, (row, col)."""
    x, y = pixel_places(*way.shape[:2])
    moved = cv2.remap(other, x + way[..., 0], y + way[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    left, change = (cv2.blur((picture - one) ** 2, (DETAIL_PX, DETAIL_PX)) for picture in (moved, other))
    return np.asarray(left < np.maximum(EXPLAINED**2 * change, SHADING_CODES**2))


def _returns(forward: NDArray[np.float32], backward: NDArray[np.float32]) -> NDArray[np.bool_]:
    x, y = pixel_places(*forward.shape[:2])
    back = cv2.remap(backward, x + forward[..., 0], y + forward[..., 1], cv2.INTER_LINEAR)
    missed = np.hypot(*np.moveaxis(forward + back, -1, 0))
    return np.asarray(missed < RETURN_PX + 0.1 * np.hypot(forward[..., 0], forward[..., 1]))
