"""Near lights: where they stand, where the surface is taken to be, and what that gives in the surface's middle.

A near light's direction and strength differ from pixel to pixel: it sends ``intensity * max(0, cos)^mu / r^2`` to a
point at the distance r, cos being taken from the light's axis (Y. Queau et al., "LED-based photometric stereo:
modeling, calibration and numerical solution", JMIV 60, 2018, section 2). The point of a pixel is found by following
its ray to the surface's depth: at first a plane's, later perhaps a depth map's. What holds for a pixel is worked out by
the compiled solvers, block by block (``near_kernel.py``), so that no field of vectors is ever held.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.errors import PsvideoError
from psvideo.model.camera import FloatArray
from psvideo.model.light_field import LEAST_COSINE, inverse_depth, near_vectors, rays
from psvideo.model.rig import Light, Rig

FARTHEST_M = 50.0
"""No light or surface is farther: beyond it numbers are taken for millimetres (and a light there is a distant one)."""
FARTHEST_SHARE = 1e-3
"""A plane that runs past the horizon is followed to a thousand times its nearest depth."""
LEAST_DISTANCE_M = 0.01


@dataclass(frozen=True, kw_only=True)
class Ground:
    """Where the surface is taken to be, in a pinhole camera's view.

    depth_m: (row, col) float32, along the camera's axis, above 0 in every pixel.
    middle_m: (3,), the point of the surface in the picture's middle; lights without an axis shine there.
    focal_px, principal_px: focal lengths (x, y) and principal point (col, row).
    """

    depth_m: NDArray[np.float32]
    middle_m: FloatArray
    focal_px: tuple[float, float]
    principal_px: tuple[float, float]

    def with_depth(self, depth_m: NDArray[np.floating]) -> "Ground":
        """Return the ground with another depth where ``depth_m`` (row, col) is above 0; elsewhere it stays."""
        if depth_m.shape != self.depth_m.shape:
            raise ValueError(f"depth of shape {depth_m.shape}, expected {self.depth_m.shape}")
        return replace(self, depth_m=np.where(depth_m > 0, depth_m, self.depth_m).astype(np.float32))


@dataclass(frozen=True, kw_only=True)
class NearField:
    """Lights of which at least one is near, over a ground.

    positions_m: (light, 3); of a distant light its direction. is_near: (light,).
    axes: (light, 3), unit vectors the way the lights shine; anisotropy: (light,), mu, 0 where all ways are alike.
    middle_gain: (light,), irradiance at the ground's middle over that at 1 m, 1 for a distant light.
    """

    positions_m: FloatArray
    is_near: NDArray[np.bool_]
    axes: FloatArray
    anisotropy: FloatArray
    middle_gain: FloatArray
    ground: Ground


def is_near(lights: Sequence[Light]) -> bool:
    """Return whether any of the lights is near."""
    return any(light.position_m is not None for light in lights)


def ground_of(rig: Rig, *, height_px: int, width_px: int, known_m: NDArray[np.floating] | None = None) -> Ground:
    """Return the ground for a picture of that size: on the rig's plane, and at the depth ``known_m`` where that is > 0.

    Without a plane, pixels of unknown depth take that of the nearest known one. Raises PsvideoError where the rig lacks
    the plane or the camera that near lights need, or where they make no sense.
    """
    if rig.focal_px is None or rig.principal_px is None or (rig.plane is None and known_m is None):
        raise PsvideoError(_what_is_lacking(rig, height_px=height_px, width_px=width_px, known=known_m is not None))
    depth_m: NDArray[np.floating] | None
    depth_m = None if rig.plane is None else _plane_depth_m(rig, height_px, width_px)
    if known_m is not None:
        depth_m = _spread(known_m) if depth_m is None else np.where(known_m > 0, known_m, depth_m)
    if depth_m is None or depth_m.shape != (height_px, width_px):
        raise ValueError(f"known depth for a picture of {height_px} x {width_px} expected")
    x, y = _rays(rig.focal_px, rig.principal_px, height_px, width_px)
    row, col = height_px // 2, width_px // 2
    return Ground(
        depth_m=depth_m.astype(np.float32),
        middle_m=depth_m[row, col] * np.array([x[0, col], y[row, 0], -1.0]),
        focal_px=rig.focal_px,
        principal_px=rig.principal_px,
    )


def _spread(known_m: NDArray[np.floating]) -> NDArray[np.floating]:
    """Give pixels of unknown depth that of the nearest known pixel."""
    unknown = (known_m <= 0).astype(np.uint8)
    _, labels = cv2.distanceTransformWithLabels(unknown, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    depth_of_label = np.zeros(int(labels.max()) + 1, known_m.dtype)
    depth_of_label[labels[known_m > 0]] = known_m[known_m > 0]
    spread: NDArray[np.floating] = depth_of_label[labels]
    return spread


def _plane_depth_m(rig: Rig, height_px: int, width_px: int) -> FloatArray:
    """Return the depth of the rig's plane in every pixel."""
    if rig.focal_px is None or rig.principal_px is None or rig.plane is None:
        raise ValueError("a rig with camera and plane expected")
    x, y = _rays(rig.focal_px, rig.principal_px, height_px, width_px)
    inverse_m = inverse_depth(rig.plane, x, y)
    row, col = height_px // 2, width_px // 2
    if inverse_m[row, col] <= 0:
        raise PsvideoError(
            f"The rig's [surface] plane {list(rig.plane)} lies nowhere before the camera in the picture's middle. "
            "Expected a, b, c, d of a x + b y + c z + d = 0 in metres with the scene at negative z: [0, 0, 1, 1.2] is "
            "a wall at 1.2 m."
        )
    depth_m: FloatArray = 1 / np.maximum(inverse_m, FARTHEST_SHARE * inverse_m.max())
    if depth_m[row, col] > FARTHEST_M:
        raise PsvideoError(
            f"The rig's [surface] plane {list(rig.plane)} is {depth_m[row, col]:g} m away in the picture's middle, "
            "which looks like millimetres. Expected metres: divide d, and every position_m, by 1000."
        )
    return depth_m


