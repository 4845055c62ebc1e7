"""Small pictures of a dome under a ring of lights: what loops are compiled with ahead, and what live rehearses with."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.model.rig import Light, Rig

RING = [(0.5, 0.0), (-0.5, 0.1), (0.1, 0.5), (-0.1, -0.5), (0.4, 0.4), (-0.4, 0.4), (-0.4, -0.4), (0.4, -0.4)]
"""The lights' x and y; z is 0.8, of metal in turn 1.6."""


@dataclass(frozen=True, kw_only=True)
class SmallPictures:
    """Pictures of a dome, solved from Python: float32 in, float32 out, which takes never are."""

    lights: int
    colour: bool = False
    near: bool = False
    metal: bool = False

    @property
    def rig(self) -> Rig:
        """Lights, 1 m away where they are near."""
        size = self.size_px
        ways = [(float(x), float(y), float(z)) for x, y, z in self.directions]
        if not self.near:
            return Rig(lights=tuple(Light(name=f"l{n}", direction=way) for n, way in enumerate(ways)))
        lights = tuple(Light(name=f"l{n}", position_m=(x, y, z - 1.0)) for n, (x, y, z) in enumerate(ways))
        return Rig(lights=lights, focal_px=(10 * size,) * 2, principal_px=(size / 2,) * 2, plane=(0.0, 0.0, 1.0, 1.0))

    @property
    def directions(self) -> NDArray[np.float64]:
        """Unit vectors (light, 3)."""
        deep = (0.8, 1.6) if self.metal else (0.8, 0.8)  # on a ring nobody asks for metal
        ways = np.array([(x, y, deep[n % 2]) for n, (x, y) in enumerate(RING[: self.lights])])
        return np.asarray(ways / np.linalg.norm(ways, axis=1, keepdims=True))

    @property
    def images(self) -> NDArray[np.float32]:
        """Plates (light, row, col[, channel])."""
        y, x = np.mgrid[-0.6 : 0.6 : self.size_px * 1j, -0.6 : 0.6 : self.size_px * 1j]
        normals = np.stack([x, -y, np.sqrt(1 - x * x - y * y)], axis=-1)
        shade = 0.5 * np.maximum(np.einsum("rcx,lx->lrc", normals, self.directions), 0)
        if self.metal:
            half = self.directions + np.array((0.0, 0.0, 1.0))
            half /= np.linalg.norm(half, axis=1, keepdims=True)
            shade = 0.05 * shade + 0.5 * np.maximum(np.einsum("rcx,lx->lrc", normals, half), 0) ** 12
        return np.asarray(np.stack([shade] * 3, axis=-1) if self.colour else shade, np.float32)

    @property
    def size_px(self) -> int:
        """Rows and columns."""
        return 64
