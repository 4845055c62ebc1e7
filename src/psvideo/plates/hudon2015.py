"""The published baseline: Algorithm 1 of the paper, faithful, to compare with (``method="hudon2015"`` of ``split``).

It follows each frame's darkest row and joins the rows below it with the rows above the next frame's. It knows of no
weights, so black bands, a void background, ambient light, a short readout or a wrap of the dark row mislead it.
"""

from collections.abc import Iterable, Iterator
from itertools import pairwise

import numpy as np

from psvideo.model.arrays import Doubles, Image
from psvideo.model.camera import Camera
from psvideo.model.coded import LinearFrame
from psvideo.model.timing import Flash, Timing
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.split import Plate

REC709_LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)


def split(frames: Iterable[LinearFrame], camera: Camera, timing: Timing) -> Iterator[Plate]:
    """Yield the plates that Algorithm 1 makes of every pair of frames, the first one where two show the same flash.

    The timing gives durations (eq. 13) and names only: an image belongs to the flash that follows the gap in which the
    dark row was taken to lie. The rows are Algorithm 1's own, and one exposure's ambient light stays in.
    """
    dark_row: int | None = None
    adjust = 0.0
    done = -1
    for current, following in pairwise(frames):
        rows = current.image.shape[0]
        if dark_row is None:
            dark_row = int(np.argmin(luminance_energy(current.image)))
        flash = _flash_after(timing, current.index * camera.frame_period_s + dark_row * camera.row_time_s)
        offset = flash.duration_s / camera.exposure_s * rows  # eq. 13
        expected = (dark_row + offset + adjust) % rows
        found = _darkest_around(luminance_energy(following.image), expected)
        adjust = found - expected
        image = _join(current.image, dark_row, following.image, found)
        dark_row = found
        if flash.complete and flash.index != done:
            done = flash.index
            middles_s = current.index * camera.frame_period_s + camera.row_offsets_s() + camera.exposure_s / 2
            shares, seen = np.ones((1, rows)), np.ones(rows, np.bool_)
            yield Plate(flash=flash, picture=mixture_of(image), shares=shares, middles_s=middles_s[None], seen=seen)


def luminance_energy(image: Image) -> Doubles:
    """Return the sum of the luminance of every row, shape (row,) (eq. 12)."""
    luminance = image @ REC709_LUMINANCE if image.ndim == 3 else image
    energy: Doubles = luminance.sum(axis=1, dtype=np.float64)
    return energy


def _darkest_around(energy: Doubles, expected: float) -> int:
    """Return the row of least energy within a hundredth of the height around the expected one."""
    reach = max(len(energy) // 100, 1)
    low = int(np.clip(round(expected) - reach, 0, len(energy) - 1))
    high = int(np.clip(round(expected) + reach, 0, len(energy) - 1))
    return low + int(np.argmin(energy[low : high + 1]))


def _join(current: Image, current_dark_row: int, following: Image, following_dark_row: int) -> Image:
    """Sum the current frame below its dark row and the following one down to its own (lines 9, 14 and 15)."""
    total = np.zeros_like(current)
    total[current_dark_row + 1 :] = current[current_dark_row + 1 :]
    total[: following_dark_row + 1] += following[: following_dark_row + 1]
    return total


def _flash_after(timing: Timing, gap_s: float) -> Flash:
    """Return the flash that starts nearest to one exposure after ``gap_s``, where the one before it ended (eq. 1)."""
    return timing.flashes[int(np.argmin(np.abs(timing.start_s - gap_s - timing.exposure_s)))]
