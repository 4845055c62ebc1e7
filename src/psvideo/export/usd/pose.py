"""Where a camera stands and how it is turned: its rotation and its place in the world, from a matrix in a text file."""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from psvideo.errors import PsvideoError
from psvideo.formats.contract import read_text
from psvideo.model.arrays import Doubles

ROTATION_TOLERANCE = 1e-3
LAST_ROW = (0.0, 0.0, 0.0, 1.0)


@dataclass(frozen=True, kw_only=True)
class Pose:
    """A camera in the world: ``rotation`` (3, 3), its right, up and backwards as columns, and ``origin`` (3,)."""

    rotation: Doubles
    origin: Doubles


def read_pose(path: Path) -> Pose:
    """Read a camera-to-world transform from a text file of 9 or 16 numbers, row by row.

    A 3 x 3 matrix is a rotation at the world's origin; a 4 x 4 matrix holds the place in its last column. Raises
    PsvideoError where the numbers are no such matrix.
    """
    words = re.split(r"[\s,;\[\]()]+", read_text(path).strip(" \t\n[]()"))
    try:
        numbers = np.array([float(word) for word in words if word], np.float64)
    except ValueError:
        raise PsvideoError(
            f"{path}: holds text that is not numbers; expected the 9 or 16 numbers of a matrix, row by row."
        ) from None
    if numbers.size not in (9, 16):
        raise PsvideoError(f"{path}: holds {numbers.size} numbers; expected 9 or 16, a matrix row by row.")
    matrix = np.eye(4)
    size = 3 if numbers.size == 9 else 4
    matrix[:size, :size] = numbers.reshape(size, size)
    return pose_of(matrix, source=str(path))


def pose_of(matrix: Doubles, *, source: str) -> Pose:
    """Return the pose in a camera-to-world matrix (4, 4) for column vectors; a uniform scale is divided out.

    ``source`` is what messages call it. Raises PsvideoError where the matrix is no rotation with a place.
    """
    if not np.allclose(matrix[3], LAST_ROW, atol=1e-9):
        turned = np.allclose(matrix[:, 3], LAST_ROW, atol=1e-9)
        raise PsvideoError(
            f"{source}: the matrix's last row is {' '.join(f'{number:g}' for number in matrix[3])}; expected "
            "0 0 0 1, with the camera's place in the last column. "
            + ("It is written for row vectors, as Maya, Houdini and USD do: transpose it." if turned else "")
        )
    turn = matrix[:3, :3]
    scale = np.cbrt(np.linalg.det(turn))
    if (
        not np.isfinite(scale)
        or scale < 1e-9
        or np.abs(turn @ turn.T / scale**2 - np.eye(3)).max() > ROTATION_TOLERANCE
    ):
        raise PsvideoError(
            f"{source}: is not a rotation (determinant {np.linalg.det(turn):.4g}). Expected the camera's axes in the "
            "world as columns: right, up, backwards, at right angles to each other and right-handed."
        )
    return Pose(rotation=turn / scale, origin=matrix[:3, 3].copy())
