"""Every plate compared with the diffuse model: which lights reach a pixel, and what exceeds the model.

The model is ``plate = albedo * intensity * max(0, n . direction)``.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles, Floats, Mask
from psvideo.model.channels import mean_of_channels
from psvideo.model.irradiance.ground import every_ray
from psvideo.model.irradiance.near_light import near_vectors
from psvideo.model.surface import Surface
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.plate_noise import PlateNoise
from psvideo.solve.normals.solving import CERTAIN, INDIRECT
from psvideo.solve.passes.plate_rows import PlateRows

SHADOWED = 1 / 3
"""Below this share of what the light would give unhindered, a pixel lies in its shadow: the rest comes from around."""


@dataclass(frozen=True, kw_only=True)
class Explaining:
    """Plates, and the surface and lights that explain them; ``mask`` (row, col) is where to look, None for all."""

    rows: PlateRows
    surface: Surface
    lit: Illumination
    noise: PlateNoise
    mask: Mask | None = None

    @property
    def dark(self) -> float:
        """The mean over channels from which on a pixel is certain to be lit."""
        return CERTAIN * max(self.noise.dark / float(np.sqrt(self.lit.intensities.shape[1])), self.noise.least)

    def expected(self, light: int, first: int, last: int) -> Floats:
        """Return what the model says of a light's rows, (row, col, channel)."""
        normals = self.surface.normals[first:last].astype(np.float32)
        towards = (normals * _sent(self.lit, light, first, last)).sum(axis=-1)
        albedo = self.surface.albedo[first:last].reshape(*towards.shape, -1).astype(np.float32)
        strength = self.lit.intensities[light].astype(np.float32)
        return np.asarray(np.maximum(towards, 0)[..., None] * albedo * strength, np.float32)

    def where(self, first: int, last: int) -> NDArray[np.bool_]:
        """Return where to look, (row, col) or (1, 1)."""
        return np.ones((1, 1), np.bool_) if self.mask is None else self.mask[first:last]


def _sent(lit: Illumination, light: int, first: int, last: int) -> Floats:
    """Return what a light of the strength in ``intensities`` sends to rows: direction times falloff, (row, col, 3)."""
    field = lit.near
    if field is None or not field.is_near[light]:
        return np.asarray(lit.directions[light], np.float32)
    ground = field.ground
    x, y = every_ray(ground.focal_px, ground.principal_px, *ground.depth_m.shape)
    depth_m = ground.depth_m[first:last].astype(np.float64)
    points_m: Doubles = np.stack([x * depth_m, y[first:last] * depth_m, -depth_m], axis=-1)
    sent = near_vectors(points_m, field.positions_m[light], axis=field.axes[light], anisotropy=field.anisotropy[light])
    return np.asarray(sent / field.middle_gain[light], np.float32)


def reach_of(one: Explaining) -> NDArray[np.uint16]:
    """Return how many lights reach each pixel, (row, col).

    A light reaches a pixel that it lights certainly (beyond noise), and by no less than SHADOWED of what it would give
    unhindered; where the surface turns away from it, or is not known, by more than light from around (INDIRECT).
    Clipped is lit.
    """
    reach = np.zeros(one.rows.shape[:2], np.uint16)
    lights, dark = len(one.lit.names), np.float32(one.dark)
    strength = one.lit.intensities.mean(axis=1).astype(np.float32)

    def count(first: int, last: int) -> None:
        levels = [mean_of_channels(one.rows.light(light, first, last)) for light in range(lights)]
        usual = INDIRECT * np.mean([level / of for level, of in zip(levels, strength, strict=True)], axis=0)
        for light, (level, of) in enumerate(zip(levels, strength, strict=True)):
            expected = mean_of_channels(one.expected(light, first, last))
            least = np.where(expected > dark, np.float32(SHADOWED) * expected, usual * of)
            reached = (level > dark) & (level > least) & one.rows.shown(light, first, last)
            reach[first:last] += reached & one.where(first, last)

    one.rows.over_bands(count)
    return reach


def specular_of(
    one: Explaining, weights: Sequence[float], *, each: bool = False
) -> tuple[Floats, tuple[NDArray[np.float16], ...]]:
    """Return what plates hold beyond the diffuse model, summed with the lights' weights (row, col[, 3]), and with
    ``each`` that of every light by itself.

    What noise may make is 0, and so is what was not measured. A clipped sample holds at least this much.
    """
    total = np.zeros(one.rows.shape, np.float32)
    parts = tuple(np.zeros(one.rows.shape, np.float16) for _ in weights) if each else ()

    def exceed(first: int, last: int) -> None:
        known = one.surface.measured[first:last] & one.where(first, last)
        for light, weight in enumerate(weights):
            level = one.rows.light(light, first, last)
            over = level - one.expected(light, first, last)
            sigma = np.sqrt(one.noise.read + one.noise.photon * np.maximum(level, 0))
            there = known & one.rows.shown(light, first, last)
            kept = np.where((over > CERTAIN * sigma) & there[..., None], over, 0).astype(np.float32)
            kept = kept.reshape(total[first:last].shape)
            total[first:last] += np.float32(weight) * kept
            if each:
                parts[light][first:last] = kept

    one.rows.over_bands(exceed)
    return total, parts
