"""Demosaicing by Malvar, He and Cutler, "High-quality linear interpolation for demosaicing of Bayer-patterned color
images", ICASSP 2004: each missing colour is its bilinear estimate, corrected by the Laplacian of the colour at hand.

It is linear, so plates may be split in the mosaic and demosaiced afterwards; measured samples are kept exactly.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.errors import PsvideoError

# Figure 2 of the paper, times 1/8.
GREEN_AT_COLOUR = np.array(
    [[0, 0, -1, 0, 0], [0, 0, 2, 0, 0], [-1, 2, 4, 2, -1], [0, 0, 2, 0, 0], [0, 0, -1, 0, 0]], np.float32
)
COLOUR_BESIDE_GREEN = np.array(
    [[0, 0, 0.5, 0, 0], [0, -1, 0, -1, 0], [-1, 4, 5, 4, -1], [0, -1, 0, -1, 0], [0, 0, 0.5, 0, 0]], np.float32
)
COLOUR_ACROSS = np.array(
    [[0, 0, -1.5, 0, 0], [0, 2, 0, 2, 0], [-1.5, 0, 6, 0, -1.5], [0, 2, 0, 2, 0], [0, 0, -1.5, 0, 0]], np.float32
)
PATTERNS = ("RGGB", "BGGR", "GRBG", "GBRG")


def demosaic(image: NDArray[np.float32], cfa: str) -> NDArray[np.float32]:
    """Return the full-size colour picture, shape (row, col, 3), of a mosaic of shape (row, col).

    ``cfa`` names the filters of the top left 2 x 2 pixels, row by row, e.g. ``RGGB``. Beyond the border the picture is
    mirrored about its outermost pixels, which keeps the pattern. Raises PsvideoError for another kind of pattern.
    """
    if cfa not in PATTERNS:
        raise PsvideoError(
            f"colour filter pattern {cfa!r} cannot be demosaiced; expected one of {', '.join(PATTERNS)}."
        )
    green = _filtered(image, GREEN_AT_COLOUR)
    beside = _filtered(image, COLOUR_BESIDE_GREEN)
    above = _filtered(image, COLOUR_BESIDE_GREEN.T)
    across = _filtered(image, COLOUR_ACROSS)
    colour = np.empty((*image.shape, 3), np.float32)
    for place, filters in enumerate(cfa):
        row, col = divmod(place, 2)
        here = np.s_[row::2, col::2]
        in_row, in_col = cfa[2 * row + 1 - col], cfa[2 * (1 - row) + col]
        source = {filters: image}
        source |= (
            {in_row: beside, in_col: above} if filters == "G" else {"G": green, "RB"["RB".index(filters) - 1]: across}
        )
        for channel, name in enumerate("RGB"):
            colour[here][..., channel] = source[name][here]
    return colour


def _filtered(image: NDArray[np.float32], kernel: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.asarray(cv2.filter2D(image, cv2.CV_32F, kernel / 8, borderType=cv2.BORDER_REFLECT_101), np.float32)
