"""Means over windows in which what moves and what stands still do not mix, so that neither speaks for the other."""

import cv2
import numpy as np

from psvideo.model.arrays import Flags, Floats

LEAST = np.float32(1e-6)


def own_mean(values: Floats, window: tuple[int, int], moves: Flags) -> Floats:
    """Return the mean of values (row, col) over a window, of pixels that move where a pixel does, and else of those
    that stand still."""
    if moves.all() or not moves.any():
        return np.asarray(cv2.blur(values, window), np.float32)
    moving = moves.astype(np.float32)
    share = cv2.blur(moving, window)
    theirs = cv2.blur(values * moving, window)
    still = (cv2.blur(values, window) - theirs) / np.maximum(1 - share, LEAST)
    return np.asarray(np.where(moves, theirs / np.maximum(share, LEAST), still), np.float32)
