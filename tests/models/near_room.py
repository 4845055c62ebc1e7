"""Surfaces that near lights stand around, what such a rig films of them, and how far normals are off."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import OpenEXR
from numpy.typing import NDArray

from psvideo.model.irradiance.ground import ground_of
from psvideo.model.rig import Light, Rig
from psvideo.model.surface import Surface
from psvideo.solve.normals.illumination import Illumination, illumination

Array = NDArray[np.float64]
SIZE, WIDTH_M, FAR_M = 96, 0.4, 1.6
FOCAL_PX, MIDDLE = SIZE * FAR_M / WIDTH_M, (SIZE - 1) / 2


def rays(u: Array, v: Array) -> Array:
    return np.stack([(u - MIDDLE) / FOCAL_PX, -(v - MIDDLE) / FOCAL_PX, -np.ones_like(u)], axis=-1)


def relief(u: Array, v: Array) -> Array:
    """Depth of waves that tilt by 16 degrees in the mean."""
    return FAR_M + 0.024 * WIDTH_M * np.sin(6 * np.pi * u / SIZE) * np.cos(5 * np.pi * v / SIZE)


def surface(depth: Callable[[Array, Array], Array]) -> tuple[Array, Array]:
    """Points and normals of every pixel, by fine differences."""
    v, u = np.mgrid[:SIZE, :SIZE].astype(float)

    def at(u: Array, v: Array) -> Array:
        return depth(u, v)[..., None] * rays(u, v)

    step = 1e-3
    normals = np.cross(at(u, v + step) - at(u, v - step), at(u + step, v) - at(u - step, v))
    return at(u, v), normals / np.linalg.norm(normals, axis=-1, keepdims=True)


def ring_rig(lights: int, widths: float, *, distance_m: float = FAR_M, plane_m: float | None = None) -> Rig:
    """Lights 35 degrees off the axis, so many subject widths from the point ``distance_m`` before the lens."""
    around, slant = 0.3 + np.arange(lights) * 2 * np.pi / lights, np.radians(35)
    way = np.stack([np.sin(slant) * np.cos(around), np.sin(slant) * np.sin(around), np.full(lights, np.cos(slant))], 1)
    positions = np.array([0, 0, -distance_m]) + widths * WIDTH_M * way
    strength = ((widths * WIDTH_M) ** 2,)
    return Rig(
        lights=tuple(Light(name=f"L{n}", position_m=tuple(p), intensity=strength) for n, p in enumerate(positions)),
        focal_px=(FOCAL_PX, FOCAL_PX),
        principal_px=(MIDDLE, MIDDLE),
        plane=(0.0, 0.0, 1.0, plane_m or distance_m),
    )


def filmed(rig: Rig, points: Array, normals: Array, albedo: float = 0.43) -> list[NDArray[np.float32]]:
    """A plate per light by the law of an LED: cos^mu about its axis, and the inverse square."""
    plates = []
    for light in rig.lights:
        if light.direction is not None:
            way, sent = np.array(light.direction), 1.0
        else:
            away = np.array(light.position_m) - points
            distance = np.linalg.norm(away, axis=-1, keepdims=True)
            way, sent = away / distance, 1 / distance[..., 0] ** 2
            if light.axis is not None:
                sent = sent * np.maximum(-(way @ np.array(light.axis)), 0) ** light.anisotropy
        shade = np.maximum((way * normals).sum(axis=-1), 0) * sent
        strengths = np.array(light.intensity)
        picture = albedo * shade[..., None] * strengths
        plates.append((picture[..., 0] if len(strengths) == 1 else picture).astype(np.float32))
    return plates


def lit_by(rig: Rig, channels: int = 1) -> Illumination:
    return illumination(rig.lights, channels=channels, ground=ground_of(rig, height_px=SIZE, width_px=SIZE))


def mean_error_deg(found: Surface, normals: Array, where: NDArray[np.bool_] | None = None) -> float:
    both = found.valid if where is None else found.valid & where
    assert both.mean() > 0.5
    apart = np.linalg.norm(found.normals[both] - normals[both], axis=-1)
    return float(np.degrees(2 * np.arcsin(apart / 2)).mean())


def picture(path: Path) -> NDArray[np.float32]:
    channels = OpenEXR.File(str(path)).channels()
    planes = channels["RGB"].pixels if "RGB" in channels else next(iter(channels.values())).pixels
    values: NDArray[np.float32] = planes.astype(np.float32)
    return values
