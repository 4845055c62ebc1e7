"""Blocks of pixels, over which levels of ambient light are compared; pictures are worked on in bands of whole ones."""

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.model.coded import Image

BLOCKS_PX = ((100, 2), (600, 4))
"""Levels are compared over blocks of so many pixels a side from pictures of so many rows and columns on; those of
smaller pictures as they are."""
BAND_ROWS = 64
"""Rows that are worked on at a time: a whole number of blocks that fit into a core's second cache."""


def block_px(shape: tuple[int, ...]) -> int:
    """Return how many pixels a side of the blocks has over which levels are compared."""
    return max([px for least, px in BLOCKS_PX if min(shape[:2]) >= least], default=1)


def rows_at_a_time(shape: tuple[int, ...]) -> int:
    """Return how many rows are worked on at a time: all of them where they are no whole number of blocks."""
    block = block_px(shape)
    return BAND_ROWS if block > 1 and shape[0] % block == 0 else shape[0]


def _coarse_size(shape: tuple[int, ...]) -> tuple[int, int]:
    return shape[0] // block_px(shape), shape[1] // block_px(shape)


def reduced(band: Image, shape: tuple[int, ...]) -> Image:
    """Return the means over blocks of some whole rows of blocks of a picture of that shape, or of all its rows."""
    rows, cols = _coarse_size(shape)
    rows = rows if len(band) == shape[0] else len(band) // block_px(shape)
    small = cv2.resize(band, (cols, rows), interpolation=cv2.INTER_AREA)
    return np.asarray(small, np.float32).reshape(rows, cols, *shape[2:])


def block_rows(rows: int, blocks: int) -> NDArray[np.intp]:
    """Return the block in which each row lies, shape (row,)."""
    return np.arange(rows) * blocks // rows


def enlarged_rows(gain: Image, shape: tuple[int, ...], first: int, last: int) -> Image:
    """Return some rows of what is known of blocks, between whose middles it changes steadily."""
    if gain.shape[:2] == shape[:2]:
        return gain[first:last]
    place = np.clip((np.arange(first, last) + 0.5) * len(gain) / shape[0] - 0.5, 0, len(gain) - 1)
    upper = np.minimum(place.astype(np.intp), len(gain) - 2)
    share = (place - upper).astype(np.float32).reshape(-1, *[1] * (gain.ndim - 1))
    between = gain[upper] + share * (gain[upper + 1] - gain[upper])
    wide = cv2.resize(between, (shape[1], last - first), interpolation=cv2.INTER_LINEAR)
    return np.ascontiguousarray(wide, np.float32)


def times_rows(image: Image, factor: NDArray[np.floating]) -> Image:
    if (factor == 1).all():
        return image
    scaled: Image = image * factor.astype(np.float32).reshape(-1, *[1] * (image.ndim - 1))
    return scaled
