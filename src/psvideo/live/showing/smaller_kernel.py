"""Cells of pixels averaged, in the codes in which they were read."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.compiled import EXACT
from psvideo.model.arrays import Floats


@EXACT.kept
def average(
    codes: NDArray[Any],
    step: int,
    channel_of: NDArray[np.int64],
    scale: np.float32,
    clips: np.float32,
    top: np.float32,
    small: NDArray[Any],
) -> None:
    """Fill ``small`` (row, col, channel) with the means of cells of ``codes`` (row, col, plane).

    ``channel_of`` (row % 2, col % 2, plane) is the channel that a sample goes to. A mean is multiplied by ``scale``;
    from ``clips`` on a sample is clipped, and its cell becomes ``top``. All sums are of whole codes, and exact.
    """
    rows, cols, channels = small.shape
    planes, wide = codes.shape[2], codes.shape[1] * codes.shape[2]
    total, most = np.empty((channels, cols), np.float32), np.empty((channels, cols), np.float32)
    piled, highest = np.empty((2, wide), np.float32), np.empty((2, wide), np.float32)
    whole = step > 2 or planes > 1 or codes.itemsize > 1  # else cells are so small that it costs more than it saves
    turns = 1 + (step & 1)  # cells after which the pattern begins again
    for row in range(rows):
        total[:], most[:] = 0.0, 0.0
        down = row * step & 1
        if whole:  # rows of one place in the pattern are added up first, where they lie
            piled[:], highest[:] = 0.0, 0.0
            for i in range(step):
                _pile(codes[row * step + i].reshape(-1), piled[i & 1], highest[i & 1])
        if turns == 2:
            _odd_cells(piled, highest, channel_of, step, down, total, most)
        else:
            for i in range(2):
                line = codes[row * step + i].reshape(-1)
                for j in range(step):
                    for k in range(planes):
                        channel, first = channel_of[i & 1, j & 1, k], j * planes + k
                        if whole:
                            _gather(piled[i], highest[i], first, step * planes, total[channel], most[channel])
                        else:
                            _gather(line, line, first, step * planes, total[channel], most[channel])
        for channel in range(channels):
            for turn in range(turns):
                count = _samples(channel_of, step, down, turn * step & 1, channel)
                _finish(total[channel], most[channel], turn, turns, scale / count, clips, top, small[row, :, channel])


@EXACT.inlined
def _finish(
    total: Floats,
    most: Floats,
    first: int,
    stride: int,
    factor: np.float32,
    clips: np.float32,
    top: np.float32,
    small: NDArray[Any],
) -> None:
    """Write every nth cell from the first on."""
    if stride == 1:
        for col in range(total.shape[0]):
            small[col] = top if most[col] >= clips else total[col] * factor
    else:
        for col in range(first, total.shape[0], stride):
            small[col] = top if most[col] >= clips else total[col] * factor


@EXACT.inlined
def _odd_cells(
    piled: NDArray[Any],
    highest: NDArray[Any],
    channel_of: NDArray[np.int64],
    step: int,
    down: int,
    total: NDArray[Any],
    most: NDArray[Any],
) -> None:
    """Add a row of cells that begin on either column of the pattern in turn, and on its row ``down``."""
    planes = channel_of.shape[2]
    for i in range(2):
        for turn in range(2):
            for j in range(step):
                for k in range(planes):
                    channel = channel_of[(i + down) & 1, (j + turn * step) & 1, k]
                    first = (turn * step + j) * planes + k
                    for cell in range((total.shape[1] + 1 - turn) // 2):
                        at, col = first + 2 * step * planes * cell, 2 * cell + turn
                        total[channel, col] += piled[i, at]
                        most[channel, col] = max(most[channel, col], highest[i, at])


@EXACT.inlined
def _samples(channel_of: NDArray[np.int64], step: int, down: int, right: int, channel: int) -> np.float32:
    """Return how many of a cell's samples are of a channel, if the cell begins there in the pattern."""
    count = np.float32(0.0)
    for i in range(step):
        for j in range(step):
            for k in range(channel_of.shape[2]):
                if channel_of[(i + down) & 1, (j + right) & 1, k] == channel:
                    count += np.float32(1.0)
    return count


@EXACT.inlined
def _pile(line: NDArray[Any], sums: Floats, highest: Floats) -> None:
    """Add one more row to sums, sample by sample, and take its samples where they are higher."""
    for col in range(sums.shape[0]):
        code = np.float32(line[col])
        sums[col] += code
        highest[col] = max(highest[col], code)


@EXACT.inlined
def _gather(sums: NDArray[Any], highest: NDArray[Any], first: int, stride: int, total: Floats, most: Floats) -> None:
    """Add every nth sample from the first on, one for each cell; strides that are known are much faster."""
    if stride == 2:
        _gathered(sums[first:], highest[first:], np.uint64(2), total, most)
    elif stride == 4:
        _gathered(sums[first:], highest[first:], np.uint64(4), total, most)
    elif stride == 6:
        _gathered(sums[first:], highest[first:], np.uint64(6), total, most)
    else:
        _gathered(sums[first:], highest[first:], np.uint64(stride), total, most)


@EXACT.inlined
def _gathered(sums: NDArray[Any], highest: NDArray[Any], stride: np.uint64, total: Floats, most: Floats) -> None:
    for col in range(np.uint64(total.shape[0])):  # an index that may be below 0 would be looked at each time
        total[col] += np.float32(sums[stride * col])
        most[col] = max(most[col], np.float32(highest[stride * col]))
