"""Where lights are and how strong, from a matte sphere whose outline is known.

Every pixel of the sphere has a known normal n, and a matte surface shows ``intensity * albedo * n . l``: linear in the
light's strength times direction, thousands of pixels give it by least squares. Only the part that a light reaches well
is used, and it is weighed robustly (Tukey; P. J. Huber, "Robust Statistics", 1981): near the terminator paint is not
matte, light comes back from the surroundings, and gloss adds a spot. A lamp that stands near shades the sphere
otherwise, and is fitted as such (``matte_shading``). Errors come from leaving out one patch of the sphere after the
other (jackknife), because what a real paint does otherwise is alike over whole patches, from how well the outline is
known, and from how far a lamp would be elsewhere if the shading's shape were not known: rough paint and light in the
room make it flatter. The sphere's albedo is the same for all lights: without it intensities are relative.
"""

from dataclasses import dataclass, replace

import numpy as np

from psvideo.calibrate.light_pictures import LightPictures
from psvideo.calibrate.matte_shading import FLATTEST, LEAST_PIXELS, STEEPER_COSINE, MatteFit, MattePixels, matte_fit
from psvideo.calibrate.sphere.outline import Outline
from psvideo.calibrate.sphere.sphere_view import SphereView
from psvideo.errors import PsvideoError
from psvideo.model.arrays import Doubles, Mask
from psvideo.model.rig import Light, Rig
from psvideo.model.units import counted

INNER_DEG = 72.0
"""Pixels count whose normal turns from the viewing ray by less: the rim mixes with what is behind it."""
PATCHES, FEWEST_OF_A_PATCH = 4, 10
"""The jackknife leaves out one of this many times this many patches of the outline's square, of which so many pixels
counted."""
MOST_PIXELS = 40_000
MOST_LEFT = 0.1
"""Share of a light's brightness that may stay unexplained (median) before the sphere is called not matte."""
MOST_ERROR_DEG = 8.0
"""A light whose direction is less known is left out: its patches contradict each other, and the thing is no sphere."""


@dataclass(frozen=True, kw_only=True)
class MatteLight:
    """One light: direction with standard error, intensity per channel with relative standard error.

    ``left`` is the share of its brightness that a matte sphere does not explain (median), ``used`` the share of the
    sphere's pixels that counted. ``nearness`` is the sphere's radius over the lamp's distance, 0 far away;
    ``flatter_deg`` by how much the direction turns if the sphere may be shaded flatter than a matte one is. ``fault``
    says why the light is left out.
    """

    name: str
    direction: Doubles
    error_deg: float
    intensity: Doubles
    intensity_error: float
    left: float
    used: float
    nearness: float = 0.0
    flatter_deg: float = 0.0
    fault: str = ""


def measure_matte_sphere(pictures: LightPictures, outline: Outline, *, albedo: float | None = None) -> list[MatteLight]:
    """Return every light's direction and intensity.

    ``albedo`` is the sphere's; left out, intensities are scaled so that their mean over lights and channels is 1.
    Raises PsvideoError where too little of the sphere is seen.
    """
    sphere = _pixels(pictures, outline.view, outline.place)
    if len(sphere.normals) < LEAST_PIXELS:
        raise PsvideoError(
            f"The sphere shows {counted(len(sphere.normals), 'usable pixel')}; expected {LEAST_PIXELS} or more. Film "
            "it larger, or check its outline (`circle` x,y,radius)."
        )
    moved = [_pixels(pictures, outline.view, place) for place in _outlines_off(outline)]
    found = _all_as_flat([_light(name, n, sphere, moved) for n, name in enumerate(pictures.names)])
    good = [light.intensity for light in found if not light.fault]
    scale = 1 / albedo if albedo is not None else 1 / float(np.mean(good)) if good else 1.0
    return [replace(light, intensity=light.intensity * scale) for light in found]


