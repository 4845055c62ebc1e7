"""How linear light and normals become pixels that a screen shows, and large pictures small ones."""

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.compute.ranks import quantile
from psvideo.compute.spilled import let_go
from psvideo.model.arrays import Image, Pixels
from psvideo.model.srgb import srgb_share

BAND_ROWS = 256
"""About this many rows are averaged at a time."""


def smaller(image: NDArray[np.floating], width_px: int) -> Image:
    """Return a picture (row, col[, channel]) averaged down to at most this width, for showing it."""

    def read(first: int, last: int) -> NDArray[np.floating]:
        let_go(image[:first])
        return image[first:last]

    return smaller_by_rows(read, image.shape, width_px)


def smaller_by_rows(read: Callable[[int, int], NDArray[np.floating]], shape: tuple[int, ...], width_px: int) -> Image:
    """Return a picture at most this wide, averaged down, of which ``read(first, last)`` gives rows.

    Only a band of rows is held: whole pictures in float32 are large.
    """
    rows, cols = shape[:2]
    if cols <= width_px:
        return np.asarray(read(0, rows), np.float32)
    factor = min(cols // width_px, rows)
    band, last = factor * max(BAND_ROWS // factor, 1), rows // factor * factor
    coarse = [_averaged(read(first, min(first + band, last)), factor) for first in range(0, last, band)]
    size = (width_px, max(round(rows * width_px / cols), 1))
    planes = [cv2.resize(plane, size, interpolation=cv2.INTER_AREA) for plane in np.concatenate(coarse, axis=1)]
    return np.stack(planes, axis=-1).astype(np.float32).reshape(size[1], size[0], *shape[2:])


def _averaged(band: NDArray[np.floating], factor: int) -> Image:
    """Average squares of a whole number of pixels, which OpenCV does several times faster; (channel, row, col)."""
    rows, cols = (size // factor for size in band.shape[:2])
    if band.flags.c_contiguous and band.dtype == np.float32:
        small = cv2.resize(band[: rows * factor, : cols * factor], (cols, rows), interpolation=cv2.INTER_AREA)
        return np.moveaxis(np.asarray(small, np.float32).reshape(rows, cols, -1), -1, 0)
    channels = np.moveaxis(band[: rows * factor, : cols * factor].reshape(rows * factor, cols * factor, -1), -1, 0)
    squares = (np.ascontiguousarray(channel, np.float32) for channel in channels)
    return np.stack([cv2.resize(one, (cols, rows), interpolation=cv2.INTER_AREA) for one in squares])


def three_channels(image: Image) -> Image:
    """Return a grey picture as three equal channels; a colour picture as it is."""
    return image if image.ndim == 3 else np.repeat(image[..., None], 3, axis=2)


def srgb(linear: Image, *, exposure: float = 1.0) -> Pixels:
    """Return linear light (row, col[, 3]) as 8-bit sRGB pixels (row, col, 3), IEC 61966-2-1; above 1 is white."""
    pixels: Pixels = (255 * srgb_share(three_channels(linear) * np.float32(exposure)) + 0.5).astype(np.uint8)
    return pixels


def normal_colours(normals: NDArray[np.floating]) -> Pixels:
    """Return normals (row, col, 3) in the usual colours, 128 + 127 n; grey where there are none."""
    coded: Pixels = (127.5 * (normals.astype(np.float32) + 1.0) + 0.5).clip(0, 255).astype(np.uint8)
    return coded


def exposure_for(image: Image, *, white: float = 0.8) -> float:
    """Return the factor that puts the brightest hundredth of a picture's pixels at ``white``, for showing it only."""
    bright = quantile(image, 0.99)
    return white / bright if bright > 1e-6 else 1.0
