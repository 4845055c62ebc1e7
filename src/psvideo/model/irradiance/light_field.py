"""The light that every flash of a plan sends to points of the picture, from the rig: direction times strength.

Distant lights send the same everywhere. Near ones are taken at the rig's plane, which stands in for the surface: each
pixel's ray is followed to it, and the light falls off with the square of the distance, and with the angle from the
light's axis where the rig gives its anisotropy.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles
from psvideo.model.irradiance.ground import points_before
from psvideo.model.irradiance.intensity import measured_duration_s
from psvideo.model.irradiance.near_light import is_near, near_vectors
from psvideo.model.plan import Plan
from psvideo.model.rig import Light, Rig


@dataclass(frozen=True, kw_only=True)
class Points:
    """Points of a picture: ``down`` and ``across`` (point,) as shares of its height and width, 0 at the top left
    corner, and which of its ``channels`` each is taken in, ``channel`` (point,)."""

    down: Doubles
    across: Doubles
    channel: NDArray[np.intp]
    channels: int


def light_vectors(plan: Plan, rig: Rig, points: Points) -> Doubles:
    """Return what every lit slot's flash sends to points of the picture, shape (point, lit slot, 3).

    Near lights need the rig's camera and plane.
    """
    lights = rig.select(plan.lights)
    near = is_near(lights)
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


def points_on_plane(plan: Plan, rig: Rig, *, down: Doubles, across: Doubles) -> Doubles:
    """Return where the rays through points of the picture meet the rig's plane, in metres, shape (point, 3)."""
    if rig.focal_px is None or rig.principal_px is None or rig.plane is None:
        raise ValueError("near lights need the rig's camera and plane")
    width_px, height_px = plan.camera.width_px, plan.camera.height_px
    col, row = across * width_px - 0.5, down * height_px - 0.5
    return points_before(rig, height_px=height_px, width_px=width_px, col=col, row=row)


def _strength(light: Light, points: Points) -> Doubles:
    """Return a light's intensity in each point's channel; its mean where it was measured in other channels."""
    strengths = np.array(light.by_channel, np.float64)
    if len(strengths) == points.channels:
        chosen: Doubles = strengths[points.channel]
        return chosen
    return np.full(len(points.channel), strengths.mean())


def _field(light: Light, points_m: Doubles | None, middle_m: Doubles | None) -> Doubles:
    """Return the direction to a light times its falloff, shape (point, 3), or (3,) for a distant one."""
    if light.direction is not None:
        return np.array(light.direction, np.float64)
    if points_m is None or middle_m is None:
        raise ValueError(f"light {light.name!r} is near: it needs points in space")
    position_m = np.array(light.position_m)
    axis: Doubles | None = None
    if light.anisotropy:
        axis = np.array(light.axis) if light.axis is not None else middle_m - position_m
        axis = axis / np.linalg.norm(axis)
    return near_vectors(points_m, position_m, axis=axis, anisotropy=light.anisotropy or 0.0)
