"""The coarse search where the readout is unknown, compiled: sums of the rows' losses along every readout."""

import numpy as np

from psvideo.compute.compiled import EXACT
from psvideo.model.arrays import Doubles, Integers


@EXACT.kept
def least_over_readouts(
    loss: Doubles,
    below: Integers,
    part: Doubles,
    first: int,
    last: int,
    least: Doubles,
    readout: Integers,
    at: Integers,
) -> None:
    """Fill ``least`` (phase,), from the ``first`` to the ``last``, with the lowest mean over the rows that any readout
    and any clock ratio gives, and which two do: the first ones of several.

    ``loss`` (row, ratio, phase) goes around the cycle twice. A readout opens a row ``below`` (readout, row) whole steps
    in phase later than the first, and a ``part`` of one.
    """
    height, ratios, phases = loss.shape[0], loss.shape[1], loss.shape[2] // 2
    total = np.empty(last - first)
    least[first:last] = np.inf
    for r in range(len(below)):
        for a in range(ratios):
            total[:] = 0.0
            for row in range(height):
                low = phases - below[r, row] % phases + first
                here, more = 1.0 - part[r, row], part[r, row]
                line = loss[row, a, low - 1 : low + len(total)]
                for b in range(len(total)):
                    total[b] += here * line[b + 1] + more * line[b]
            for b in range(len(total)):
                mean = total[b] / height
                if mean < least[first + b]:
                    least[first + b], readout[first + b], at[first + b] = mean, r, a
