"""What colour a moving surface has, from flashes that show it in different places: needed where one flash must do.

Where lamps exchange their colours, what three flashes show of a resting surface is ``albedo_c * shading_p``, for
every lamp p and channel c: a matrix of rank 1. Where something moved, single pixels contradict that; sums over a
neighbourhood in which the same surface stays do not, and their rank-1 part is its colour.
"""

from functools import reduce

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.model.coded import Image

Flags = NDArray[np.bool_]

CONTRADICTION = 0.05
"""Flashes whose products leave a larger share of themselves unexplained show different surfaces: normals that are some
8 degrees apart leave so much, and noise of 5 % of the light."""
MOVED = 0.1
"""So much leaves no doubt that something moved between them, and that flow did not bring it together."""
WINDOW_PX = 5
"""Contradictions are looked for in means over so many pixels: noise makes less of them."""
NEIGHBOURHOODS = (1 / 24, 1 / 8, 1 / 3, 2.0)
"""Widths, in shares of the picture's longer side, in which the flashes are asked to agree, the smallest first."""
LEAST_PX = 11
"""... and no narrower than that, where pictures are small."""
STEPS = 6
"""Of the power iteration: a rank-1 matrix is there after one."""
LEAST = 0.02
"""No channel of a surface is darker than this share of its brightest: noise would be all that is divided."""


def contradicted(products: Image) -> Flags:
    """Return where the flashes show different surfaces, (row, col); ``products`` are (lamp, row, col, channel)."""
    rest, whole = _unexplained(products)
    window = (WINDOW_PX, WINDOW_PX)
    return np.asarray(cv2.blur(rest, window) > MOVED**2 * cv2.blur(whole, window))


def colours_of(products: Image, where: Flags) -> Image:
    """Return the colour (row, col, channel), the brightest channel 1, that the smallest neighbourhood shows in which
    the flashes agree; only pixels ``where`` something is wanted to be known count."""
    rows, cols = where.shape
    weight = where.astype(np.float32)
    kept = products * weight[..., None]
    colour = np.ones((rows, cols, products.shape[-1]), np.float32)
    open_yet = where.copy()
    for share in NEIGHBOURHOODS:
        size = max(2 * int(share * max(rows, cols) / 2) + 1, LEAST_PX)
        sums = np.stack(
            [cv2.boxFilter(lamp, -1, (size, size), normalize=False, borderType=cv2.BORDER_CONSTANT) for lamp in kept]
        )
        rest, whole = _unexplained(sums)
        agree = open_yet & ((rest <= CONTRADICTION**2 * whole) | (share == NEIGHBOURHOODS[-1]))
        colour[agree] = _colour(sums)[agree]
        open_yet &= ~agree
    return colour


def _gram(products: Image) -> Image:
    return np.asarray(np.einsum("prcx,prcy->rcxy", products, products), np.float32)


def _colour(products: Image) -> Image:
    """Return the channels' part of the rank-1 matrix nearest to the products, (row, col, channel)."""
    gram = _gram(products)
    colour = np.ones(products.shape[1:], np.float32)
    for _ in range(STEPS):
        colour = np.einsum("rcxy,rcy->rcx", gram, colour)
        colour /= np.maximum(_most(np.abs(colour)), np.float32(1e-20))[..., None]
    return np.maximum(colour, np.float32(LEAST))


def _unexplained(products: Image) -> tuple[Image, Image]:
    """Return the squares that no rank-1 matrix explains, and all squares, (row, col) each."""
    gram, colour = _gram(products), _colour(products)
    whole = np.einsum("rcxx->rc", gram)
    explained = np.einsum("rcx,rcxy,rcy->rc", colour, gram, colour) / np.maximum((colour**2).sum(axis=-1), 1e-20)
    return np.maximum(whole - explained, 0), whole


def _most(values: Image) -> Image:
    return reduce(np.maximum, np.moveaxis(values, -1, 0))
