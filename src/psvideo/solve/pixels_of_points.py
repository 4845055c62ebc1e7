"""Pixels take what is known of the points around which they lie."""

from typing import Any

import numpy as np
from numpy.typing import NDArray


def for_pixels(points: NDArray[Any], count: int, shape: tuple[int, int]) -> NDArray[Any]:
    """Return a plane of points for all pixels of a ``shape``: each stands for those over which ``around`` averages."""
    rows, cols = (
        np.minimum((np.arange(pixels) + count // 2) // count, there - 1)
        for pixels, there in zip(shape, points.shape, strict=True)
    )
    return np.ascontiguousarray(points[rows[:, None], cols])
