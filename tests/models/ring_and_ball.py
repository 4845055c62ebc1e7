"""What solvers are tried on: lights in a ring around the camera's axis, and the front of a ball."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def ring(lights: int, slant_deg: float) -> Array:
    """Return unit directions (light, 3), evenly around the camera's axis, so far off it."""
    around, slant = 0.3 + np.arange(lights) * 2 * np.pi / lights, np.radians(slant_deg)
    up = np.full(lights, np.cos(slant))
    return np.stack([np.sin(slant) * np.cos(around), np.sin(slant) * np.sin(around), up], axis=-1)


def ball(size: int = 96, *, reach_deg: float) -> tuple[Array, NDArray[np.bool_]]:
    """Return the normals (row, col, 3) of a ball's front, up to ``reach_deg`` from its middle, and where they are."""
    radius = (size - 1) / 2 / np.sin(np.radians(reach_deg))
    rows, cols = np.mgrid[:size, :size] - (size - 1) / 2
    x, y = cols / radius, -rows / radius
    inside = x * x + y * y < np.sin(np.radians(reach_deg)) ** 2
    z = np.sqrt(np.where(inside, 1 - x * x - y * y, 0))
    return np.where(inside[..., None], np.stack([x, y, z], axis=-1), 0), inside
