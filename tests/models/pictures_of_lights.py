"""Pictures of matte spheres and cards under lights of known directions and strengths, for calibration."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from psvideo.calibrate.light_pictures import LightPictures, light_pictures
from psvideo.calibrate.matte import sphere_normals
from psvideo.calibrate.sphere.outline import given_outline
from psvideo.calibrate.sphere.sphere_view import SphereView

Array = NDArray[np.float64]
HIGH, WIDE = 150, 200
CIRCLE = (95.3, 71.8, 60.0)


def ways(count: int, *, seed: int = 0) -> Array:
    """Directions spread over 50 degrees about the camera's axis, not on a ring."""
    rng = np.random.default_rng(seed)
    slant = np.radians(rng.uniform(8, 50, count))
    around = np.arange(count) * 2.4 + rng.uniform(0, 0.5, count)
    return np.stack([np.sin(slant) * np.cos(around), np.sin(slant) * np.sin(around), np.cos(slant)], axis=1)


def sphere_pictures(
    directions: Array, strengths: Array, *, view: SphereView = SphereView(focal_px=None, principal_px=(99.5, 74.5)),
    noise: float = 0.002, gloss: float = 0.0, radii: float = np.inf, room: float = 0.0,
) -> LightPictures:  # fmt: skip
    """A matte sphere, perhaps with a highlight, in the circle's outline; ``strengths`` (light, channel) at its middle,
    from which lamps stand ``radii`` of it away. ``room``: light that comes from above as well."""
    place = given_outline(view, CIRCLE).place
    points = np.stack(np.meshgrid(np.arange(WIDE), np.arange(HIGH)), axis=-1).reshape(-1, 2).astype(float)
    normals, facing = sphere_normals(view, place, points)
    ways_to = directions - normals[:, None, :] / radii
    falloff = np.linalg.norm(ways_to, axis=2) ** -3
    shade = np.maximum((normals[:, None, :] * ways_to).sum(axis=2) * falloff, 0) * (facing > 0)[:, None]
    shade += room * ((1 + normals[:, 1]) / 2 * (facing > 0))[:, None]
    half = directions + np.array([0.0, 0.0, 1.0])
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    spot = gloss * np.maximum(normals @ half.T, 0) ** 200 * (facing > 0)[:, None]
    images = (0.6 * shade.T[..., None] * strengths[:, None, :] + spot.T[..., None]).reshape(-1, HIGH, WIDE, 3)
    images = images + np.random.default_rng(1).normal(0, noise, images.shape)
    names = [f"L{n}" for n in range(len(directions))]
    return light_pictures(names, list(np.clip(images, 0, 1).astype(np.float32)))


def washington(folder: Path, into: Path) -> tuple[Path, Array]:
    into.mkdir()
    for n in range(12):
        (into / f"gray.{n}.png").symlink_to((folder / "uw_psm" / "gray" / f"gray.{n}.png").resolve())
    words = (folder / "uw_psm" / "lights.txt").read_text().split()
    true = np.array(words[1:], float).reshape(-1, 3)
    return into, true / np.linalg.norm(true, axis=1, keepdims=True)
