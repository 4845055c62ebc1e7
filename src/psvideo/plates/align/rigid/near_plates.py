"""Where near lights of plates stand beside a body, in the pixels and along the axes in which bodies are told.

A body's points are as far from a near light as they are, not as a plane through its middle is: a ball whose middle is
six radii away from a lamp gets half as much again on its near side, and light from 9 degrees aside beside its middle.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from psvideo.model.arrays import Doubles, Floats
from psvideo.plates.align.plate_lamps import Lamps

DOWN = np.array([1, -1, 1])
"""Lights are told with the second axis up, bodies with it down, as pictures are."""


@dataclass(frozen=True, kw_only=True)
class NearPlates:
    """The lights of plates that are near, ``of_plate`` (plate, 11): what each sends at a pixel's distance, 0 of a
    distant one; its place right, down and near the camera in pixels, from where the camera's axis meets the depth of
    the ground's middle; its axis, its anisotropy; and the column and the row of the camera's axis, and one over the
    camera's distance in pixels. ``rise`` (row, col) is by how much the ground is nearer than its middle, in pixels."""

    of_plate: Floats
    rise: Floats

    @classmethod
    def of(cls, lamps: Lamps, matrix: Doubles, plates: Sequence[int], shape: tuple[int, int]) -> "NearPlates | None":
        """Return those of ``plates`` of some lights, which light a normal by a ``matrix`` (light, 3) in the middle, in
        the pixels of a picture of this shape; None where all are distant."""
        if (near := lamps.near) is None:
            return None
        ground = near.ground
        scale, middle_m = shape[1] / ground.depth_m.shape[1], -float(ground.middle_m[2])
        far_px = scale * float(np.mean(ground.focal_px))
        metres = middle_m / far_px
        axis_px = [(place + 0.5) * scale - 0.5 for place in ground.principal_px]
        places = (near.positions_m + np.array([0, 0, middle_m])) * DOWN / metres
        sends = np.where(near.is_near, np.linalg.norm(matrix, axis=1) / near.middle_gain / metres**2, 0)
        view = np.tile([*axis_px, 1 / far_px], (len(sends), 1))
        lights = [sends[:, None], places, near.axes * DOWN, near.anisotropy[:, None], view]
        depth_m = cv2.resize(ground.depth_m, shape[::-1], interpolation=cv2.INTER_AREA)
        return cls(
            of_plate=np.concatenate(lights, axis=1)[list(plates)].astype(np.float32),
            rise=np.asarray((middle_m - depth_m) / metres, np.float32),
        )

    def turned(self, turns: Doubles) -> Floats:
        """Return the lights of plates and how a body turned on from each to the instant, ``turns`` (plate, 3, 3), as
        (plate, 20)."""
        return np.concatenate([self.of_plate, turns.reshape(len(turns), 9).astype(np.float32)], axis=1)
