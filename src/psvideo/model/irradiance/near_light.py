"""Near lights: where they stand, and what they send to a surface whose place is known (``ground.py``).

A near light's direction and strength differ from pixel to pixel: it sends ``intensity * max(0, cos)^mu / r^2`` to a
point at the distance r, cos being taken from the light's axis (Y. Queau et al., "LED-based photometric stereo:
modeling, calibration and numerical solution", JMIV 60, 2018, section 2). The compiled solvers compute each pixel's
light block by block (``psvideo.solve.normals.loops.near_kernel``), so that no field of vectors is ever held.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.errors import PsvideoError
from psvideo.model.arrays import Doubles
from psvideo.model.irradiance.ground import FARTHEST_M, Ground, every_ray
from psvideo.model.rig import Light

LEAST_COSINE = 1e-3
"""Nothing is behind an LED; what is there keeps a little light, and so no division by 0."""
LEAST_DISTANCE_M = 0.01


@dataclass(frozen=True, kw_only=True)
class NearField:
    """Lights of which at least one is near, over a ground.

    positions_m: (light, 3); of a distant light its direction. is_near: (light,).
    axes: (light, 3), unit vectors the way the lights shine; anisotropy: (light,), mu, 0 where all ways are alike.
    middle_gain: (light,), irradiance at the ground's middle over that at 1 m, 1 for a distant light.
    """

    positions_m: Doubles
    is_near: NDArray[np.bool_]
    axes: Doubles
    anisotropy: Doubles
    middle_gain: Doubles
    ground: Ground


def is_near(lights: Sequence[Light]) -> bool:
    """Return whether any of the lights is near."""
    return any(light.position_m is not None for light in lights)


def near_field(lights: Sequence[Light], ground: Ground) -> NearField:
    """Return near lights, distant ones among them, over a ground.

    Raises PsvideoError where a position cannot be meant: in millimetres, in the surface, or behind it.
    """
    positions_m = np.array([light.position_m or light.direction for light in lights], np.float64)
    near = np.array([light.position_m is not None for light in lights])
    for light in lights:
        if light.position_m is not None:
            _check_position(light, np.array(light.position_m), ground)
    away_m = ground.middle_m - positions_m
    distance_m = np.linalg.norm(away_m, axis=1)
    to_middle = away_m / distance_m[:, None]
    axes = np.array([axis if light.axis is None else light.axis for light, axis in zip(lights, to_middle, strict=True)])
    mu = np.array([light.anisotropy or 0.0 for light in lights])
    cosine = np.maximum((axes * to_middle).sum(axis=1), LEAST_COSINE)
    return NearField(
        positions_m=positions_m,
        is_near=near,
        axes=axes,
        anisotropy=mu,
        middle_gain=np.where(near, cosine**mu / distance_m**2, 1.0),
        ground=ground,
    )


def middle_directions(field: NearField) -> Doubles:
    """Return the unit directions to the lights from the ground's middle, shape (light, 3)."""
    away_m = np.where(field.is_near[:, None], field.positions_m - field.ground.middle_m, field.positions_m)
    directions: Doubles = away_m / np.linalg.norm(away_m, axis=1, keepdims=True)
    return directions


def _check_position(light: Light, position_m: Doubles, ground: Ground) -> None:
    said = f"Light {light.name!r} has position_m = {[float(f'{value:g}') for value in position_m]}"
    if np.abs(position_m).max() > FARTHEST_M:
        raise PsvideoError(
            f"{said}, which is more than {FARTHEST_M:g} m from the camera and looks like millimetres. Expected metres: "
            "divide by 1000 (and the [surface] plane's last number with it). A light that really is so far is distant: "
            "give it a direction instead."
        )
    if np.linalg.norm(position_m - ground.middle_m) < LEAST_DISTANCE_M:
        raise PsvideoError(
            f"{said}, which is in the surface itself ({[float(f'{value:.3g}') for value in ground.middle_m]} in the "
            "picture's middle). Expected metres in camera coordinates, origin at the lens, the scene at negative z."
        )
    ray = -ground.middle_m / np.linalg.norm(ground.middle_m)
    if (position_m - ground.middle_m) @ ray <= 0 and position_m[2] < ground.middle_m[2]:
        raise PsvideoError(
            f"{said}, which is behind the surface (z = {ground.middle_m[2]:.3g} m in the picture's middle). Expected "
            "metres in camera coordinates: x right, y up, z towards the camera, the scene at negative z. Check the "
            "sign of z, and the [surface] plane."
        )


def field_of(light: Light, ground: Ground | None, part: tuple[slice, slice]) -> Doubles:
    """Return what a light of intensity 1 sends to a part of the picture: direction times irradiance, (row, col, 3).

    Of a distant light one vector, (1, 1, 3). Made for calibration; the solvers place lights by themselves. Raises
    PsvideoError where the light is near and there is no ground.
    """
    if light.direction is not None:
        return np.array(light.direction, np.float64)[None, None]
    if ground is None or light.position_m is None:
        raise PsvideoError(
            f"Light {light.name!r} is near, and the rig does not say where the surface is: add [camera] focal_px and "
            "principal_px, and [surface] plane."
        )
    x, y = every_ray(ground.focal_px, ground.principal_px, *ground.depth_m.shape)
    depth_m = ground.depth_m[part].astype(np.float64)
    points_m = np.stack([x[:, part[1]] * depth_m, y[part[0]] * depth_m, -depth_m], axis=-1)
    axis = near_field([light], ground).axes[0] if light.anisotropy else None
    return near_vectors(points_m, np.array(light.position_m), axis=axis, anisotropy=light.anisotropy or 0.0)


def near_vectors(points_m: Doubles, position_m: Doubles, *, axis: Doubles | None, anisotropy: float) -> Doubles:
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
    vectors: Doubles = towards * sent
    return vectors
