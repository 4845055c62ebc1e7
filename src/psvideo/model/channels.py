"""What a picture's channels say together. Channel by channel: numpy is slow along a short last axis."""

import functools

import numpy as np
from numpy.typing import NDArray


def brightest_channel(image: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return every pixel's brightest channel, (row, col), of an image (row, col) or (row, col, channel)."""
    return image if image.ndim == 2 else functools.reduce(np.maximum, np.moveaxis(image, -1, 0))


def mean_of_channels(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the mean over the last axis, the channels, to the bit that numpy gives; shape (..., channel) to (...).

    >>> mean_of_channels(np.array([[0.1, 0.2, 0.6]], np.float32))
    array([0.3], dtype=float32)
    """
    total = functools.reduce(np.add, np.moveaxis(values, -1, 0))
    return np.asarray(total / np.float32(values.shape[-1]), np.float32)
