"""The lights of plates as alignment needs them: as if all were distant, with what evens near ones out.

A near light at P sends ``(P - X) / |P - X|^3``, times its cone's share, to a point X. Where all lights stand in one
plane ``P . m = 1`` that is ``(I - m X^T) P / |P - X|^3``: but for a factor of its own in every pixel each light is as a
distant one, before a surface whose normal is turned and stretched alike for all. What asks whether one surface explains
the plates of all lights asks for any normal. Lights that stand in no plane are off by little where a picture is small
beside their distance (Y. Queau et al., "LED-based photometric stereo", JMIV 60, 2018, section 2, has the model).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles, Floats
from psvideo.model.irradiance.ground import Ground, rays
from psvideo.model.irradiance.near_light import NearField, is_near, middle_directions, near_field, near_vectors
from psvideo.model.rig import Light, directions
from psvideo.plates.align.as_they_are_kernel import SOLVED

PLACES = 64
"""What near lights send changes evenly: it is told at so many places along the picture's longer side."""


@dataclass(frozen=True, kw_only=True)
class Lamps:
    """The lights of plates, by ``names``: ``matrix`` (light, 3), directions times what they send; of near ones in the
    middle of their ``near`` field, which is None where all are distant."""

    names: tuple[str, ...]
    matrix: NDArray[np.float64]
    near: NearField | None = None

    @classmethod
    def of(cls, lights: Sequence[Light], names: Sequence[str], ground: Ground | None = None) -> "Lamps | None":
        """Return the lamps of plates with these names, None where it is not known how they shine, or they are too few.
        Near ones shine on a ``ground``."""
        known = {light.name: light for light in lights if light.direction is not None or ground is not None}
        if len(names) < SOLVED or any(name not in known for name in names):
            return None
        chosen = [known[name] for name in names]
        strengths = np.array([np.mean(light.by_channel) for light in chosen])
        if ground is None or not is_near(chosen):
            return cls(names=tuple(names), matrix=directions(chosen) * strengths[:, None])
        near = near_field(chosen, ground)
        matrix = middle_directions(near) * (strengths * near.middle_gain)[:, None]
        return cls(names=tuple(names), matrix=matrix, near=near)

    @property
    def checked(self) -> bool:
        """Whether they are more than explain whatever their plates show."""
        return len(self.names) > SOLVED

    def evening(self, light: int, shape: tuple[int, ...]) -> Floats:
        """Return by what a light's picture of this shape is multiplied to show what a distant one would, (row, col), or
        (1, 1) where it is distant."""
        if self.near is None or not self.near.is_near[light]:
            return np.ones((1, 1), np.float32)
        return np.asarray(cv2.resize(self._evening[light], shape[::-1], interpolation=cv2.INTER_LINEAR), np.float32)

    def evenings(self, shape: tuple[int, ...]) -> Floats:
        """Return those of all lights, (light, row, col), or (light, 1, 1) where all are distant."""
        return np.stack(np.broadcast_arrays(*(self.evening(light, shape) for light in range(len(self.names)))))

    @cached_property
    def _evening(self) -> Floats:
        """What evens all lights out, at a few places, (light, row, col)."""
        if (near := self.near) is None:
            raise ValueError("distant lights are even")
        points_m = _places_m(near.ground)
        gain = [
            _sent(near, light, near.ground.middle_m) / _sent(near, light, points_m) for light in range(len(self.names))
        ]
        return np.stack(gain).astype(np.float32)


def _places_m(ground: Ground) -> Doubles:
    """Return places of a ground that are evenly spread over its picture, in metres, (row, col, 3)."""
    rows, cols = ground.depth_m.shape
    each = max(rows, cols) / PLACES
    down, across = max(round(rows / each), 1), max(round(cols / each), 1)
    row, col = (np.arange(down) + 0.5) * (rows / down) - 0.5, (np.arange(across) + 0.5) * (cols / across) - 0.5
    x, y = rays(ground.focal_px, ground.principal_px, col=col[None], row=row[:, None])
    depth_m = cv2.resize(ground.depth_m, (across, down), interpolation=cv2.INTER_AREA).astype(np.float64)
    return np.stack([x * depth_m, y * depth_m, -depth_m], axis=-1)


def _sent(near: NearField, light: int, points_m: Doubles) -> Doubles:
    """Return what a near light sends to points (..., 3), over the vector to it."""
    place_m = near.positions_m[light]
    vectors = near_vectors(points_m, place_m, axis=near.axes[light], anisotropy=float(near.anisotropy[light]))
    return np.asarray(np.linalg.norm(vectors, axis=-1) / np.linalg.norm(place_m - points_m, axis=-1))