def matte_rig(lights: list[MatteLight], view: SphereView) -> Rig:
    """Return the rig of the lights that could be measured."""
    focal = None if view.focal_px is None else (view.focal_px, view.focal_px)
    return Rig(
        lights=tuple(_as_light(light) for light in lights if not light.fault),
        focal_px=focal,
        principal_px=None if focal is None else view.principal_px,
    )


def _as_light(light: MatteLight) -> Light:
    x, y, z = (float(value) for value in light.direction)
    strengths = tuple(float(f"{value:.6g}") for value in light.intensity)
    return Light(name=light.name, direction=(x, y, z), intensity=strengths, error_deg=round(light.error_deg, 3))


def sphere_normals(view: SphereView, place: Doubles, points: Doubles) -> tuple[Doubles, Doubles]:
    """Return the sphere's normals (point, 3) where the rays through points (x, y) meet it, and the facing cosines.

    The cosine between normal and the ray back is 0 or less where the ray misses.
    """
    centre, radius = view.sphere(place)
    origins, directions = view.rays(view.unstretched(points, place))
    along = ((centre - origins) * directions).sum(axis=1)
    gap = radius**2 - ((origins + along[:, None] * directions - centre) ** 2).sum(axis=1)
    met = origins + (along - np.sqrt(np.maximum(gap, 0)))[:, None] * directions
    normals: Doubles = (met - centre) / radius
    facing: Doubles = np.where(gap > 0, -(normals * directions).sum(axis=1), 0.0)
    return normals, facing


def _pixels(pictures: LightPictures, view: SphereView, place: Doubles) -> MattePixels:
    """Take the sphere's pixels out of the pictures, evenly thinned where they are very many."""
    x, y, radius = place[:3]
    step = max(int(np.ceil(np.sqrt(np.pi * radius**2 / MOST_PIXELS))), 1)
    rows, cols = pictures.height_px, pictures.width_px
    row = np.arange(max(int(y - 1.1 * radius), 0), min(int(y + 1.1 * radius) + 1, rows), step)
    col = np.arange(max(int(x - 1.1 * radius), 0), min(int(x + 1.1 * radius) + 1, cols), step)
    points = np.stack(np.meshgrid(col, row), axis=-1).reshape(-1, 2).astype(np.float64)
    normals, facing = sphere_normals(view, place, points)
    kept = facing > np.cos(np.radians(INNER_DEG))
    col, row = points[kept].T.astype(np.intp)
    images = pictures.images if pictures.images.ndim == 4 else pictures.images[..., None]
    clipped = pictures.saturated if pictures.saturated.ndim == 4 else pictures.saturated[..., None]
    across, down = ((points[kept] - [x, y]) / radius * 0.5 + 0.5).T
    patch = np.clip(across * PATCHES, 0, PATCHES - 1).astype(np.intp) * PATCHES
    return MattePixels(
        normals=normals[kept],
        patch=patch + np.clip(down * PATCHES, 0, PATCHES - 1).astype(np.intp),
        values=images[:, row, col].astype(np.float64),
        usable=~clipped[:, row, col].any(axis=2) & pictures.seen[:, row],
    )


def _outlines_off(outline: Outline) -> list[Doubles]:
    """Return the outline moved by its standard error in the three ways it may be off: x, y and radius together."""
    values, ways = np.linalg.eigh(outline.covariance[:3, :3])
    moves = (ways * np.sqrt(np.maximum(values, 0))).T
    return [outline.place + np.concatenate([move, [0.0, 0.0]]) for move in moves]


