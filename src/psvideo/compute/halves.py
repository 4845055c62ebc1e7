"""Single-precision floats to half floats in one vectorised pass; numpy converts one value at a time."""

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.compiled import EXACT
from psvideo.compute.memory import HALF_MAX, encoded

_LEAST = np.float32(-HALF_MAX)
_EXPONENT = np.uint32(0x7F800000)
"""The bits of a float's exponent: all of them are set in what is not finite."""


def halves_of(values: NDArray[np.float32]) -> tuple[NDArray[np.float16], bool]:
    """Return a picture (row, col) as half floats, rounded to nearest even, and whether all of it was finite.

    Values beyond ±65504, the largest half float, become that one.
    """
    values = np.ascontiguousarray(values)  # a channel of a colour picture: quicker than to reach for every third value
    stored = np.empty(values.shape, np.uint16)
    largest = _halve(values, values.view(np.uint32), stored)
    return stored.view(np.float16), bool(largest < _EXPONENT)


@EXACT.kept
def _halve(values: NDArray[np.float32], bits: NDArray[np.uint32], stored: NDArray[np.uint16]) -> np.uint32:
    """Store values, whose ``bits`` are given too, as half floats; return the largest exponent among them."""
    largest = np.uint32(0)
    for row in range(values.shape[0]):
        for col in range(values.shape[1]):
            largest = max(largest, bits[row, col] & _EXPONENT)
            value = values[row, col]
            stored[row, col] = encoded(value if value > _LEAST else _LEAST, stored)
    return largest
