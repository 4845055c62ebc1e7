"""How strong lights are, from a white target whose place is known: intensity per light and channel.

What a light sends to a flat matte target (``white_target``) is the same everywhere but for the lens's and the lamps'
own falloff, and its median is the intensity.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from psvideo.calibrate.light_pictures import LightPictures
from psvideo.calibrate.white_target import Target, brighter_part, on_target, parts_of
from psvideo.errors import PsvideoError
from psvideo.model.arrays import Doubles
from psvideo.model.irradiance.falloff import POWERS, Falloff, terms
from psvideo.model.irradiance.ground import Ground
from psvideo.model.irradiance.intensity import with_measured
from psvideo.model.rig import Light, Rig

MOST_ERROR = 0.5
"""Intensities less certain than this share of themselves are none: no flat target differs so much from part to part."""
MOST_PIXELS = 20_000
ROUNDS = 5
BLOCKS = 24
"""The target is compared with itself in so many blocks a side: what grain does to single pixels is no falloff."""


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
    brighter, is_even = brighter_part(np.array([blocks for _, blocks in measured]), target)
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


def with_intensities(rig: Rig, strengths: Sequence[Sequence[float]], pictures: LightPictures) -> Rig:
    """Return the rig with the intensities measured in some pictures, (light, channel); lights that were not in the
    pictures are left out."""
    flashes_s = pictures.flashes_s or [None] * len(pictures.names)
    lights = tuple(
        with_measured(light, seen, flash_s=flash_s, coloured=light.colour is not None)
        for light, seen, flash_s in zip(rig.select(pictures.names), strengths, flashes_s, strict=True)
    )
    return replace(rig, lights=lights)


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
