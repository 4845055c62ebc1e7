"""How strong lights are, from a white target whose place is known: intensity per light and channel.

A flat matte target shows ``albedo * intensity * n . l``, with near lights falling off over it. Divided by what the rig
says of directions and distances, the picture of each light is flat but for the lens's and the lamps' own falloff, and
its median is the intensity.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from psvideo.calibrate.light_pictures import LightPictures
from psvideo.errors import PsvideoError
from psvideo.model.arrays import Doubles
from psvideo.model.irradiance.falloff import POWERS, Falloff, terms
from psvideo.model.irradiance.ground import Ground
from psvideo.model.irradiance.intensity import with_measured
from psvideo.model.irradiance.near_light import field_of
from psvideo.model.rig import Light, Rig

LEAST_SHARE = 0.5
"""Share of the target's pixels that must be unsaturated and seen."""
LEAST_COSINE = 0.05
"""Of the angle between a target and a light: at this one, a direction wrong by a degree costs a third of the intensity,
and at less any share of it."""
MOST_ERROR = 0.5
"""Intensities less certain than this share of themselves are none: no flat target differs so much from part to part."""
PARTS, LEAST_PX = 4, 8
"""A target's parts, so many a side, say by how they differ how well it is known; so that each has four pixels at least,
it has so many rows and columns."""
MOST_PIXELS = 20_000
ROUNDS = 5
BLOCKS = 24
"""The target is compared with itself in so many blocks a side: what grain does to single pixels is no falloff."""
PART = 1.6
"""Where a twentieth of the picture is so many times brighter than half of it under all lights alike, the target fills
only that part: lamps are brightest in places of their own, and lenses darken corners by less than half of that."""


@dataclass(frozen=True, kw_only=True)
class FlatLight:
    """One light's intensity per channel and its relative standard error, and the falloff that the rig does not explain:
    the share by which the middle 90 % of the target differ from each other. ``coefficients`` are that falloff's smooth
    part (``psvideo.model.irradiance.falloff``), ``left`` what differs beside it in the same way."""

    name: str
    intensity: Doubles
    intensity_error: float
    falloff: float
    coefficients: tuple[float, ...]
    left: float


@dataclass(frozen=True, kw_only=True)
class Target:
    """A white target: its albedo, its unit normal, and the part of the picture it fills (rows and columns)."""

    albedo: float
    normal: Doubles
    rows: slice
    cols: slice


def measure_flat_field(
    pictures: LightPictures, rig: Rig, target: Target, *, ground: Ground | None = None
) -> list[FlatLight]:
    """Return every light's intensity. ``ground`` is where the target stands, needed where lights are near.

    Raises PsvideoError where the rig lacks a light, where one does not reach the target, where too much of it is
    saturated, or where what is seen is no flat target, or more than it.
    """
    lights = rig.select(pictures.names)
    measured = [_flat(light, n, pictures, target, ground) for n, light in enumerate(lights)]
    found = [light for light, _ in measured]
    brighter, is_even = _brighter_part(np.array([blocks for _, blocks in measured]), target)
    worst = max(found, key=lambda one: one.intensity_error)
    if worst.intensity_error > MOST_ERROR and not (brighter and is_even):
        raise PsvideoError(
            f"Light {worst.name!r}: its intensity comes out at {worst.intensity.mean():.3g} +- "
            f"{worst.intensity_error:.0%}, as where the pictures show no white target, or more than it. Expected a "
            "matte white one that faces the camera or lies in the rig's plane: name its part of the picture with `box`."
        )
    if brighter:
        raise PsvideoError(brighter)
    return found


def _brighter_part(blocks: Doubles, target: Target) -> tuple[str, bool]:
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


def with_intensities(rig: Rig, strengths: Sequence[Sequence[float]], pictures: LightPictures) -> Rig:
    """Return the rig with the intensities measured in some pictures, (light, channel); lights that were not in the
    pictures are left out."""
    flashes_s = pictures.flashes_s or [None] * len(pictures.names)
    lights = tuple(
        with_measured(light, seen, flash_s=flash_s, coloured=light.colour is not None)
        for light, seen, flash_s in zip(rig.select(pictures.names), strengths, flashes_s, strict=True)
    )
    return replace(rig, lights=lights)


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


