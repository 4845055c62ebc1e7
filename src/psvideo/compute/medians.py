"""Medians of many numbers without sorting them: by counting their bits, the upper half first."""

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.compiled import EXACT

HALF_BITS = np.uint32(16)
LOWER = np.uint32(0xFFFF)


@EXACT.kept
def weighted_median(numbers: NDArray[np.float32], weights: NDArray[np.float32]) -> float:
    """Return the least of some numbers, none below 0, up to which half of all weights lie; 0 of none.

    Counted are weights by the upper 16 bits of a number, then those of the numbers that share the median's by the lower
    ones: bits of floats that are not negative rise as these do.
    """
    if not numbers.size:
        return 0.0
    bits = numbers.view(np.uint32)
    sums = np.zeros(1 << 16, np.float64)
    for place in range(bits.size):
        sums[bits[place] >> HALF_BITS] += weights[place]
    half, before, upper = sums.sum() / 2, 0.0, 0
    while upper < sums.size - 1 and before + sums[upper] < half:
        before += sums[upper]
        upper += 1
    sums[:] = 0.0
    for place in range(bits.size):
        if bits[place] >> HALF_BITS == upper:
            sums[bits[place] & LOWER] += weights[place]
    lower, last = 0, 0
    for place in range(sums.size):
        if sums[place] > 0.0:
            last = place
            if before + sums[place] >= half:
                lower = place
                break
            before += sums[place]
        lower = last
    found = np.empty(1, np.uint32)
    found[0] = (upper << 16) | lower
    return float(found.view(np.float32)[0])
