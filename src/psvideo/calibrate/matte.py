"""Where lights are and how strong, from a matte sphere whose outline is known.

Every pixel of the sphere has a known normal n, and a matte surface shows ``intensity * albedo * n . l``: linear in the
light's strength times direction, thousands of pixels give it by least squares. Only the part that a light reaches well
is used, and it is weighed robustly (Tukey; P. J. Huber, "Robust Statistics", 1981): near the terminator paint is not
matte, light comes back from the surroundings, and gloss adds a spot. Errors come from leaving out one patch of the
sphere after the other (jackknife), because what a real paint does otherwise is alike over whole patches, and from how
well the outline is known. The sphere's albedo is the same for all lights: without it intensities are relative.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from psvideo.calibrate.light_pictures import LightPictures
from psvideo.calibrate.sphere.outline import Outline
from psvideo.calibrate.sphere.sphere_view import SphereView
from psvideo.errors import PsvideoError
from psvideo.model.arrays import Doubles
from psvideo.model.rig import Light, Rig

INNER_DEG = 72.0
"""Pixels count whose normal turns from the viewing ray by less: the rim mixes with what is behind it."""
LEAST_COSINE, STEEPER_COSINE = 0.1, 0.4
"""Pixels count that a light reaches at 84 degrees from the normal or less. What changes when only those within 66 count
goes into the error: no paint is quite matte."""
TUKEY_WIDTH = 4.685
ROUNDS = 12
PATCHES, FEWEST_OF_A_PATCH = 4, 10
"""The jackknife leaves out one of this many times this many patches of the outline's square, of which so many pixels
counted."""
LEAST_PIXELS = 200
MOST_PIXELS = 40_000
MOST_LEFT = 0.1
"""Share of a light's brightness that may stay unexplained (median) before the sphere is called not matte."""
MOST_ERROR_DEG = 8.0
"""A light whose direction is less known is left out: its patches contradict each other, and the thing is no sphere."""


@dataclass(frozen=True, kw_only=True)
class MatteLight:
    """One light: direction with standard error, intensity per channel with relative standard error.

    ``left`` is the share of its brightness that a matte sphere does not explain (median), ``used`` the share of the
    sphere's pixels that counted. ``fault`` says why the light is left out.
    """

    name: str
    direction: Doubles
    error_deg: float
    intensity: Doubles
    intensity_error: float
    left: float
    used: float
    fault: str = ""


@dataclass(frozen=True, kw_only=True)
class _Sphere:
    """Pixels of the sphere: normals (pixel, 3), which patch each belongs to, values (light, pixel, channel)."""

    normals: Doubles
    patch: NDArray[np.intp]
    values: Doubles
    usable: NDArray[np.bool_]


def measure_matte_sphere(pictures: LightPictures, outline: Outline, *, albedo: float | None = None) -> list[MatteLight]:
    """Return every light's direction and intensity.

    ``albedo`` is the sphere's; left out, intensities are scaled so that their mean over lights and channels is 1.
    Raises PsvideoError where too little of the sphere is seen.
    """
    sphere = _pixels(pictures, outline.view, outline.place)
    if len(sphere.normals) < LEAST_PIXELS:
        raise PsvideoError(
            f"The sphere shows {len(sphere.normals)} usable pixels; expected {LEAST_PIXELS} or more. Film it larger, "
            "or check its outline (`circle` x,y,radius)."
        )
    moved = [_pixels(pictures, outline.view, place) for place in _outlines_off(outline)]
    found = [_light(name, n, sphere, moved) for n, name in enumerate(pictures.names)]
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


