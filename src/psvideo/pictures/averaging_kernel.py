"""The compiled loop that makes large pictures small ones: means over squares of a whole number of pixels."""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import decoded, lent
from psvideo.model.arrays import Floats, Image
from psvideo.solve.normals.task import Samples


@FUSED.kept
def fill_averages(picture: Samples, factor: int, channels: int, out: Image) -> None:
    """Fill ``out`` (channel, row, col) with means over squares of ``factor`` pixels of a picture (row, sample), floats
    or the bits of halves, whose channels lie beside each other."""
    given, made = lent(picture), lent(out)
    share = np.float32(1) / np.float32(factor * factor)
    total = np.empty(made.shape[2] * factor * channels, np.float32)
    sums = np.empty(total.shape[0] - (factor - 1) * channels, np.float32)
    for row in range(made.shape[1]):
        line = given[row * factor]
        for sample in range(total.shape[0]):
            total[sample] = decoded(line[sample])
        for below in range(1, factor):
            line = given[row * factor + below]
            for sample in range(total.shape[0]):
                total[sample] += decoded(line[sample])
        _fill_beside(total, factor, channels, share, sums)
        for channel in range(channels):
            place = channel
            for col in range(made.shape[2]):
                made[channel, row, col] = sums[np.uintp(place)]
                place += factor * channels


@FUSED.inlined
def _fill_beside(line: Floats, factor: int, channels: int, share: np.float32, sums: Floats) -> None:
    """Fill ``sums`` with a share of what so many pixels from every sample on are together. One of so many is wanted,
    but loops over neighbours become vectors."""
    for sample in range(sums.shape[0]):
        sums[sample] = line[sample]
    for beside in range(1, factor):
        ahead = line[beside * channels : beside * channels + sums.shape[0]]
        for sample in range(sums.shape[0]):
            sums[sample] += ahead[sample]
    for sample in range(sums.shape[0]):
        sums[sample] *= share
