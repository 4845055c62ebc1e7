"""A picture's noise taken off, and its detail kept where that is more than noise.

J.-S. Lee, "Digital image enhancement and noise filtering by use of local statistics", IEEE Transactions on Pattern
Analysis and Machine Intelligence 2(2), 1980.
"""

import cv2
import numpy as np

from psvideo.compute.ranks import median
from psvideo.model.arrays import Image

WINDOW_PX = 5
"""Detail is judged against its noise over windows of this width."""


def without_noise(image: Image, noise: Image) -> Image:
    """Keep as much of the local detail as its variance exceeds ``noise``'s (row, col), plane by plane."""
    if image.ndim == 2:
        return _lee(image, noise)
    planes = [np.ascontiguousarray(image[..., channel]) for channel in range(image.shape[2])]
    return np.stack([_lee(plane, noise) for plane in planes], axis=2)


def _lee(plane: Image, noise: Image) -> Image:
    bend = plane[:, 2:] - 2 * plane[:, 1:-1] + plane[:, :-2]
    most = float((1.4826 * median(np.abs(bend[::3]))) ** 2 / 6) if bend.size else 0.0  # with fine detail in it
    window = (WINDOW_PX, WINDOW_PX)
    mean = cv2.blur(plane, window)
    spread = np.maximum(cv2.blur(plane * plane, window) - mean * mean, 0)
    kept = np.maximum(spread - np.minimum(noise, np.float32(most)), 0) / np.maximum(spread, 1e-12)
    return np.asarray(mean + kept * (plane - mean), np.float32)
