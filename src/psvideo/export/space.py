"""The frame in which normals are delivered: camera, world or tangent space, and which way y points.

Solved normals are in the camera frame (x right, y up, z to the camera). *World* turns them by the camera's rotation.
*Tangent* is the frame of a flat card that faces the camera, as game engines take a normal map: the same three numbers
as camera space, under the name that says how to use them. ``y = "down"`` flips the green channel (DirectX).
"""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from psvideo.camera import FloatArray
from psvideo.errors import PsvideoError, UsageError
from psvideo.tomlfile import read_text

SpaceName = Literal["camera", "world", "tangent"]
YDirection = Literal["up", "down"]
ROTATION_TOLERANCE = 1e-3


@dataclass(frozen=True, kw_only=True)
class Space:
    """Where normals are expressed. ``camera_to_world`` (3, 3) is the camera's rotation, for world space only."""

    name: SpaceName = "camera"
    y: YDirection = "up"
    camera_to_world: FloatArray | None = None


CAMERA_SPACE = Space()


def choose_space(name: SpaceName, y: YDirection, camera_to_world: Path | None) -> Space:
    """Return the space that a command's options ask for. Raises UsageError where they do not fit together."""
    if name == "world" and camera_to_world is None:
        raise UsageError(
            "--space world: needs the camera's rotation. Give --camera-to-world FILE, a text file with the 3 x 3 or "
            "4 x 4 camera-to-world matrix, row by row."
        )
    if name != "world" and camera_to_world is not None:
        raise UsageError(f"--camera-to-world: belongs to --space world, and --space is {name}.")
    return Space(name=name, y=y, camera_to_world=None if camera_to_world is None else read_rotation(camera_to_world))


def read_rotation(path: Path) -> FloatArray:
    """Read a camera-to-world rotation (3, 3) from a text file of 9 or 16 numbers, row by row.

    Of a 4 x 4 matrix (column vectors, the last row 0 0 0 1) the rotation is taken; a uniform scale is divided out.
    Raises PsvideoError where the numbers are no rotation.
    """
    words = re.split(r"[\s,;\[\]()]+", read_text(path).strip(" \t\n[]()"))
    try:
        numbers = np.array([float(word) for word in words if word], np.float64)
    except ValueError:
        raise PsvideoError(f"{path}: holds words; expected the 9 or 16 numbers of a matrix, row by row.") from None
    if numbers.size not in (9, 16):
        raise PsvideoError(f"{path}: holds {numbers.size} numbers; expected 9 or 16, a matrix row by row.")
    matrix = numbers.reshape(3, 3) if numbers.size == 9 else numbers.reshape(4, 4)[:3, :3]
    scale = np.cbrt(np.linalg.det(matrix))
    if (
        not np.isfinite(scale)
        or scale < 1e-9
        or np.abs(matrix @ matrix.T / scale**2 - np.eye(3)).max() > ROTATION_TOLERANCE
    ):
        raise PsvideoError(
            f"{path}: is no rotation (determinant {np.linalg.det(matrix):.4g}). Expected the camera's axes in the "
            "world as columns: right, up, backwards, at right angles to each other and right-handed."
        )
    rotation: FloatArray = matrix / scale
    return rotation


def placed(normals: NDArray[np.floating], space: Space) -> NDArray[np.floating]:
    """Return normals (row, col, 3) of the camera frame in another space; invalid (0, 0, 0) stays so."""
    if space.camera_to_world is not None:
        turned = normals.astype(np.float32) @ space.camera_to_world.T.astype(np.float32)
        normals = turned.astype(np.float32)
    if space.y == "down":
        normals = normals * np.array([1, -1, 1], normals.dtype)
    return normals
