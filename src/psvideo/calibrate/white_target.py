"""A white target in the pictures of lights: its part of the picture, and what each light sends to it.

It shows ``albedo * intensity * n . l``, with near lights falling off over it. Divided by what the rig says of
directions and distances, the picture of each light is flat but for the lens's and the lamps' own falloff.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from psvideo.calibrate.light_pictures import LightPictures
from psvideo.errors import PsvideoError
from psvideo.model.arrays import Doubles
from psvideo.model.irradiance.ground import Ground
from psvideo.model.irradiance.near_light import field_of
from psvideo.model.rig import Light

LEAST_SHARE = 0.5
"""Share of the target's pixels that must be unsaturated and seen."""
LEAST_COSINE = 0.05
"""Of the angle between a target and a light: at this one, a direction wrong by a degree costs a third of the intensity,
and at less any share of it."""
PARTS, LEAST_PX = 4, 8
"""A target's parts, so many a side, say by how they differ how well it is known; so that each has four pixels at least,
it has so many rows and columns."""
PART = 1.6
"""Where a twentieth of the picture is so many times brighter than half of it under all lights alike, the target fills
only that part: lamps are brightest in places of their own, and lenses darken corners by less than half of that."""


@dataclass(frozen=True, kw_only=True)
class Target:
    """A white target: its albedo, its unit normal, and the part of the picture it fills (rows and columns)."""

    albedo: float
    normal: Doubles
    rows: slice
    cols: slice


def on_target(
    light: Light,
    n: int,
    pictures: LightPictures,
    target: Target,
    ground: Ground | None,
    *,
    least_share: float = LEAST_SHARE,
) -> tuple[Doubles, NDArray[np.bool_]]:
    """Return what light ``n`` of the pictures sends to a target, (row, col, channel), the same everywhere but for
    falloff that the rig does not explain, infinite where saturated; and which pixels count, ``least_share`` at least.

    Raises PsvideoError where the target is too small, too much is saturated or unseen, or the light does not reach it.
    """
    part = (target.rows, target.cols)
    values = pictures.images[n][part].astype(np.float64)
    if min(values.shape[:2]) < LEAST_PX:
        raise PsvideoError(
            f"The white target is {values.shape[1]} x {values.shape[0]} pixels: how well it is known cannot be said. "
            f"Expected {LEAST_PX} x {LEAST_PX} at least: name a larger part of the picture with `box`, or go nearer."
        )
    clipped = pictures.saturated[n][part]
    values, clipped = (one if one.ndim == 3 else one[..., None] for one in (values, clipped))
    values[clipped.any(axis=2)] = np.inf
    usable = ~clipped.any(axis=2) & pictures.seen[n][target.rows, None]
    if usable.mean() < least_share:
        raise PsvideoError(
            f"Light {light.name!r}: {1 - usable.mean():.0%} of the white target is saturated or was not seen; at most "
            f"{1 - least_share:.0%} may be. Expose less, dim the light, or name a part of the picture with `box`."
        )
    field = field_of(light, ground, part)
    shade = field @ target.normal
    if np.min(shade) <= LEAST_COSINE * np.max(np.linalg.norm(field, axis=-1)):
        raise PsvideoError(
            f"Light {light.name!r}: by the rig it stands behind the white target, or just at its edge. Check "
            "the light's direction in the rig, or say with the rig's [surface] plane which way the target faces."
        )
    return values / np.broadcast_to(shade, usable.shape)[..., None] / target.albedo, usable


def parts_of(shape: tuple[int, ...]) -> list[tuple[slice, slice]]:
    """Return the rows and columns of a picture's parts, PARTS a side."""
    rows, cols = (np.linspace(0, size, PARTS + 1).astype(int).tolist() for size in shape[:2])
    return [(slice(*one), slice(*other)) for one in pairwise(rows) for other in pairwise(cols)]


def brighter_part(blocks: Doubles, target: Target) -> tuple[str, bool]:
    """Return what is to be said where the target fills only a part of the picture, or of the box, else ""; and whether
    that part is as even as a flat target under each light. ``blocks`` (light, row, col) are what shows under every
    light, 1 in the median."""
    alike = np.exp(np.log(np.maximum(blocks, 1e-3)).mean(axis=0))
    alike /= np.nanmedian(alike)
    brightest = float(np.nanpercentile(alike, 95))
    if not brightest > PART:
        return "", False
    inside = alike > np.sqrt(brightest)
    low, high = np.nanpercentile(blocks[:, inside], [20, 80], axis=1)
    rows, cols = np.nonzero(inside)
    top, bottom = _from_blocks(rows, alike.shape[0], target.rows)
    left, right = _from_blocks(cols, alike.shape[1], target.cols)
    said = (
        f"A part of the picture, about {left},{top},{right},{bottom} (left, top, right, bottom), is {brightest:.1f} "
        "times as bright as most of it under all lights. Expected the white target alone: name its part of the picture "
        "with `box`, or go nearer."
    )
    return said, bool((high < PART * low).all())


def _from_blocks(at: NDArray[np.intp], count: int, whole: slice) -> tuple[int, int]:
    """Return the first and the last pixel, past the end, of blocks ``at`` among so many of a part of the picture,
    without those at both ends, which the target may fill in part."""
    blocks = np.array_split(np.arange(whole.start, whole.stop), count)
    inset = 1 if at.max() - at.min() > 2 else 0
    return int(blocks[at.min() + inset][0]), int(blocks[at.max() - inset][-1]) + 1
