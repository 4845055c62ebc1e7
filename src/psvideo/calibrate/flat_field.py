"""How strong lights are, from a white target whose place is known: intensity per light and channel.

A flat matte target shows ``albedo * intensity * n . l``, with near lights falling off over it. Divided by what the rig
says of directions and distances, the picture of each light is flat but for the lens's and the lamps' own falloff, and
its median is the intensity.
"""

from dataclasses import dataclass, replace

import numpy as np

from psvideo.calibrate.light_pictures import LightPictures
from psvideo.camera import FloatArray
from psvideo.errors import PsvideoError
from psvideo.normals.near_light import Ground, field_of
from psvideo.rig import Light, Rig

LEAST_SHARE = 0.5
"""Share of the target's pixels that must be unsaturated and seen."""
LEAST_COSINE = 0.05


@dataclass(frozen=True, kw_only=True)
class FlatLight:
    """One light's intensity per channel and its relative standard error, and the falloff that the rig does not explain:
    the share by which the middle 90 % of the target differ from each other."""

    name: str
    intensity: FloatArray
    intensity_error: float
    falloff: float


@dataclass(frozen=True, kw_only=True)
class Target:
    """A white target: its albedo, its unit normal, and the part of the picture it fills (rows and columns)."""

    albedo: float
    normal: FloatArray
    rows: slice
    cols: slice


def measure_flat_field(
    pictures: LightPictures, rig: Rig, target: Target, *, ground: Ground | None = None
) -> list[FlatLight]:
    """Return every light's intensity. ``ground`` is where the target stands, needed where lights are near.

    Raises PsvideoError where the rig lacks a light, where one does not reach the target, or where too much of it is
    saturated.
    """
    lights = rig.select(pictures.names)
    return [_flat(light, n, pictures, target, ground) for n, light in enumerate(lights)]


def with_intensities(rig: Rig, found: list[FlatLight]) -> Rig:
    """Return the rig with the measured intensities; lights that were not in the pictures are left out."""
    known = {light.name: light for light in rig.lights}
    lights = tuple(
        replace(known[one.name], intensity=tuple(float(f"{value:.6g}") for value in one.intensity)) for one in found
    )
    return replace(rig, lights=lights)


def _flat(light: Light, n: int, pictures: LightPictures, target: Target, ground: Ground | None) -> FlatLight:
    part = (target.rows, target.cols)
    values = pictures.images[n][part].astype(np.float64)
    clipped = pictures.saturated[n][part]
    values, clipped = (one if one.ndim == 3 else one[..., None] for one in (values, clipped))
    usable = ~clipped.any(axis=2) & pictures.seen[n][target.rows, None]
    if usable.mean() < LEAST_SHARE:
        raise PsvideoError(
            f"Light {light.name!r}: {1 - usable.mean():.0%} of the white target is saturated or was not seen; at most "
            f"{1 - LEAST_SHARE:.0%} may be. Expose less, dim the light, or name a part of the picture with --box."
        )
    shade = field_of(light, ground, part) @ target.normal
    if np.min(shade) <= LEAST_COSINE * np.max(np.abs(shade)):
        raise PsvideoError(
            f"Light {light.name!r} does not reach the white target by the rig's direction: expected it before the "
            "target's face. Check the rig, or give the target's normal with the rig's [surface] plane."
        )
    flat = values / np.broadcast_to(shade, usable.shape)[..., None] / target.albedo
    level = np.median(flat[usable], axis=0)
    if np.min(level) <= 0:
        raise PsvideoError(f"Light {light.name!r}: the white target is black in a channel. Check that it was flashed.")
    rows = np.array_split(np.arange(flat.shape[0]), 4)
    patches = [
        np.median(flat[rows_[0] : rows_[-1] + 1][usable[rows_[0] : rows_[-1] + 1]].mean(axis=1))
        for rows_ in rows
        if len(rows_) and usable[rows_[0] : rows_[-1] + 1].any()
    ]
    low, high = np.percentile(flat[usable].mean(axis=1), [5, 95])
    mean = float(level.mean())
    return FlatLight(
        name=light.name,
        intensity=level,
        intensity_error=float(np.std(patches) / np.sqrt(max(len(patches) - 1, 1)) / mean),
        falloff=float((high - low) / mean),
    )
