"""A mesh of a depth map: vertices at the pixels' centres, triangles between valid neighbours that are not cut apart.

Nothing is invented: holes stay holes, and where the surface jumps there is no wall.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.model.surface import Surface
from psvideo.solve.depth.scale import Depth


@dataclass(frozen=True, kw_only=True)
class Mesh:
    """Triangles in the camera frame (x right, y up, z to the camera), wound counter-clockwise as the camera sees them.

    points: (vertex, 3) float32, metres or relative like the depth.
    triangles: (triangle, 3) int32, indices of vertices.
    normals: (vertex, 3) float32, unit.
    colours: (vertex, 3) float32, linear albedo.
    places: (vertex, 2) float32, right and up in the picture, 0 to 1 from its lower left corner.
    """

    points: NDArray[np.float32]
    triangles: NDArray[np.int32]
    normals: NDArray[np.float32]
    colours: NDArray[np.float32]
    places: NDArray[np.float32]


def mesh_of(surface: Surface, depth: Depth) -> Mesh:
    """Return the mesh of a surface; a pixel that is in no triangle gives no vertex."""
    triangles = _triangles(depth)
    used = np.zeros(depth.depth.size, np.bool_)
    used[triangles] = True
    number = np.cumsum(used, dtype=np.int32) - 1
    albedo = surface.albedo if surface.albedo.ndim == 3 else np.repeat(surface.albedo[..., None], 3, axis=2)
    return Mesh(
        points=depth.view.points(depth.depth).reshape(-1, 3)[used].astype(np.float32),
        triangles=number[triangles],
        normals=surface.normals.reshape(-1, 3)[used].astype(np.float32),
        colours=albedo.reshape(-1, 3)[used].astype(np.float32),
        places=_places(used, depth.depth.shape),
    )


def _places(used: NDArray[np.bool_], shape: tuple[int, ...]) -> NDArray[np.float32]:
    row, col = np.divmod(np.flatnonzero(used), shape[1])
    return np.stack([(col + 0.5) / shape[1], 1 - (row + 0.5) / shape[0]], axis=-1).astype(np.float32)


def _triangles(depth: Depth) -> NDArray[np.int32]:
    """Two triangles for every square of four neighbours, or one where only three of them hang together."""
    valid = depth.valid
    index = np.arange(valid.size, dtype=np.int32).reshape(valid.shape)
    corners = (index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1])  # clockwise from the top left
    there = (valid[:-1, :-1], valid[:-1, 1:], valid[1:, 1:], valid[1:, :-1])
    whole = (  # the sides between corner n and corner n + 1
        ~depth.cut_east[:-1, :-1],
        ~depth.cut_south[:-1, 1:],
        ~depth.cut_east[1:, :-1],
        ~depth.cut_south[:-1, :-1],
    )
    fits = [  # the triangle about corner n, of its two neighbours and the two sides that meet in it
        there[n - 1] & there[n] & there[(n + 1) % 4] & whole[n - 1] & whole[n] for n in range(4)
    ]
    values = depth.depth
    shorter = np.abs(values[:-1, 1:] - values[1:, :-1]) < np.abs(values[:-1, :-1] - values[1:, 1:])
    full = (fits[0] & fits[2], fits[1] & fits[3])
    some = (fits[0] | fits[2], fits[1] | fits[3])
    neither = ~(full[0] | full[1])
    # a square is split along one diagonal only, or its triangles would overlap: where both do, along the shorter
    first = (full[0] & (shorter | ~full[1])) | (neither & some[0] & (shorter | ~some[1]))
    chosen = [_picked(corners, n, fits[n] & (first if n % 2 == 0 else ~first)) for n in range(4)]
    return np.concatenate(chosen)


def _picked(corners: tuple[NDArray[np.int32], ...], about: int, where: NDArray[np.bool_]) -> NDArray[np.int32]:
    """The triangles about a corner, counter-clockwise: from its next corner over itself to the one before."""
    three = (corners[(about + 1) % 4], corners[about], corners[about - 1])
    return np.stack([corner[where] for corner in three], axis=-1)
