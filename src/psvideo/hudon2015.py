"""The published baseline: Algorithm 1 of the paper, faithful, to compare with (``psvideo split --method hudon2015``).

It follows each frame's darkest row and joins the rows below it with the rows above the next frame's. It knows of no
weights, so black bands, a void background, ambient light, a short readout or a wrap of the dark row mislead it.
"""

from collections.abc import Iterable, Iterator
from itertools import pairwise

import numpy as np

from psvideo.camera import Camera, FloatArray
from psvideo.profiles import LinearFrame
from psvideo.split import Image, Plate
from psvideo.timing import Flash, Timing

REC709_LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)


def split(frames: Iterable[LinearFrame], camera: Camera, timing: Timing) -> Iterator[Plate]:
    """Yield one plate for every pair of frames, named by counting flashes on from the one that frame 0 ends with.

    The timing gives names and durations only; the rows are Algorithm 1's own. One exposure's ambient light stays.
    """
    flashes = _from_first_frame(camera, timing)
    dark_row: int | None = None
    adjust = 0.0
    for (current, following), flash in zip(pairwise(frames), flashes, strict=False):
        rows = current.image.shape[0]
        if dark_row is None:
            dark_row = int(np.argmin(luminance_energy(current.image)))
        offset = flash.duration_s / camera.exposure_s * rows  # eq. 13
        expected = (dark_row + offset + adjust) % rows
        found = _darkest_around(luminance_energy(following.image), expected)
        adjust = found - expected
        image = _join(current.image, dark_row, following.image, found)
        dark_row = found
        if flash.complete:
            yield Plate(flash=flash, image=image, exposures=np.ones(rows), seen=np.ones(rows, np.bool_))


def luminance_energy(image: Image) -> FloatArray:
    """Return the sum of the luminance of every row, shape (row,) (eq. 12)."""
    luminance = image @ REC709_LUMINANCE if image.ndim == 3 else image
    energy: FloatArray = luminance.sum(axis=1, dtype=np.float64)
    return energy


def _darkest_around(energy: FloatArray, expected: float) -> int:
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


def _from_first_frame(camera: Camera, timing: Timing) -> tuple[Flash, ...]:
    """Return the flashes from the first one that lights the last row of frame 0 wholly or in part."""
    last_row_opens_s = float(camera.row_offsets_s().max())
    begun = [flash.start_s + flash.duration_s > last_row_opens_s for flash in timing.flashes]
    return timing.flashes[begun.index(True) :] if any(begun) else ()
