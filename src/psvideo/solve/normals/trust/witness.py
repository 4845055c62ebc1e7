"""What plates of more than three lights say for or against one normal, where any of them may be off for motion."""

from dataclasses import dataclass

import cv2
import numpy as np

from psvideo.model.arrays import Floats, Mask
from psvideo.solve.normals.evidence import Evidence, Left
from psvideo.solve.normals.plate_noise import PlateNoise
from psvideo.solve.normals.trust.thin_surface import ThinSurface

SOLVED = 3
"""This many lights are explained by a normal and an albedo, whatever they show."""
MATTE = 0.03
"""Surfaces that stand still leave this much of a light that is not noise, as a share of albedo: they are not quite
matte, and rigs are a little off."""
BESIDE = (3, 3)
"""What normals leave is averaged over this many points, for noise leaves next to nothing here and there."""
LEAST = np.float32(1e-6)
NOISELESS = PlateNoise(read=0.0, photon=0.0)


@dataclass(frozen=True, kw_only=True)
class Checked:
    """How well plates of more than three lights, this many ``beyond`` three, are explained by one normal: ``puzzling``
    (row, col) is 0 where they are as what stands still, up to 1 where they are not, or nothing checks them."""

    beyond: int
    puzzling: Floats


def noise_share(points: ThinSurface, noise: PlateNoise, lamp: float) -> Floats:
    """Return how large noise is beside albedo: in the dark, and where repeats show more, in light."""
    dark = np.asarray(np.float32(noise.dark / lamp) / np.maximum(points.brightness, LEAST), np.float32)
    if points.noisier is None:
        return dark
    return np.asarray(np.maximum(dark, np.radians(points.noise_deg * np.sqrt(points.noisier))), np.float32)


def left_over(left: Left, known: Mask, noise: Floats) -> tuple[Floats, Floats, Floats]:
    """Return how many lights check a normal, the square that each usually leaves, and all that is left around."""
    free = np.maximum(left.lights - np.float32(SOLVED), 0)
    usual = np.float32(MATTE**2) + noise * noise
    seen = cv2.blur(left.squares * known, BESIDE) / np.maximum(cv2.blur(known.astype(np.float32), BESIDE), LEAST)
    return free, usual, np.asarray(seen, np.float32)


def checked(points: ThinSurface, one: Evidence, noise: PlateNoise = NOISELESS) -> Checked | None:
    """Return how well one normal explains the points' plates; None where three lights leave nothing to see."""
    if one.left is None or len(one.plates) <= SOLVED:
        return None
    dark = noise_share(points, noise, float(one.lit.intensities.mean()))
    free, usual, seen = left_over(one.left, points.known, dark)
    puzzling = np.where(free > 0, 1 - np.exp(-seen / (2 * np.maximum(free, 1) * usual)), 1)
    return Checked(beyond=len(one.plates) - SOLVED, puzzling=np.asarray(puzzling, np.float32))
