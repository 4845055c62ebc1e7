"""Mirror spheres before a camera, traced ray by ray: what the calibration on mirror spheres is tested with.

Written from the law of reflection alone; it shares nothing with what it is there to test.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, kw_only=True)
class Ball:
    """A sphere: its centre and radius in metres in the camera's axes (x right, y up, z towards the camera)."""

    centre: tuple[float, float, float]
    radius_m: float = 0.05


@dataclass(frozen=True, kw_only=True)
class Lamp:
    """A lamp at a position (metres), or in a direction; ``size_deg`` is its angular radius seen from the sphere."""

    position: tuple[float, float, float] | None = None
    direction: tuple[float, float, float] | None = None
    size_deg: float = 1.0
    strength: float = 3.0


@dataclass(frozen=True, kw_only=True)
class Lens:
    """A camera: its size, and its focal length in pixels; the axis goes through the middle of the picture."""

    width: int = 480
    height: int = 360
    focal: float = 900.0

    @property
    def middle(self) -> np.ndarray:
        return np.array([(self.width - 1) / 2, (self.height - 1) / 2])


def unit(vectors: np.ndarray) -> np.ndarray:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def photograph(
    lens: Lens,
    balls: Sequence[Ball],
    lamps: Sequence[Lamp],
    *,
    wall: float = 0.05,
    samples: int = 3,
    noise: float = 0.0,
    seed: int = 0,
) -> np.ndarray:
    """Return a linear picture (row, col) clipped at 1: mirrors before a wall of one brightness, lamps mirrored.

    Mirrored surroundings are dark below, brighter above: a third of the wall.
    """
    total = np.zeros((lens.height, lens.width))
    for sub in np.ndindex(samples, samples):
        shift = (np.array(sub) + 0.5) / samples - 0.5
        cols, rows = np.meshgrid(np.arange(lens.width) + shift[0], np.arange(lens.height) + shift[1])
        across, down = (cols - lens.middle[0]) / lens.focal, (rows - lens.middle[1]) / lens.focal
        rays = unit(np.stack([across, -down, -np.ones_like(across)], axis=-1))
        total += _radiance(rays, balls, lamps, wall)
    picture = total / samples**2
    picture += noise * np.random.default_rng(seed).standard_normal(picture.shape)
    return np.clip(picture, 0, 1).astype(np.float32)


def _radiance(rays: np.ndarray, balls: Sequence[Ball], lamps: Sequence[Lamp], wall: float) -> np.ndarray:
    light = np.full(rays.shape[:2], wall)
    nearest = np.full(rays.shape[:2], np.inf)
    for ball in balls:
        centre = np.array(ball.centre)
        along = rays @ centre
        gap = along**2 - (centre @ centre - ball.radius_m**2)
        distance = np.where(gap > 0, along - np.sqrt(np.maximum(gap, 0)), np.inf)
        hit = distance < nearest
        nearest[hit] = distance[hit]
        met = distance[hit, None] * rays[hit]
        normal = (met - centre) / ball.radius_m
        mirrored = rays[hit] - 2 * (rays[hit] * normal).sum(axis=-1, keepdims=True) * normal
        seen = wall / 6 * (1 + mirrored[:, 1]) * 0.5
        for lamp in lamps:
            towards = unit(np.array(lamp.position) - met) if lamp.position else unit(np.array(lamp.direction))
            angle = np.degrees(np.arccos(np.clip((mirrored * towards).sum(axis=-1), -1, 1)))
            seen = seen + lamp.strength * np.exp(-((angle / lamp.size_deg) ** 2))
        light[hit] = seen
    return light