def _flat(
    light: Light, n: int, pictures: LightPictures, target: Target, ground: Ground | None
) -> tuple[FlatLight, Doubles]:
    """Return a light's strength, and what the target shows in blocks, 1 in the median."""
    flat, usable = on_target(light, n, pictures, target, ground)
    known = usable | np.isinf(flat).any(axis=2)
    level = _median(flat[known])
    if np.min(level) <= 0:
        raise PsvideoError(f"Light {light.name!r}: the white target is black in a channel. Check that it was flashed.")
    medians = [_median(flat[part][known[part]]).mean() for part in parts_of(flat.shape) if usable[part].any()]
    patches = [one for one in medians if np.isfinite(one)]
    mean = float(level.mean())
    grey = np.where(usable, flat.mean(axis=2) / mean, np.nan)
    coefficients, left = _smooth(grey, target, pictures)
    blocks = _in_blocks(grey)
    low, high = np.nanpercentile(blocks, [5, 95])
    measured = FlatLight(
        name=light.name,
        intensity=level,
        intensity_error=float(np.std(patches) / np.sqrt(max(len(patches) - 1, 1)) / mean),
        falloff=float(high - low),
        coefficients=coefficients,
        left=left,
    )
    return measured, blocks


def _median(values: Doubles) -> Doubles:
    """Return the medians of values (pixel, channel), of which less than half may be infinite: what is clipped is
    brighter than the others."""
    return np.asarray(np.quantile(values, 0.5, axis=0, method="lower"))


def parts_of(shape: tuple[int, ...]) -> list[tuple[slice, slice]]:
    """Return the rows and columns of a picture's parts, PARTS a side."""
    rows, cols = (np.linspace(0, size, PARTS + 1).astype(int).tolist() for size in shape[:2])
    return [(slice(*one), slice(*other)) for one in pairwise(rows) for other in pairwise(cols)]


def _in_blocks(grey: Doubles) -> Doubles:
    """Return the medians of blocks of a picture (row, col), NaN where nothing is known."""
    rows, cols = (np.array_split(np.arange(size), min(size, BLOCKS)) for size in grey.shape)
    parts = [[grey[one[0] : one[-1] + 1, other[0] : other[-1] + 1] for other in cols] for one in rows]
    return np.array([[np.nanmedian(p) if np.isfinite(p).any() else np.nan for p in line] for line in parts])


def falloff_of(found: Sequence[FlatLight], target: Target, pictures: LightPictures) -> Falloff:
    """Return the falloff that was measured, for ``psvideo normals``."""
    return Falloff(
        width_px=pictures.width_px,
        height_px=pictures.height_px,
        box=(target.cols.start, target.rows.start, target.cols.stop, target.rows.stop),
        lights=tuple((one.name, one.coefficients) for one in found),
    )


def _smooth(grey: Doubles, target: Target, pictures: LightPictures) -> tuple[tuple[float, ...], float]:
    """Return the polynomial of the logarithm of what a target shows (row, col), NaN where unknown, robustly; and the
    share by which the middle 90 % of the target still differ."""
    step = max(int(np.sqrt(grey.size / MOST_PIXELS)), 1)
    cols = np.arange(target.cols.start, target.cols.stop)[::step]
    rows = np.arange(target.rows.start, target.rows.stop)[::step]
    across, down = terms(cols, rows, width_px=pictures.width_px, height_px=pictures.height_px)
    thinned = grey[::step, ::step]
    known = np.isfinite(thinned) & (thinned > 0)
    basis = np.stack([np.outer(down**j, across**i)[known] for i, j in POWERS], axis=1)
    values = np.log(thinned[known])
    weight = np.ones_like(values)
    for _ in range(ROUNDS):
        solved = np.linalg.lstsq(basis * weight[:, None], values * weight, rcond=None)[0]
        rest = values - basis @ solved
        scale = 1.4826 * float(np.median(np.abs(rest))) + 1e-6
        weight = np.sqrt(1 / (1 + (rest / (2.385 * scale)) ** 2))  # Cauchy: dirt and print weigh little
    low, high = np.percentile(np.exp(rest), [5, 95])
    return tuple(float(f"{value:.6g}") for value in solved), float(high - low)
