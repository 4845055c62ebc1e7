"""The frame in which normals are delivered: camera, world or tangent space, and which way y points.

Solved normals are in the camera frame (x right, y up, z to the camera). *World* turns them by the camera's rotation,
and moves positions to where the camera stands, in the world's own unit. *Tangent* is the frame of a flat card that
faces the camera, as game engines take a normal map: the same three numbers as camera space, under the name that says
how to use them. ``y = "down"`` flips the green channel (DirectX).
"""

from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from psvideo.errors import UsageError
from psvideo.export.usd.pose import Pose, read_pose
from psvideo.export.usd.usd_camera import USD_SUFFIXES, UpAxis, UsdCamera, open_usd_camera
from psvideo.model.arrays import Doubles
from psvideo.model.choices import CameraTime, SpaceName, YDirection


@dataclass(frozen=True, kw_only=True)
class Moving:
    """A camera that moves: one time code per frame of the clip from the animation's first on, the numbers of the
    results as time codes, or seconds at the stage's rate."""

    camera: UsdCamera
    by: CameraTime = "frames"

    def pose(self, time_s: float, number: int, camera_fps: Fraction) -> Pose:
        """Return where the camera stands at an instant of the clip."""
        first = self.camera.codes[0] if self.camera.codes else 0.0
        rate = float(camera_fps) if self.by == "frames" else self.camera.codes_per_s
        return self.camera.pose(float(number) if self.by == "numbers" else first + time_s * rate)


@dataclass(frozen=True, kw_only=True)
class Space:
    """Where normals are expressed.

    For world space: ``camera_to_world`` (3, 3) is the camera's rotation and ``origin`` (3,) its place in units of
    ``unit_m`` metres; ``up`` is the world's axis that points up, ``lens`` the focal length over the picture's width
    where the camera's file says it. ``moving`` gives rotation and place for every instant.
    """

    name: SpaceName = "camera"
    y: YDirection = "up"
    camera_to_world: Doubles | None = None
    origin: Doubles | None = None
    unit_m: float = 1.0
    up: UpAxis = "y"
    lens: float | None = None
    moving: Moving | None = None

    def at(self, time_s: float, number: int, camera_fps: Fraction) -> "Space":
        """Return the space of one instant, with the camera where it is then."""
        if self.moving is None:
            return self
        pose = self.moving.pose(time_s, number, camera_fps)
        return replace(self, camera_to_world=pose.rotation, origin=pose.origin)

    @property
    def matrix(self) -> Doubles:
        """The camera-to-world matrix (4, 4), place in the last column; of camera space, the unit matrix."""
        turn = np.eye(3) if self.camera_to_world is None else self.camera_to_world
        origin = np.zeros(3) if self.origin is None else self.origin
        return np.vstack([np.column_stack([turn, origin]), [0, 0, 0, 1]])

    def attributes(self) -> dict[str, str | float]:
        """Return what a file's header says of the world: its unit, its up axis, and the camera-to-world matrix."""
        if self.camera_to_world is None:
            return {}
        return {
            "psvideo:meters_per_unit": float(self.unit_m),
            "psvideo:up": self.up,
            "psvideo:camera_to_world": " ".join(f"{number:.9g}" for number in self.matrix.ravel()),
        }


CAMERA_SPACE = Space()


def choose_space(
    name: SpaceName,
    y: YDirection,
    camera_to_world: Path | None,
    *,
    camera: str | None = None,
    camera_time: CameraTime | None = None,
) -> Space:
    """Return the space that a command's options ask for. Raises UsageError where they do not fit together."""
    is_usd = camera_to_world is not None and camera_to_world.suffix.lower() in USD_SUFFIXES
    if name == "world" and camera_to_world is None:
        raise UsageError(
            '`space="world"`: needs the camera\'s rotation. Give `camera_to_world`: a USD file with the camera, or a '
            "text file with the 3 x 3 or 4 x 4 camera-to-world matrix, row by row."
        )
    for name_given, value in {
        "camera_to_world": camera_to_world,
        "camera": camera,
        "camera_time": camera_time,
    }.items():
        if name != "world" and value is not None:
            raise UsageError(f'`{name_given}`: belongs to `space="world"`, and `space` is {name}.')
        if name_given != "camera_to_world" and value is not None and not is_usd:
            raise UsageError(
                f"`{name_given}`: belongs to a USD camera, and {camera_to_world} is a text file. Leave it out."
            )
    if camera_to_world is None:
        return Space(name=name, y=y)
    if not is_usd:
        pose = read_pose(camera_to_world)
        return Space(name=name, y=y, camera_to_world=pose.rotation, origin=pose.origin)
    found = open_usd_camera(camera_to_world, camera)
    place = Space(name=name, y=y, unit_m=found.unit_m, up=found.up, lens=found.lens)
    if found.codes is None:
        pose = found.pose(0.0)
        return replace(place, camera_to_world=pose.rotation, origin=pose.origin)
    return replace(place, moving=Moving(camera=found, by=camera_time or "frames"))


def placed(normals: NDArray[np.floating], space: Space) -> NDArray[np.floating]:
    """Return normals (..., 3) of the camera frame in another space; invalid (0, 0, 0) stays so."""
    if space.camera_to_world is not None:
        turned = normals.astype(np.float32) @ space.camera_to_world.T.astype(np.float32)
        normals = turned.astype(np.float32)
    return _flipped(normals, space)


def placed_points(points: NDArray[np.floating], space: Space, valid: NDArray[np.bool_]) -> NDArray[np.floating]:
    """Return points (..., 3) of the camera frame, in metres, in another space; those that are not valid are 0.

    World space is in the world's own unit.
    """
    if space.camera_to_world is None:
        return _flipped(points, space)
    origin = np.zeros(3) if space.origin is None else space.origin
    moved = points.astype(np.float64) / space.unit_m @ space.camera_to_world.T + origin
    moved[~valid] = 0
    return _flipped(moved.astype(np.float32), space)


def _flipped(vectors: NDArray[np.floating], space: Space) -> NDArray[np.floating]:
    return vectors * np.array([1, -1, 1], vectors.dtype) if space.y == "down" else vectors
