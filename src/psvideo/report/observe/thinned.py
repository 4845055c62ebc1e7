"""What shares and medians are counted over: every fourth row and column, or fewer of large pictures."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.spilled import thin
from psvideo.model.surface import Surface

LEAST_STEP = 4
ENOUGH = 16_384
"""This many pixels of a picture: a share is then known to 0.4 % and better, and a take costs the same at any size."""


def step_of(rows: int, cols: int) -> int:
    """Return of how many rows and columns one is looked at.

    >>> step_of(120, 160), step_of(1080, 1920), step_of(9000, 12000)
    (4, 11, 81)
    """
    return max(LEAST_STEP, round(math.sqrt(rows * cols / ENOUGH)))


def thinned(picture: NDArray[Any]) -> NDArray[Any]:
    """Return the rows and columns of a picture (row, col[, channel]) that are looked at, as a picture of its own."""
    return thin(picture, step_of(*picture.shape[:2]))


def slips(mask: NDArray[np.bool_] | None) -> bool:
    """Return whether a mask holds a part of the picture and none of the points that are looked at."""
    return mask is not None and bool(mask.any()) and not thinned(mask).any()


def thin_surface(surface: Surface) -> Surface:
    """Return what is looked at of a surface: normals, albedo, and what is valid and measured."""
    return Surface(
        normals=thinned(surface.normals),
        albedo=thinned(surface.albedo),
        valid=thinned(surface.valid),
        source=None if surface.source is None else thinned(surface.source),
    )
