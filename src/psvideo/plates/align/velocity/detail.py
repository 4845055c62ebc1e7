"""What is compared of sketches: their detail, without most of their shading, which changes as surfaces turn."""

import cv2
import numpy as np

from psvideo.model.arrays import Codes8, Floats
from psvideo.plates.align.velocity.detail_kernel import code_detail, part_detail

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
    detail, window = smoothed(codes), (SHADING_PX, SHADING_PX)
    shading = np.asarray(cv2.blur(detail, window), np.float32)
    squares, made = np.empty_like(detail), np.empty(detail.shape, np.uint8)
    part_detail(detail, shading, squares)
    cv2.blur(squares, window, dst=squares)
    code_detail(detail, shading, squares, np.float32(CONTRAST), np.float32(1 - SHADING), made)
    return made
