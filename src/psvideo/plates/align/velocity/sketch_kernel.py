"""The compiled loop that makes a sketch's codes: the square root of light, in one pass."""

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.compiled import EXACT
from psvideo.compute.memory import lent

ZERO, HALF, ONE = np.float32(0), np.float32(0.5), np.float32(1)


@EXACT.kept
def root_rows(
    grey: NDArray[np.float32], per_white: np.float32, toe: np.float32, root: np.float32, scale: np.float32,
    shown: NDArray[np.float32], codes: NDArray[np.uint8],
) -> None:  # fmt: skip
    """Fill ``shown`` with ``scale`` times what the root of light plus ``toe`` is above that of the toe, ``root``, and
    ``codes`` with the same, rounded; white is 1 over ``per_white``, and all are (row, col)."""
    light, values, out = lent(grey), lent(shown), lent(codes)
    for row in range(light.shape[0]):
        given, value, code = light[row], values[row], out[row]
        for col in range(given.shape[0]):
            share = given[col] * per_white
            share = share if share > ZERO else ZERO
            share = share if share < ONE else ONE
            value[col] = (np.sqrt(share + toe) - root) * scale
        for col in range(given.shape[0]):
            code[col] = np.uint8(value[col] + HALF)
