"""The compiled loops of a sketch's detail: what is left without its shading, and what becomes of it in codes."""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import flattened
from psvideo.model.arrays import Codes8, Floats

ZERO, MIDDLE, MOST = np.float32(0), np.float32(64.5), np.float32(255)


@FUSED.kept
def part_detail(smooth: Floats, shading: Floats, squares: Floats) -> None:
    """Turn a picture, ``smooth``, into its detail, without its ``shading``, and fill ``squares`` with its squares."""
    made, wide, filled = flattened(smooth), flattened(shading), flattened(squares)
    for place in range(made.shape[0]):
        detail = made[place] - wide[place]
        made[place], filled[place] = detail, detail * detail


@FUSED.kept
def code_detail(
    detail: Floats, shading: Floats, squares: Floats, contrast: np.float32, share: np.float32, codes: Codes8
) -> None:
    """Fill ``codes`` with detail brought down to the most ``contrast`` around, of which ``squares`` are the mean, and a
    ``share`` of the shading; no detail and no shading are 64."""
    given, wide, around, made = flattened(detail), flattened(shading), flattened(squares), flattened(codes)
    for place in range(made.shape[0]):
        size = np.sqrt(max(around[place], ZERO))  # sums that run along rows round
        value = given[place] * (contrast / max(size, contrast)) + share * wide[place] + MIDDLE
        made[place] = np.uint8(np.int32(min(max(value, ZERO), MOST)))
