"""By how much two plates differ around every pixel where they differ evenly: on its own side of an edge.

A window across an edge between two faces, each of which got brighter or darker as it turned, mixes both: its mean is of
neither, and leaves most of what changed. Of the windows that hold a pixel the one that changed most evenly lies on the
pixel's own side (Kuwahara, Hachimura, Eiho and Kinoshita, "Processing of RI-angiocardiographic images", 1976).
"""

import cv2
import numpy as np

from psvideo.model.arrays import Floats
from psvideo.plates.align.doubt.evenly_kernel import evenest_rows

EACH_PX = 7
"""Of such windows nine hold a pixel: in their middle, at their corners, or at their sides."""


def evenly_changed(
    apart: Floats, usual: tuple[Floats, Floats], each: tuple[int, int], even: float
) -> tuple[Floats, Floats]:
    """Return by how much plates differ around every pixel, (row, col), and the mean square of what is left there.

    ``apart`` is by how much they differ, ``usual`` what holds where nothing around is even: where more than ``even`` is
    left everywhere, which what is painted leaves as well. ``each`` is how large (across, down) the windows are, odd
    numbers.
    """
    mean = np.asarray(cv2.blur(apart, each), np.float32)
    spread = np.asarray(cv2.blur(apart * apart, each), np.float32) - mean * mean
    shading, left = mean.copy(), spread.copy()
    evenest_rows(mean, spread, each[1] // 2, each[0] // 2, shading, left)
    painted = left >= np.float32(even**2)
    for own, otherwise in zip((shading, left), usual, strict=True):
        np.copyto(own, otherwise, where=painted)
    return shading, left
