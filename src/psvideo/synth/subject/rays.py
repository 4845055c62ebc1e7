"""Ray casting against triangles, with Embree."""

import numpy as np
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles

BOX = 100.0
"""Embree computes in 32 bits: the scene is scaled to this size, so that its rounding stays far below a pixel."""


class Caster:
    """Triangles that rays can be cast at. ``vertices`` (vertex, 3) in metres, ``faces`` (face, 3)."""

    def __init__(self, vertices: Doubles, faces: NDArray[np.int32]) -> None:
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        self._origin = 0.5 * (low + high)
        self.size_m = float(np.linalg.norm(high - low)) or 1.0
        self._scale = BOX / self.size_m
        self._scene = rtcore_scene.EmbreeScene()
        TriangleMesh(scene=self._scene, vertices=self._boxed(vertices), indices=np.ascontiguousarray(faces, np.int32))

    def first(self, origins: Doubles, directions: Doubles) -> NDArray[np.intp]:
        """Return the face that each ray hits first, -1 where it hits none. Shapes (ray, 3) to (ray,)."""
        hit = self._scene.run(self._boxed(origins), np.ascontiguousarray(directions, np.float32), query="INTERSECT")
        return np.asarray(hit, np.intp)

    def blocked(self, origins: Doubles, directions: Doubles, distance_m: Doubles) -> NDArray[np.bool_]:
        """Return whether anything lies on each ray before ``distance_m``. Directions are unit vectors."""
        reach = np.minimum(distance_m * self._scale, 1e30).astype(np.float32)
        unit = np.ascontiguousarray(directions, np.float32)
        return np.asarray(self._scene.run(self._boxed(origins), unit, reach, query="OCCLUDED") >= 0)

    def _boxed(self, points: Doubles) -> NDArray[np.float32]:
        return np.ascontiguousarray((points - self._origin) * self._scale, np.float32)


def barycentric(origins: Doubles, directions: Doubles, corners: Doubles) -> tuple[Doubles, Doubles]:
    """Return where rays meet the planes of their triangles: distance (ray,) and weights of the corners (ray, 3).

    ``corners`` has shape (ray, 3, 3). Computed in 64 bits, after Möller and Trumbore (1997).
    """
    a = corners[:, 0]
    ab, ac = corners[:, 1] - a, corners[:, 2] - a
    p = np.cross(directions, ac)
    determinant = np.einsum("ij,ij->i", ab, p)
    determinant = np.where(np.abs(determinant) < 1e-300, 1e-300, determinant)
    from_a = origins - a
    u = np.einsum("ij,ij->i", from_a, p) / determinant
    q = np.cross(from_a, ab)
    v = np.einsum("ij,ij->i", directions, q) / determinant
    distance = np.einsum("ij,ij->i", ac, q) / determinant
    return distance, np.stack([1.0 - u - v, u, v], axis=1)
