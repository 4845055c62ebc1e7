"""How far normals and directions are off, in degrees."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from psvideo.model.surface import Surface

MISSING_DEG = 90.0
"""A normal that is not there, (0, 0, 0), counts as one across."""


def angles_deg(one: ArrayLike, other: ArrayLike) -> NDArray[np.float64]:
    """Return the angles between vectors (..., 3) of any length; small ones are exact, as no cosine of theirs is."""
    first, second = np.asarray(one, np.float64), np.asarray(other, np.float64)
    across, along = np.linalg.norm(np.cross(first, second), axis=-1), (first * second).sum(axis=-1)
    angles = np.degrees(np.arctan2(across, along))
    return np.asarray(np.where((across == 0) & (along == 0), MISSING_DEG, angles))


def error_deg(surface: Surface, truth: ArrayLike, where: NDArray[np.bool_] | None = None) -> NDArray[np.float64]:
    """Return the angles between a surface's normals and the true ones, where they are valid."""
    both = surface.valid if where is None else surface.valid & where
    return angles_deg(surface.normals[both], np.asarray(truth)[both])
