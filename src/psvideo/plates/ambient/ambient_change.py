"""What changed from one dark slot to the next beyond noise: the level of the light, or the scene."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.compute.ranks import median, quantile, rising_parts
from psvideo.model.arrays import Image
from psvideo.plates.ambient.ambient_blocks import times_rows

LEVEL_SIGMA_PX = {1: 4.0, 2: 8.0, 4: 8.0}
"""Over how many pixels, by a block's size: about 14 blocks of one or two pixels, 7 of four, so that the factor adds
hardly any noise. The window is a Gaussian: a box turns some ripples of the average around, and the average would feed
on them."""
STEADY = 2e-4
"""Ambient light that changed by less than this, in units of saturation, is taken as it is now: interpolating it would
change plates by half of that at most, and reading two pictures costs more than reading a plate's frames. Nor does an
average start again for it: where a file cuts noise off at black, what is left of it looks like less than it is."""
LEAST_GAIN, MOST_GAIN = 0.5, 2.0
"""Where light changed by more than these factors between dark slots, the average starts again."""
SPARSE, MOST_JUDGED = 5, 20_000
"""Noise is judged from every fifth pixel of every fifth row, or this many pixels, which is plenty."""
NEIGHBOURHOOD_PX = 9
"""What the level does not explain is judged over a square of this width, which averages noise away."""
CHANGED = 4.0
"""A neighbourhood's mean change of this many standard deviations of noise means that the scene has changed there."""


@dataclass(frozen=True, kw_only=True)
class AmbientChange:
    """From one dark slot to the next: the ``gain`` of each neighbourhood, (row, col[, channel]) of blocks, and where
    (row, col) it does not explain what is seen, so that the average ``restarts``."""

    gain: Image
    restarts: NDArray[np.bool_]

    @classmethod
    def between(cls, old: Image, new: Image, both: NDArray[np.bool_], *, block: int) -> "AmbientChange":
        """Compare two pictures in the rows that both show; they are means over blocks of this many pixels a side."""
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
        most = np.maximum(most, np.float32((STEADY / 2) ** 2))
        restarts = local * local > most
        limited = (factor <= np.float32(LEAST_GAIN)) | (factor >= np.float32(MOST_GAIN))
        return cls(gain=gain, restarts=restarts | limited.any(axis=2) if limited.any() else restarts)

    def is_steady(self, level: Image) -> bool:
        """Return whether hardly anything of this light, (row, col[, channel]) of blocks, changed by more than noise."""
        change = np.abs(self.gain[::SPARSE] - 1) * np.maximum(level[::SPARSE], 0)
        return bool(quantile(change, 0.999) < STEADY and self.restarts.mean() < 1e-3)


def _mean(picture: Image) -> Image:
    """Return the mean over channels; numpy is slow along a short last axis."""
    channels = picture.shape[2]
    return np.asarray(cv2.transform(picture, np.full((1, channels), 1 / channels, np.float32)), np.float32)


def _gain(old: Image, new: Image, both: NDArray[np.bool_], *, block: int) -> Image:
    """Return by which factor each neighbourhood's light changed, of the pictures' shape; 1 where it is dark."""
    shown, sigma = both.astype(np.float32), LEVEL_SIGMA_PX[block] / block
    small = [
        cv2.GaussianBlur(picture if both.all() else times_rows(picture, shown), (0, 0), sigma) for picture in (old, new)
    ]
    change = new - old
    noise = max(_usual(np.diff(change[::SPARSE], axis=1)), _bent(change[:, ::SPARSE])) * block
    floor = np.float32(2 * noise + 1e-5)
    gain = (np.maximum(small[1], 0) + floor) / (np.maximum(small[0], 0) + floor)
    return np.clip(gain, LEAST_GAIN, MOST_GAIN).reshape(old.shape).astype(np.float32, copy=False)


def _usual(step: Image) -> float:
    """Return the standard deviation of either sample of a step, by the quieter half, which texture spares."""
    return 2.1 * quantile(np.abs(step), 0.25) if step.size else 0.0


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
    order = rising_parts(level, 8)
    levels = np.array([np.mean(level[part]) for part in order])
    variances = np.array([(1.4826 * median(np.abs(rest[part] - median(rest[part])))) ** 2 for part in order])
    per_level, variance = np.polyfit(levels, variances, 1) if np.ptp(levels) > 1e-4 else (0.0, variances.mean())
    return np.float32(max(variance, variances.min(), 1e-12)), np.float32(max(per_level, 0.0))
