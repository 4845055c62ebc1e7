"""Where slopes change at an edge, and not because the surface is curved."""

from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

WIDER, FALLS, AROUND_PX = 3.0, 3.0, 5
"""Smoothed so many times wider, what an edge changes per pixel falls to a ninth in the square, what is curved hardly
falls, and white noise falls to 1/81. Where it falls by the second and more, and so many pixels around, is an edge, or
noise."""


def on_edges(valid: NDArray[np.bool_], normals: NDArray[np.float32], blur_px: float) -> NDArray[np.bool_]:
    """Return where slopes of normals (row, col, 3), smoothed so far, change at edges or by noise, (row, col)."""
    fine, wide = (_changes(valid, normals, times * blur_px) for times in (1.0, WIDER))
    sharp = (fine > FALLS * wide).astype(np.uint8)
    return cv2.dilate(sharp, np.ones((AROUND_PX, AROUND_PX), np.uint8)) > 0


def smooth_slopes(
    valid: NDArray[np.bool_], normals: NDArray[np.float32], blur_px: float
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """Return the slopes to the right and upwards of smoothed normals, and their parts towards the camera, (row, col)
    each."""
    x, y, towards = cv2.split(cv2.GaussianBlur(normals * valid[..., None], (0, 0), blur_px))
    depth = np.maximum(towards, np.float32(1e-6))
    return cast(tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]], (-x / depth, -y / depth, towards))


def _changes(valid: NDArray[np.bool_], normals: NDArray[np.float32], blur_px: float) -> NDArray[np.float32]:
    """Return the sum of squares by which slopes change per pixel; of a single row or column 0."""
    slope_x, slope_y, _ = smooth_slopes(valid, normals, blur_px)
    total = np.zeros_like(slope_x)
    if min(total.shape) < 2:
        return total
    for slope in (slope_x, slope_y):
        for way in np.gradient(slope):
            total += way * way
    return total
