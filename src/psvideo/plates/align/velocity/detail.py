"""What is compared of sketches: their detail, without most of their shading, which changes as surfaces turn."""

import cv2
import numpy as np

from psvideo.model.arrays import Codes8, Floats

FINEST_PX, SHADING_PX, SHADING = 1.0, 13, 0.7
"""Before they are compared, sketches are smoothed by the first, and most of what is wider than the second is removed:
as surfaces turn, their shading changes, their detail does not."""
CONTRAST = 10.0
"""The most contrast of detail, in codes, over such a window; more is scaled down to it: as surfaces turn, the edges
between them stay in place, but the light on either side changes."""


def smoothed(codes: Codes8) -> Floats:
    """Return codes without their finest noise."""
    return np.asarray(cv2.GaussianBlur(codes.astype(np.float32), (0, 0), FINEST_PX), np.float32)


def detail_of(codes: Codes8) -> Codes8:
    """Return the detail of a sketch's codes, and a part of their shading, in codes."""
    smooth, window = smoothed(codes), (SHADING_PX, SHADING_PX)
    shading = np.asarray(cv2.blur(smooth, window), np.float32)
    detail = smooth - shading
    contrast = np.sqrt(np.maximum(cv2.blur(detail * detail, window), 0))  # sums that run along rows round
    detail *= np.float32(CONTRAST) / np.maximum(contrast, np.float32(CONTRAST))
    detail += np.float32(1 - SHADING) * shading
    return np.asarray(np.clip(detail + np.float32(64.5), 0, 255), np.uint8)