def _pixels(pictures: LightPictures, view: SphereView, place: Doubles) -> _Sphere:
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
    return _Sphere(
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


def _light(name: str, n: int, sphere: _Sphere, moved: list[_Sphere]) -> MatteLight:
    everything = np.ones(len(sphere.normals), np.bool_)
    strengths, left, lit = _fitted(sphere, n, everything)
    total = strengths.sum(axis=0)
    used = float(lit.mean())
    direction = total / max(float(np.linalg.norm(total)), 1e-12)
    intensity = strengths @ direction
    fault = _fault(sphere, n, lit, intensity, left)
    if fault:
        return MatteLight(
            name=name, direction=direction, error_deg=180.0, intensity=intensity, intensity_error=1.0, left=left,
            used=used, fault=fault,
        )  # fmt: skip
    by_parts, by_outline = _covariances(sphere, n, moved, lit, total)
    covariance = by_parts + by_outline
    length = float(np.linalg.norm(total))
    error_deg = _turned_deg(covariance, direction, length)
    contradicts = _turned_deg(by_parts, direction, length) > MOST_ERROR_DEG
    return MatteLight(
        name=name,
        direction=direction,
        error_deg=error_deg,
        intensity=intensity,
        intensity_error=float(np.sqrt(direction @ covariance @ direction) / length),
        left=left,
        used=used,
        fault="" if error_deg <= MOST_ERROR_DEG else _CONTRADICTS if contradicts else _OUTLINE_UNSURE,
    )


def _turned_deg(covariance: Doubles, direction: Doubles, length: float) -> float:
    """Return the root mean square angle by which a vector of this direction and length is turned."""
    across = np.eye(3) - np.outer(direction, direction)
    return float(np.degrees(np.sqrt(np.trace(across @ covariance @ across)) / length))


def _covariances(
    sphere: _Sphere, n: int, moved: list[_Sphere], lit: NDArray[np.bool_], total: Doubles
) -> tuple[Doubles, Doubles]:
    """Return the covariance (3, 3) of a light's direction times its intensity, ``total``: how it changes as patches are
    left out one by one and as only what is well lit counts; and as the outline is moved by its own error."""
    everything = np.ones(len(sphere.normals), np.bool_)
    patches = [patch for patch in np.unique(sphere.patch) if (lit & (sphere.patch == patch)).sum() >= FEWEST_OF_A_PATCH]
    without = [_fitted(sphere, n, sphere.patch != patch)[0].sum(axis=0) for patch in patches]
    well_lit = _fitted(sphere, n, everything, least_cosine=STEEPER_COSINE)[0].sum(axis=0)
    off = [_fitted(one, n, np.ones(len(one.normals), np.bool_))[0].sum(axis=0) for one in moved]
    count = max(len(patches), 1)
    spread = np.array([one - total for one in without])
    by_parts: Doubles = (count - 1) / count * spread.T @ spread + np.outer(well_lit - total, well_lit - total)
    by_outline: Doubles = np.sum([np.outer(one - total, one - total) for one in off], axis=0)
    return by_parts, by_outline


_OUTLINE_UNSURE = "where the sphere's outline is, is not known well enough to say where the light is"
_CONTRADICTS = "its parts contradict each other: what is inside the outline is no matte sphere of one colour"


def _fault(sphere: _Sphere, n: int, lit: NDArray[np.bool_], intensity: Doubles, left: float) -> str:
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


def _fitted(
    sphere: _Sphere, n: int, chosen: NDArray[np.bool_], *, least_cosine: float = LEAST_COSINE
) -> tuple[Doubles, float, NDArray[np.bool_]]:
    """Return one light's strength times direction per channel (channel, 3), the unexplained share, and what counted.

    The brightest half begins; then all that the light reaches well counts, weighed by how well it fits.
    """
    normals, values = sphere.normals, sphere.values[n]
    bright = values.sum(axis=1)
    usable = sphere.usable[n] & chosen
    if usable.sum() < LEAST_PIXELS:
        return np.zeros((values.shape[1], 3)), 1.0, np.zeros_like(usable)
    vector: Doubles = np.zeros(3)
    lit = usable & (bright > 0.5 * np.quantile(bright[usable], 0.98))
    weight = lit.astype(np.float64)
    for _ in range(ROUNDS):
        vector = _solved(normals, bright, weight)
        length = float(np.linalg.norm(vector))
        shade = normals @ vector
        lit = usable & (shade > least_cosine * length)
        if lit.sum() < LEAST_PIXELS or length <= 0:
            return np.zeros((values.shape[1], 3)), 1.0, lit
        residual = bright - shade
        scale = 1.4826 * float(np.median(np.abs(residual[lit]))) + 1e-3 * length
        weight = np.where(lit, np.maximum(1 - (residual / (TUKEY_WIDTH * scale)) ** 2, 0) ** 2, 0.0)
    direction = vector / length
    # one direction for all channels: coloured gloss must not turn one channel against the others
    cosine = normals @ direction
    strengths = (weight * cosine) @ values / float(weight @ cosine**2)
    left = float(np.median(np.abs(residual[lit]) / shade[lit]))
    return np.outer(strengths, direction), left, lit


def _solved(normals: Doubles, values: Doubles, weight: Doubles) -> Doubles:
    weighted = normals * weight[:, None]
    vector: Doubles = np.linalg.lstsq(weighted.T @ normals, weighted.T @ values, rcond=None)[0].astype(np.float64)
    return vector
