"""Blocks of pixels over which levels of ambient light are compared; pictures are processed in bands of whole blocks."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.threads import over_ranges
from psvideo.model.arrays import Image

BLOCKS_PX = ((100, 2), (600, 4))
"""Levels are compared over blocks of this many pixels a side from pictures of this many rows and columns on; those of
smaller pictures as they are. The last block takes what rows and columns are left."""
BAND_ROWS = 64
"""Rows that are worked on at a time: a whole number of blocks."""


def block_px(shape: tuple[int, ...]) -> int:
    """Return how many pixels a side of the blocks has over which levels are compared."""
    return max([px for least, px in BLOCKS_PX if min(shape[:2]) >= least], default=1)


def no_blocks(shape: tuple[int, ...]) -> Image:
    """Return room for what is to be known of a picture's blocks, (row, col, channel) of them."""
    block = block_px(shape)
    return np.empty((shape[0] // block, shape[1] // block, *(shape[2:] or (1,))), np.float32)


def block_rows(rows: int, blocks: int) -> NDArray[np.intp]:
    """Return the block in which each row lies, shape (row,)."""
    return np.minimum(np.arange(rows) // (rows // blocks), blocks - 1)


def over_bands(run: Callable[[int, int], None], shape: tuple[int, ...]) -> None:
    """Call ``run(first, last)`` for bands of rows, each of whole blocks, side by side."""
    block = block_px(shape)
    edges = [*range(0, shape[0] // block * block, BAND_ROWS), shape[0]]
    bands = list(pairwise(edges))
    over_ranges(lambda place, _: run(*bands[place]), len(bands), each=1)


def times_rows(image: Image, factor: NDArray[np.floating]) -> Image:
    """Return a picture (row, col[, channel]), each row times its factor (row,); the same one where all are 1."""
    if (factor == 1).all():
        return image
    scaled: Image = image * factor.astype(np.float32).reshape(-1, *[1] * (image.ndim - 1))
    return scaled
