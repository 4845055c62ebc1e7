"""Where plates that were brought to one instant are sure enough to speak for the rest of the picture."""

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Floats, Mask
from psvideo.model.channels import mean_of_channels
from psvideo.model.surface import Surface
from psvideo.solve.normals.illumination import Illumination

MOST_UNSURE = 0.05
"""What a light's plate may be off by for motion, as a share of what shines straight on the surface, where a point still
speaks for the subject: what was not followed leaves residuals that pass for sheen and roughness."""
AROUND_SHARE = 1 / 16
"""Nor may plates be off by more on average over this share of the picture's longer side: where most of what is around
was not followed, what fits does so by chance."""


def sure_of_motion(unsure: Floats, found: Surface, rows: NDArray[np.intp], lit: Illumination) -> Mask:
    """Return of some rows where no light's plate may be off by more than MOST_UNSURE, there and around."""
    high, wide = unsure.shape[1:]
    window = (max(round(max(high, wide) * AROUND_SHARE) | 1, 3),) * 2
    most = np.zeros((high, wide), np.float32)
    for plane, lamp in zip(unsure, lit.intensities.mean(axis=1), strict=True):
        share = np.minimum(plane / np.float32(lamp), np.float32(1))
        np.maximum(most, np.maximum(share, cv2.blur(share, window)), out=most)
    albedo = found.albedo[rows].astype(np.float32)
    albedo = albedo if albedo.ndim == 2 else mean_of_channels(albedo)
    cols = np.arange(albedo.shape[1])
    here = most[(rows * high // len(found.valid))[:, None], cols * wide // len(cols)]
    return np.asarray(here <= np.float32(MOST_UNSURE) * albedo)


def standing_rows(moves: Mask, found: Surface, rows: NDArray[np.intp]) -> Mask:
    """Return of some rows what does not move, by ``moves`` (row, col) on a grid of its own."""
    high, wide = moves.shape
    cols = np.arange(found.valid.shape[1])
    return np.asarray(~moves[(rows * high // len(found.valid))[:, None], cols * wide // len(cols)])
