"""Near lights: taken for distant, with directions from a plane, with integrated depth; and lights measured elsewhere.

Three lights 35 degrees off the axis at so many subject widths; the plane is where the subject's median depth is.
"""

from collections.abc import Callable, Iterator

import numpy as np

from bench.accuracy_measure import Accuracy, angles_deg, washington_sphere
from psvideo.calibrate.light_pictures import light_pictures
from psvideo.calibrate.matte import measure_matte_sphere
from psvideo.calibrate.sphere.outline import given_outline
from psvideo.calibrate.sphere.sphere_view import SphereView
from psvideo.model.irradiance.ground import ground_of
from psvideo.model.rig import Light, Rig
from psvideo.solve.depth import Shaping, View
from psvideo.solve.near_surface import NearSurface, solve_near
from psvideo.solve.normals.illumination import Illumination, illumination
from psvideo.solve.normals.least_squares import woodham1980
from psvideo.solve.normals.lit_plates import LitPlates

SIZE, WIDTH_M, FAR_M = 128, 0.4, 1.6
FOCAL_PX, MIDDLE = SIZE * FAR_M / WIDTH_M, (SIZE - 1) / 2
Depth = Callable[[np.ndarray, np.ndarray], np.ndarray]


def rows() -> Iterator[Accuracy]:
    """Give the physics page's distances for waves and for a bulging subject, and a real matte sphere."""
    for name, depth in (("waves (16° mean tilt)", _waves), ("a ball as far as 50°", _ball)):
        for widths in (2, 3, 5, 10):
            distant, plane, off, shaped = _errors_deg(depth, widths)
            bar = 0.36 if widths == 3 and depth is _waves else None
            yield Accuracy(
                f"{name}, lights at {widths} widths",
                f"{distant:.2f}°",
                "directions from the plane",
                f"{plane:.2f}°",
                "" if bar is None else f"<= {bar}°",
                None if bar is None else plane <= bar,
            )
            yield Accuracy(
                "as above, one round of integrated depth / plane 10 % too far",
                remedy="",
                after=f"{shaped:.2f}° / {off:.2f}°",
            )
    yield _matte_sphere()


def _rays(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    return np.stack([(u - MIDDLE) / FOCAL_PX, -(v - MIDDLE) / FOCAL_PX, -np.ones_like(u)], axis=-1)


def _waves(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    return FAR_M + 0.024 * WIDTH_M * np.sin(6 * np.pi * u / SIZE) * np.cos(5 * np.pi * v / SIZE)


def _ball(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    radius_m = 0.5 * WIDTH_M / np.sin(np.radians(50))
    centre = np.array([0, 0, -FAR_M - radius_m * np.cos(np.radians(50))])
    ray = _rays(u, v)
    a, b = (ray * ray).sum(axis=-1), ray @ centre
    root = b * b - a * (centre @ centre - radius_m**2)
    return np.minimum(np.where(root > 0, (b - np.sqrt(np.maximum(root, 0))) / a, np.inf), FAR_M)


def _errors_deg(depth: Depth, widths: float) -> list[float]:
    v, u = np.mgrid[:SIZE, :SIZE].astype(float)
    points = depth(u, v)[..., None] * _rays(u, v)
    across = depth(u + 1e-3, v)[..., None] * _rays(u + 1e-3, v) - points
    down = depth(u, v + 1e-3)[..., None] * _rays(u, v + 1e-3) - points
    normals = np.cross(down, across)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    mask = -points[..., 2] < FAR_M - 1e-6 if depth is _ball else np.ones((SIZE, SIZE), bool)
    middle_m = float(np.median(-points[..., 2][mask]))
    around, slant = 0.3 + np.arange(3) * 2 * np.pi / 3, np.radians(35)
    way = np.stack([np.sin(slant) * np.cos(around), np.sin(slant) * np.sin(around), np.full(3, np.cos(slant))], axis=1)
    positions = np.array([0, 0, -middle_m]) + widths * WIDTH_M * way
    strength = (widths * WIDTH_M) ** 2
    lights = [Light(name=str(n), position_m=tuple(p), intensity=(strength,)) for n, p in enumerate(positions)]
    plates = []
    for position in positions:
        away = position - points
        shade = (away * normals).sum(axis=-1) / np.linalg.norm(away, axis=-1) ** 3
        plates.append((0.43 * strength * np.maximum(shade, 0)).astype(np.float32))

    def error_deg(plane_m: float | None, iterations: int = 0) -> float:
        if plane_m is None:
            found = woodham1980.solve(
                LitPlates(plates, Illumination(directions=way, intensities=np.ones((3, 1))), mask=mask)
            )
        else:
            rig = Rig(
                lights=tuple(lights),
                focal_px=(FOCAL_PX, FOCAL_PX),
                principal_px=(MIDDLE, MIDDLE),
                plane=(0, 0, 1, plane_m),
            )
            shaping = Shaping(view=View(focal_px=rig.focal_px, principal_px=rig.principal_px), plane=rig.plane)
            ground = ground_of(rig, height_px=SIZE, width_px=SIZE)
            near = NearSurface(ground=ground, shaping=shaping, iterations=iterations)
            found = solve_near(
                near,
                lambda one: illumination(lights, channels=1, ground=one),
                lambda lit: woodham1980.solve(LitPlates(plates, lit, mask=mask)),
            )
        both = found.valid & mask
        return float(angles_deg(found.normals[both], normals[both]).mean())

    return [error_deg(None), error_deg(middle_m), error_deg(1.1 * middle_m), error_deg(middle_m, 1)]


def _matte_sphere() -> Accuracy:
    case = washington_sphere()
    pictures = light_pictures([str(n) for n in range(len(case.plates))], case.plates)
    outline = given_outline(SphereView(focal_px=None, principal_px=(255.5, 169.5)), (244.5, 144.5, 108.0))
    found = measure_matte_sphere(pictures, outline)
    off = angles_deg(np.array([light.direction for light in found]), case.lit.directions)
    said = np.mean([light.error_deg for light in found])
    strengths = np.array([light.intensity.mean() for light in found])
    return Accuracy(
        "Washington's matte sphere against the chrome one, 12 lights",
        remedy="matte-sphere",
        after=f"{off.mean():.1f}° mean, {off.max():.1f}° at most (own error {said:.1f}°); strengths within "
        f"{np.abs(strengths - 1).max():.1%}",
    )
