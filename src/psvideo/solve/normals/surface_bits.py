"""Surfaces as compiled loops take them: planes of numbers, half floats as their bits."""

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Samples
from psvideo.model.surface import Surface


def stored(surface: Surface) -> tuple[Samples, Samples]:
    """Return normals (3, row, col) and albedo (channel, row, col) as compiled loops take them, in the same memory."""
    albedo = surface.albedo
    return bits(np.moveaxis(surface.normals, -1, 0)), bits(
        albedo[None] if albedo.ndim == 2 else np.moveaxis(albedo, -1, 0)
    )


def bits(planes: NDArray[np.floating]) -> Samples:
    """Return numbers as compiled loops take them: half floats as their bits."""
    return planes.view(np.uint16) if planes.dtype == np.float16 else planes