def _light(name: str, n: int, sphere: MattePixels, moved: list[MattePixels]) -> MatteLight:
    everything = np.ones(len(sphere.normals), np.bool_)
    found = matte_fit(sphere, n, everything)
    total = found.total
    direction = total / max(float(np.linalg.norm(total)), 1e-12)
    light = MatteLight(
        name=name, direction=direction, error_deg=180.0, intensity=found.strengths @ direction, intensity_error=1.0,
        left=found.left, used=float(found.lit.mean()), nearness=found.nearness,
    )  # fmt: skip
    fault = _fault(sphere, n, found.lit, light.intensity, found.left)
    if fault:
        return replace(light, fault=fault)
    by_parts, by_outline = _covariances(sphere, n, moved, found)
    flatter = matte_fit(sphere, n, everything, flattest=FLATTEST).total - total
    by_shape = np.outer(flatter, flatter)
    covariance = by_parts + by_outline + by_shape
    length = float(np.linalg.norm(total))
    parts_deg, shape_deg, error_deg = (_turned_deg(one, direction, length) for one in (by_parts, by_shape, covariance))
    why = _TOO_FLAT if shape_deg > parts_deg else _CONTRADICTS if parts_deg > MOST_ERROR_DEG else _OUTLINE_UNSURE
    return replace(
        light,
        error_deg=error_deg,
        intensity_error=float(np.sqrt(direction @ covariance @ direction) / length),
        flatter_deg=shape_deg,
        fault="" if error_deg <= MOST_ERROR_DEG else why,
    )


def _all_as_flat(lights: list[MatteLight]) -> list[MatteLight]:
    """Return lights whose errors hold at least what the sphere's shading is flatter by under all of them, root mean
    square: paint and room are the same for all, and lights beside the camera's axis show them best."""
    good = [light.flatter_deg for light in lights if not light.fault]
    common = float(np.sqrt(np.mean(np.square(good)))) if good else 0.0
    return [
        light
        if light.fault or light.flatter_deg >= common
        else replace(light, error_deg=float(np.sqrt(light.error_deg**2 - light.flatter_deg**2 + common**2)))
        for light in lights
    ]


def _turned_deg(covariance: Doubles, direction: Doubles, length: float) -> float:
    """Return the root mean square angle by which a vector of this direction and length is turned."""
    across = np.eye(3) - np.outer(direction, direction)
    return float(np.degrees(np.sqrt(np.trace(across @ covariance @ across)) / length))


def _covariances(sphere: MattePixels, n: int, moved: list[MattePixels], found: MatteFit) -> tuple[Doubles, Doubles]:
    """Return the covariance (3, 3) of a light's direction times its intensity: how it changes as patches are left out
    one by one and as only what is well lit counts; and as the outline is moved by its own error."""
    everything, total = np.ones(len(sphere.normals), np.bool_), found.total
    seen = np.bincount(sphere.patch[found.lit], minlength=PATCHES**2)
    patches = np.flatnonzero(seen >= FEWEST_OF_A_PATCH)
    without = [matte_fit(sphere, n, sphere.patch != patch).total for patch in patches]
    well_lit = matte_fit(sphere, n, everything, least_cosine=STEEPER_COSINE).total
    off = [matte_fit(one, n, np.ones(len(one.normals), np.bool_)).total for one in moved]
    count = max(len(patches), 1)
    spread = np.array([one - total for one in without])
    by_parts: Doubles = (count - 1) / count * spread.T @ spread + np.outer(well_lit - total, well_lit - total)
    by_outline: Doubles = np.sum([np.outer(one - total, one - total) for one in off], axis=0)
    return by_parts, by_outline


_OUTLINE_UNSURE = "where the sphere's outline is, is not known well enough to say where the light is"
_TOO_FLAT = (
    "it fades less towards its shadow than a matte sphere does under one lamp: light in the room (a picture named "
    "ambient takes it off), another curve (`transfer`), or paint that is not matte"
)
_CONTRADICTS = "its parts contradict each other: what is inside the outline is no matte sphere of one colour"


def _fault(sphere: MattePixels, n: int, lit: Mask, intensity: Doubles, left: float) -> str:
    if intensity.min() <= 0 or lit.sum() < LEAST_PIXELS:
        clipped = 1 - sphere.usable[n].mean()
        why = f"{clipped:.0%} of the sphere is saturated" if clipped > 0.2 else "it hardly lights the sphere"
        return f"{why}, and too few pixels are left to measure it"
    if left > MOST_LEFT:
        return (
            f"a matte sphere leaves {left:.0%} of its brightness unexplained: the sphere is not matte, the outline is "
            "wrong, or other light falls on it"
        )
    return ""
