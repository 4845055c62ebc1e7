"""How sharp the sharpest edges are: S. Zhuo and T. Sim, "Defocus map estimation from a single image", Pattern
Recognition 44, 2011, section 3. An edge blurred once more loses the more of its slope the sharper it was."""

import cv2
import numpy as np
from numpy.typing import NDArray

AGAIN_PX = 1.5
"""Standard deviation of the second blur."""
LEAST_EDGES = 40
SHARPEST = 0.1
NOISE_FACTOR = 8.0
LARGEST_PX = 1600
"""Wider pictures are judged by their middle: defocus must not be averaged away."""


def sharpest_blur_px(image: NDArray[np.float32]) -> float | None:
    """Return the standard deviation of the blur that the sharpest tenth of a picture's edges have, in pixels.

    About 0.6 is as sharp as pixels can show, a demosaiced picture has 0.8. None where no edge stands out of the noise.
    """
    grey = image if image.ndim == 2 else image[..., 1]
    rows, cols = grey.shape
    top, left = max(rows - LARGEST_PX, 0) // 2, max(cols - LARGEST_PX, 0) // 2
    grey = np.ascontiguousarray(grey[top : rows - top, left : cols - left], np.float32)
    grey = np.sqrt(np.maximum(grey, 0) + np.float32(1e-4))
    steep, soft = _slope(grey), _slope(np.asarray(cv2.GaussianBlur(grey, (0, 0), AGAIN_PX), np.float32))
    fine = grey - cv2.medianBlur(grey, 3)
    noise = 1.4826 * float(np.median(np.abs(fine)))
    peak = (steep >= cv2.dilate(steep, np.ones((3, 3), np.uint8))) & (soft > 0)
    edges = peak & (steep > max(NOISE_FACTOR * noise, 0.25 * float(np.quantile(steep[::2, ::2], 0.999))))
    edges[:4], edges[-4:], edges[:, :4], edges[:, -4:] = False, False, False, False
    if edges.sum() < LEAST_EDGES:
        return None
    ratio = steep[edges] / soft[edges]
    blur_px = AGAIN_PX / np.sqrt(np.maximum(ratio**2 - 1, 1e-3))
    return float(np.quantile(blur_px, SHARPEST))


def _slope(grey: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the slope's size by central differences."""
    kernel = np.array([[-0.5, 0, 0.5]], np.float32)
    return np.asarray(
        cv2.magnitude(cv2.filter2D(grey, cv2.CV_32F, kernel), cv2.filter2D(grey, cv2.CV_32F, kernel.T)), np.float32
    )
