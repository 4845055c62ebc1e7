"""The colour of a moving surface, from flashes that show it in different places; needed where one flash must do.

Where lamps exchange their colours, what three flashes show of a resting surface is ``albedo_c * shading_p``, for
every lamp p and channel c: a matrix of rank 1. Where something moved, single pixels contradict that; sums over a
neighbourhood in which the same surface stays do not, and their rank-1 part is its colour.
"""

from functools import reduce

import cv2
import numpy as np

from psvideo.compute.ranks import quantile
from psvideo.model.arrays import Flags, Image

CONTRADICTION = 0.05
"""Flashes whose products leave a larger share of themselves unexplained show different surfaces: normals that are some
8 degrees apart leave this much, and noise of 5 % of the light."""
MOVED = 0.1
"""This much leaves no doubt that something moved between them, and that flow did not bring it together."""
QUIETEST, NOISY = 0.25, 9.0
"""Noise contradicts itself, too: in the dark, this share of the picture, by a mean square of which this many times is
motion."""
LEAST_MOVED, BRIGHT = 0.01, 0.99
"""What contradicts itself by the first share of the light that the second share of the picture stays below does not so
for noise alone, also where all of the picture moves."""
WINDOW_PX = 5
"""Contradictions are looked for in means over this many pixels: noise makes less of them."""
NEIGHBOURHOODS = (1 / 24, 1 / 8, 1 / 3, 2.0)
"""Widths, in shares of the picture's longer side, in which the flashes are asked to agree, the smallest first."""
LEAST_PX = 11
"""No neighbourhood is narrower than this, where pictures are small."""
NARROW = 1 / 8
"""Neighbourhoods in which many colours have become one by chance are wider than this."""
AROUND = 1 / 4
"""How wide, in the same shares, the neighbourhood is in which all surfaces are to have the same colour."""
ONE_COLOUR = 0.15
"""Colours are one where no channel, the brightest 1, differs by more: normals that are a few degrees off."""
STEPS = 6
"""Of the power iteration: a rank-1 matrix is there after one."""
LEAST = 0.02
"""No channel of a surface is darker than this share of its brightest: noise would be all that is divided."""


def contradicted(products: Image) -> Flags:
    """Return where the flashes show different surfaces, (row, col); ``products`` are (lamp, row, col, channel)."""
    window = (WINDOW_PX, WINDOW_PX)
    rest, whole = (np.asarray(cv2.blur(squares, window), np.float32) for squares in _unexplained(products))
    by_noise = min(NOISY * quantile(rest, QUIETEST), LEAST_MOVED**2 * quantile(whole, BRIGHT))
    return np.asarray(rest > np.maximum(MOVED**2 * whole, np.float32(by_noise)))


def colours_of(products: Image, where: Flags) -> tuple[Image, Flags]:
    """Return the colour (row, col, channel), the brightest channel 1, that the smallest neighbourhood shows in which
    the flashes agree; only pixels ``where`` something is wanted to be known count. And where it is sure, (row, col).

    Sums of two surfaces that face the same way agree as well, in a colour between theirs: one is sure only where all
    that rests nearby, and what is found around, have the same.
    """
    rows, cols = where.shape
    kept = products * where[..., None]
    colour = np.ones((rows, cols, products.shape[-1]), np.float32)
    open_yet, agreed = where.copy(), np.zeros((rows, cols), np.bool_)
    for share in NEIGHBOURHOODS:
        sums = _sums(kept, share)
        rest, whole = _unexplained(sums)
        agree = rest <= CONTRADICTION**2 * whole
        chosen = open_yet & (agree | (share == NEIGHBOURHOODS[-1]))
        colour[chosen] = _colour(sums)[chosen]
        agreed |= chosen & (share <= NARROW)
        open_yet &= ~chosen
    resting = _colour(_sums(products * ~where[..., None], AROUND))
    same = _most(np.abs(colour - resting)) < ONE_COLOUR
    return colour, np.asarray(agreed & same & (_spread(colour, where) < ONE_COLOUR / 2))


def _spread(colour: Image, where: Flags) -> Image:
    """Return by how much colours differ from each other around a pixel, as a standard deviation, (row, col)."""
    counts = where[..., None].astype(np.float32)
    sums, squares, count = _sums(np.stack([colour * counts, colour**2 * counts, np.ones_like(colour) * counts]), AROUND)
    mean = sums / np.maximum(count, 1)
    return np.sqrt(np.maximum(_most(squares / np.maximum(count, 1) - mean**2), 0))


def _sums(products: Image, share: float) -> Image:
    size = max(2 * int(share * max(products.shape[1:3]) / 2) + 1, LEAST_PX)
    border = cv2.BORDER_CONSTANT
    return np.stack([cv2.boxFilter(lamp, -1, (size, size), normalize=False, borderType=border) for lamp in products])


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
