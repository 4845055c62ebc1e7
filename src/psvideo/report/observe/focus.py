"""How sharp the sharpest edges are: S. Zhuo and T. Sim, "Defocus map estimation from a single image", Pattern
Recognition 44, 2011, section 3. An edge blurred once more loses the more of its slope the sharper it was."""

import cv2
import numpy as np
from numpy.typing import NDArray

SCALES_PX = ((0.0, 1.5, 1.0), (1.5, 4.0, 2.5), (4.0, 9.0, np.inf))
"""Blur before and after (standard deviations), and up to which result these two measure it: noise makes soft edges look
sharper, so that they are compared once both pictures are smooth."""
TILE = (15, 15)
"""Edges are judged by what they are over so many pixels: single ones are at the mercy of noise."""
LEAST_EDGES = 40
SHARPEST = 0.1
NOISE_FACTOR = 8.0
LARGEST_PX = 1600
"""Wider pictures are judged by their middle: defocus must not be averaged away."""
KERNEL = np.array([[-0.5, 0, 0.5]], np.float32)


def sharpest_blur_px(image: NDArray[np.float32]) -> float | None:
    """Return the standard deviation of the blur that the sharpest tenth of a picture's edges have, in pixels.

    About 0.6 is as sharp as pixels can show, a demosaiced picture has 0.8. None where no edge stands out of the noise.
    """
    grey = image if image.ndim == 2 else image[..., 1]
    rows, cols = grey.shape
    top, left = max(rows - LARGEST_PX, 0) // 2, max(cols - LARGEST_PX, 0) // 2
    grey = np.ascontiguousarray(grey[top : rows - top, left : cols - left], np.float32)
    blur_px, least_px = None, 0.0
    for first_px, again_px, most_px in SCALES_PX:
        found = _blur_between(grey, first_px, again_px)
        blur_px = blur_px if found is None else max(found, least_px)
        least_px = most_px
        if found is not None and found <= most_px:
            break
    return blur_px


def _blur_between(grey: NDArray[np.float32], first_px: float, again_px: float) -> float | None:
    """Return the blur of the sharpest edges from their slopes after two blurs; None where too few stand out."""
    smooth = _blurred(grey, first_px)
    steep, soft = _slope(smooth), _slope(_blurred(grey, again_px))
    noise = 1.4826 * float(np.median(np.abs(grey - cv2.medianBlur(grey, 3))))
    if first_px:
        noise /= 2 * np.sqrt(np.pi) * first_px  # what such a blur leaves of noise that is new in every pixel
    edges = _ridge(smooth, steep) & (soft > 0)
    edges &= steep > max(NOISE_FACTOR * noise, 0.25 * float(np.quantile(steep[::2, ::2], 0.999)))
    rim = 4 + round(2 * again_px)
    edges[:rim], edges[-rim:], edges[:, :rim], edges[:, -rim:] = False, False, False, False
    if edges.sum() < LEAST_EDGES:
        return None
    along = [np.asarray(cv2.boxFilter(np.where(edges, one, 0), -1, TILE, normalize=False)) for one in (steep, soft)]
    count = cv2.boxFilter(edges.astype(np.float32), -1, TILE, normalize=False)
    long = edges & (count >= TILE[0] / 2)
    if long.sum() < LEAST_EDGES:
        return None
    squares = np.maximum((along[0][long] / along[1][long]) ** 2, 1 + 1e-3)
    blur_px = np.sqrt(np.maximum(again_px**2 - squares * first_px**2, 0) / (squares - 1))
    return float(np.quantile(blur_px, SHARPEST))


def _blurred(grey: NDArray[np.float32], sigma_px: float) -> NDArray[np.float32]:
    return np.asarray(cv2.GaussianBlur(grey, (0, 0), sigma_px), np.float32) if sigma_px else grey


def _ridge(grey: NDArray[np.float32], steep: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Tell where the slope is greatest across its edge."""
    across = np.abs(cv2.filter2D(grey, cv2.CV_32F, KERNEL)) > np.abs(cv2.filter2D(grey, cv2.CV_32F, KERNEL.T))
    row = steep >= cv2.dilate(steep, np.ones((1, 3), np.uint8))
    col = steep >= cv2.dilate(steep, np.ones((3, 1), np.uint8))
    return np.asarray(np.where(across, row, col), np.bool_)


def _slope(grey: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the slope's size by central differences."""
    return np.asarray(
        cv2.magnitude(cv2.filter2D(grey, cv2.CV_32F, KERNEL), cv2.filter2D(grey, cv2.CV_32F, KERNEL.T)), np.float32
    )
