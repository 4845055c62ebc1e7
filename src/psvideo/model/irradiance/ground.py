"""Where the surface is taken to be under near lights, in a pinhole camera's view: at a plane, or at a known depth.

The point of a pixel is found by following its ray to the surface's depth: at first a plane's, later perhaps that of a
depth map.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.errors import PsvideoError
from psvideo.model.arrays import Doubles
from psvideo.model.rig import Rig

FARTHEST_M = 50.0
"""No light or surface is farther: beyond it numbers are read as millimetres (and a light there is a distant one)."""
FARTHEST_SHARE = 1e-3
"""A plane that runs past the horizon is followed to a thousand times its nearest depth."""


@dataclass(frozen=True, kw_only=True)
class Ground:
    """Where the surface is taken to be, in a pinhole camera's view.

    depth_m: (row, col) float32, along the camera's axis, above 0 in every pixel.
    middle_m: (3,), the point of the surface in the picture's middle; lights without an axis shine there.
    focal_px, principal_px: focal lengths (x, y) and principal point (col, row).
    unsure: the standard deviation of the depth's logarithm, on a grid of its own over the picture; None where the depth
    is taken as given.
    """

    depth_m: NDArray[np.float32]
    middle_m: Doubles
    focal_px: tuple[float, float]
    principal_px: tuple[float, float]
    unsure: NDArray[np.float32] | None = None

    def with_depth(self, depth_m: NDArray[np.floating]) -> "Ground":
        """Return the ground with another depth where ``depth_m`` (row, col) is above 0; elsewhere it stays."""
        if depth_m.shape != self.depth_m.shape:
            raise ValueError(f"depth of shape {depth_m.shape}, expected {self.depth_m.shape}")
        return replace(self, depth_m=np.where(depth_m > 0, depth_m, self.depth_m).astype(np.float32))


def rays(
    focal_px: tuple[float, float], principal_px: tuple[float, float], *, col: Doubles, row: Doubles
) -> tuple[Doubles, Doubles]:
    """Return x and y of the ray (x, y, -1) through places of the picture, of the shapes of ``col`` and ``row``."""
    return (col - principal_px[0]) / focal_px[0], -(row - principal_px[1]) / focal_px[1]


def inverse_depth(plane: tuple[float, float, float, float], x: Doubles, y: Doubles) -> Doubles:
    """Return 1 / depth in 1/m at which rays (x, y, -1) meet a plane (a, b, c, d); 0 or less: nowhere in front.

    >>> inverse_depth((0.0, 0.0, 1.0, 1.25), np.array([0.0, 0.3]), np.array([0.0, -0.2]))
    array([0.8, 0.8])
    """
    a, b, c, d = plane
    towards: Doubles = c - a * x - b * y
    return towards / d if d else np.zeros_like(towards)


def points_before(rig: Rig, *, height_px: int, width_px: int, col: Doubles, row: Doubles) -> Doubles:
    """Return where rays through places (point,) of a picture meet the rig's plane, in metres, shape (point, 3).

    Past the horizon they are as far away as ``ground_of`` takes them to be. Raises ValueError where the rig lacks the
    camera or the plane.
    """
    if rig.focal_px is None or rig.principal_px is None or rig.plane is None:
        raise ValueError("a rig with camera and plane expected")
    x, y = rays(rig.focal_px, rig.principal_px, col=col, row=row)
    corners_x, corners_y = rays(
        rig.focal_px, rig.principal_px, col=np.array([[0.0, width_px - 1.0]]), row=np.array([[0.0], [height_px - 1.0]])
    )
    nearest = inverse_depth(rig.plane, corners_x, corners_y).max()  # of all pixels: a plane's inverse depth is linear
    inverse_m = np.maximum(inverse_depth(rig.plane, x, y), FARTHEST_SHARE * nearest)
    points_m: Doubles = np.stack([x, y, -np.ones_like(x)], axis=1) / inverse_m[:, None]
    return points_m


def ground_of(rig: Rig, *, height_px: int, width_px: int, known_m: NDArray[np.floating] | None = None) -> Ground:
    """Return the ground of a picture: on the rig's plane, and at the depth ``known_m`` (row, col) where that is > 0.

    Without a plane, pixels of unknown depth take that of the nearest known one. Raises PsvideoError where the rig lacks
    the plane or the camera that near lights need, or where they make no sense.
    """
    if rig.focal_px is None or rig.principal_px is None or (rig.plane is None and known_m is None):
        raise PsvideoError(_what_is_lacking(rig, height_px=height_px, width_px=width_px, known=known_m is not None))
    depth_m: NDArray[np.floating] | None
    depth_m = None if rig.plane is None else _plane_depth_m(rig, height_px, width_px)
    if known_m is not None:
        depth_m = spread(known_m) if depth_m is None else np.where(known_m > 0, known_m, depth_m)
    if depth_m is None or depth_m.shape != (height_px, width_px):
        raise ValueError(f"known depth for a picture of {height_px} x {width_px} expected")
    x, y = every_ray(rig.focal_px, rig.principal_px, height_px, width_px)
    row, col = height_px // 2, width_px // 2
    return Ground(
        depth_m=depth_m.astype(np.float32),
        middle_m=depth_m[row, col] * np.array([x[0, col], y[row, 0], -1.0]),
        focal_px=rig.focal_px,
        principal_px=rig.principal_px,
    )


def spread(known_m: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return depth (row, col) of which pixels that are unknown (0 or less) have that of the nearest known pixel."""
    unknown = (known_m <= 0).astype(np.uint8)
    _, labels = cv2.distanceTransformWithLabels(unknown, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    depth_of_label = np.zeros(int(labels.max()) + 1, known_m.dtype)
    depth_of_label[labels[known_m > 0]] = known_m[known_m > 0]
    everywhere: NDArray[np.floating] = depth_of_label[labels]
    return everywhere


def _plane_depth_m(rig: Rig, height_px: int, width_px: int) -> Doubles:
    """Return the depth of the rig's plane in every pixel."""
    if rig.focal_px is None or rig.principal_px is None or rig.plane is None:
        raise ValueError("a rig with camera and plane expected")
    x, y = every_ray(rig.focal_px, rig.principal_px, height_px, width_px)
    inverse_m = inverse_depth(rig.plane, x, y)
    row, col = height_px // 2, width_px // 2
    if inverse_m[row, col] <= 0:
        raise PsvideoError(
            f"The rig's [surface] plane {list(rig.plane)} lies nowhere before the camera in the picture's middle. "
            "Expected a, b, c, d of a x + b y + c z + d = 0 in metres with the scene at negative z: [0, 0, 1, 1.2] is "
            "a wall at 1.2 m."
        )
    depth_m: Doubles = 1 / np.maximum(inverse_m, FARTHEST_SHARE * inverse_m.max())
    if depth_m[row, col] > FARTHEST_M:
        raise PsvideoError(
            f"The rig's [surface] plane {list(rig.plane)} is {depth_m[row, col]:g} m away in the picture's middle, "
            "which looks like millimetres. Expected metres: divide d, and every position_m, by 1000."
        )
    return depth_m


def every_ray(
    focal_px: tuple[float, float], principal_px: tuple[float, float], height_px: int, width_px: int
) -> tuple[Doubles, Doubles]:
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
