"""How a rigid body moves at an instant, and how that moves its picture.

Points of a body that turns go round: beside their velocity they have an acceleration, towards its axis. From plate to
plate of a light, while a body turns by 20 degrees, that puts a point several pixels beside the straight way.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles, Flags, Floats

NUMBERS = 6
SPIN = slice(2, 5)
"""Where the numbers of the rotation are."""

Pixels = tuple[NDArray[np.intp], NDArray[np.intp]]
"""Rows and columns of some pixels."""


@dataclass(frozen=True, kw_only=True)
class BodyPoints:
    """Where points of a body are, in pixels from its middle: ``right``, ``down``, and ``near`` the camera; all of one
    shape."""

    right: Floats
    down: Floats
    near: Floats

    @classmethod
    def of(cls, near: Floats, there: Flags) -> "BodyPoints":
        """Return every pixel's point, (row, col), by how near it is; the middle is that of what is ``there``."""
        y, x = np.mgrid[: there.shape[0], : there.shape[1]].astype(np.float32)
        right, down, depth = (np.asarray(plane - plane[there].mean(), np.float32) for plane in (x, y, near))
        return cls(right=right, down=down, near=depth)

    def at(self, where: Pixels | Flags) -> "BodyPoints":
        """Return some of the points, (point,)."""
        return BodyPoints(right=self.right[where], down=self.down[where], near=self.near[where])

    @property
    def radius_px(self) -> float:
        """How far points usually lie from the middle, as they are seen."""
        return float(np.sqrt(np.mean(np.square(self.right) + np.square(self.down))))

    def per_number(self) -> Floats:
        """Return by how much each number of a motion changes the points' velocities, (number, 2, ...)."""
        one, none = np.ones_like(self.near), np.zeros_like(self.near)
        rights = [one, none, none, self.near, -self.down, self.right]
        downs = [none, one, -self.near, none, self.right, self.down]
        return np.stack([np.stack(rights), np.stack(downs)], axis=1)


@dataclass(frozen=True, kw_only=True)
class RigidMotion:
    """``numbers`` are the velocity of a body's middle right and down, in pixels per second; its rotation about the axes
    that point right, down and to the camera, in radians per second; and the share by which its picture grows, per
    second, as it comes nearer."""

    numbers: Doubles

    @property
    def spin(self) -> Doubles:
        """The rotation about right, down and near, in radians per second."""
        return self.numbers[SPIN]

    def velocity(self, points: BodyPoints) -> Floats:
        """Return the velocity of points in the picture, x right and y down, (2, ...), in pixels per second."""
        right, down, about_right, about_down, about_near, grows = (np.float32(one) for one in self.numbers)
        x, y, near = points.right, points.down, points.near
        across = right + about_down * near - about_near * y + grows * x
        return np.stack([across, down + about_near * x - about_right * near + grows * y])

    def bend(self, points: BodyPoints) -> Floats:
        """Return how fast that changes as the body turns on, (2, ...), in pixels per square second: the acceleration
        w (w P) - P w^2 of a point P under a rotation w."""
        spin = self.spin.astype(np.float32)
        along = spin[0] * points.right + spin[1] * points.down + spin[2] * points.near
        square = np.square(spin).sum()
        return np.stack([spin[0] * along - square * points.right, spin[1] * along - square * points.down])

    def changed(self, by: Doubles) -> "RigidMotion":
        """Return a motion whose numbers are more by so much."""
        return replace(self, numbers=self.numbers + by)
