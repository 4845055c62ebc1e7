"""The curve of sRGB (IEC 61966-2-1), for pictures that a screen shows; footage is decoded in ``clip/transfer``."""

import numpy as np
from numpy.typing import NDArray


def srgb_share(linear: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return linear light as a share of the largest sRGB code, same shape, 0 to 1.

    >>> srgb_share(np.array([-1, 0, 0.18, 1, 2], np.float32)).round(3).tolist()
    [0.0, 0.0, 0.460999995470047, 1.0, 1.0]
    """
    light = np.clip(linear, 0.0, 1.0)
    coded: NDArray[np.float32] = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    return coded