def _rays(
    focal_px: tuple[float, float], principal_px: tuple[float, float], height_px: int, width_px: int
) -> tuple[FloatArray, FloatArray]:
    """Return x (1, col) and y (row, 1) of the ray (x, y, -1) through every pixel's centre."""
    cols, rows = np.arange(width_px, dtype=np.float64), np.arange(height_px, dtype=np.float64)
    return rays(focal_px, principal_px, col=cols[None, :], row=rows[:, None])


def _what_is_lacking(rig: Rig, *, height_px: int, width_px: int, known: bool) -> str:
    near = [light.name for light in rig.lights if light.position_m is not None]
    lacking = []
    if rig.focal_px is None:
        lacking.append("[camera] focal_px = [f, f] (the focal length in mm times pixels per mm of the sensor)")
    if rig.principal_px is None:
        middle = f"[{(width_px - 1) / 2:g}, {(height_px - 1) / 2:g}]"
        lacking.append(f"[camera] principal_px = {middle} (the picture's middle, unless the lens was calibrated)")
    if rig.plane is None and not known:
        lacking.append("[surface] plane = [0.0, 0.0, 1.0, 1.2] (a wall facing the camera 1.2 m away: where yours is)")
    return (
        f"Light {near[0]!r} is near (position_m), so every pixel sees it from another direction, and the rig does not "
        f"say where the surface is. Add to the rig file: {'; '.join(lacking)}. Or give the light a direction, the unit "
        "vector from the middle of the surface to it, where it is ten times as far away as the subject is wide."
    )


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


def middle_directions(field: NearField) -> FloatArray:
    """Return the unit directions to the lights from the ground's middle, shape (light, 3)."""
    away_m = np.where(field.is_near[:, None], field.positions_m - field.ground.middle_m, field.positions_m)
    directions: FloatArray = away_m / np.linalg.norm(away_m, axis=1, keepdims=True)
    return directions


def _check_position(light: Light, position_m: FloatArray, ground: Ground) -> None:
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


def field_of(light: Light, ground: Ground | None, part: tuple[slice, slice]) -> FloatArray:
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
    x, y = _rays(ground.focal_px, ground.principal_px, *ground.depth_m.shape)
    depth_m = ground.depth_m[part].astype(np.float64)
    points_m = np.stack([x[:, part[1]] * depth_m, y[part[0]] * depth_m, -depth_m], axis=-1)
    axis = near_field([light], ground).axes[0] if light.anisotropy else None
    return near_vectors(points_m, np.array(light.position_m), axis=axis, anisotropy=light.anisotropy or 0.0)
