"""The light that every flash of a plan sends to points of the picture, from the rig: direction times strength.

Distant lights send the same everywhere. Near ones are taken at the rig's plane, which stands in for the surface: each
pixel's ray is followed to it, and the light falls off with the square of the distance, and with the angle from the
light's axis where the rig gives its anisotropy.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.model.camera import FloatArray
from psvideo.model.intensity import measured_duration_s
from psvideo.model.plan import Plan
from psvideo.model.rig import Light, Rig

LEAST_COSINE = 1e-3
"""Nothing is behind an LED; what is there keeps a little light, and so no division by 0."""


@dataclass(frozen=True, kw_only=True)
class Points:
    """Points of a picture: ``down`` and ``across`` (point,) as shares of its height and width, 0 at the top left
    corner, and which of its ``channels`` each is taken in, ``channel`` (point,)."""

    down: FloatArray
    across: FloatArray
    channel: NDArray[np.intp]
    channels: int


def light_vectors(plan: Plan, rig: Rig, points: Points) -> FloatArray:
    """Return what every lit slot's flash sends to points of the picture, shape (point, lit slot, 3).

    Near lights need the rig's camera and plane.
    """
    lights = rig.select(plan.lights)
    near = any(light.position_m is not None for light in lights)
    points_m = points_on_plane(plan, rig, down=points.down, across=points.across) if near else None
    middle_m = points_on_plane(plan, rig, down=np.array([0.5]), across=np.array([0.5]))[0] if near else None
    of_light = {}
    for light in lights:
        per_s = _strength(light, points) / measured_duration_s(light, plan)
        of_light[light.name] = per_s[:, None] * _field(light, points_m, middle_m)
    slots = []
    for slot in plan.lit_slots:
        flash = plan.flashes[slot]
        parts = [flash.lights[name] * flash.duration_s * of_light[name] for name in flash.lit]
        slots.append(np.sum(parts, axis=0))
    return np.stack(slots, axis=1)


def points_on_plane(plan: Plan, rig: Rig, *, down: FloatArray, across: FloatArray) -> FloatArray:
    """Return where the rays through points of the picture meet the rig's plane, in metres, shape (point, 3)."""
    if rig.focal_px is None or rig.principal_px is None or rig.plane is None:
        raise ValueError("near lights need the rig's camera and plane")
    col = across * plan.camera.width_px - 0.5
    row = down * plan.camera.height_px - 0.5
    x, y = rays(rig.focal_px, rig.principal_px, col=col, row=row)
    points: FloatArray = np.stack([x, y, -np.ones_like(x)], axis=1) / inverse_depth(rig.plane, x, y)[:, None]
    return points


def rays(
    focal_px: tuple[float, float], principal_px: tuple[float, float], *, col: FloatArray, row: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return x and y of the ray (x, y, -1) through places of the picture, of the shapes of ``col`` and ``row``."""
    return (col - principal_px[0]) / focal_px[0], -(row - principal_px[1]) / focal_px[1]


def inverse_depth(plane: tuple[float, float, float, float], x: FloatArray, y: FloatArray) -> FloatArray:
    """Return 1 / depth in 1/m at which rays (x, y, -1) meet a plane (a, b, c, d); 0 or less: nowhere in front.

    >>> inverse_depth((0.0, 0.0, 1.0, 1.25), np.array([0.0, 0.3]), np.array([0.0, -0.2]))
    array([0.8, 0.8])
    """
    a, b, c, d = plane
    towards: FloatArray = c - a * x - b * y
    return towards / d if d else np.zeros_like(towards)


def _strength(light: Light, points: Points) -> FloatArray:
    """Return a light's intensity in each point's channel; its mean where it was measured in other channels."""
    strengths = np.array(light.intensity, np.float64)
    if len(strengths) == points.channels:
        chosen: FloatArray = strengths[points.channel]
        return chosen
    return np.full(len(points.channel), strengths.mean())


def _field(light: Light, points_m: FloatArray | None, middle_m: FloatArray | None) -> FloatArray:
    """Return the direction to a light times its falloff, shape (point, 3), or (3,) for a distant one."""
    if light.direction is not None:
        return np.array(light.direction, np.float64)
    if points_m is None or middle_m is None:
        raise ValueError(f"light {light.name!r} is near: it needs points in space")
    position_m = np.array(light.position_m)
    axis: FloatArray | None = None
    if light.anisotropy:
        axis = np.array(light.axis) if light.axis is not None else middle_m - position_m
        axis = axis / np.linalg.norm(axis)
    return near_vectors(points_m, position_m, axis=axis, anisotropy=light.anisotropy or 0.0)


def near_vectors(
    points_m: FloatArray, position_m: FloatArray, *, axis: FloatArray | None, anisotropy: float
) -> FloatArray:
    """Return what a near light of intensity 1 sends to points (..., 3): direction times irradiance, (..., 3).

    That is ``cos^mu / r^2`` along the unit vector to the light; cos is taken from the light's axis, a unit vector
    (Y. Queau et al., "LED-based photometric stereo", Journal of Mathematical Imaging and Vision 60, 2018, section 2).
    """
    away_m = position_m - points_m
    distance_m = np.linalg.norm(away_m, axis=-1, keepdims=True)
    towards = away_m / distance_m
    sent = distance_m**-2
    if axis is not None and anisotropy:
        sent = sent * np.maximum(-(towards @ axis), LEAST_COSINE)[..., None] ** anisotropy
    vectors: FloatArray = towards * sent
    return vectors
