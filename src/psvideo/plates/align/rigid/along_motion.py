"""What one surface leaves of the plates of all lights along a body's motion, and how that grows with the motion.

A plate shows a point's normal times albedo as it was turned then: along the body's ways all plates are lit by one
normal at the instant, under lights that turn along with it. What no normal explains of them, over their mean, is left:
it changes as points are moved a little, and as the body turns a little more. (A blend of a light's two plates tells
little: along a motion that is a little off it is smeared to both sides, but stays where it is.)
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.threads import over_ranges
from psvideo.model.arrays import Doubles, Floats
from psvideo.plates.align.rigid.along_kernel import PLANES, along_points
from psvideo.plates.align.rigid.plates_seen import PlatesSeen
from psvideo.plates.align.rigid.rigid_motion import SPIN, BodyPoints, RigidMotion

EACH = 1 << 9
"""So many points are one piece of work."""


@dataclass(frozen=True, kw_only=True)
class InPicture:
    """Some ``points`` (point,) of a body, and their places in the picture, ``row`` and ``col``, in its pixels."""

    points: BodyPoints
    row: NDArray[np.intp]
    col: NDArray[np.intp]

    @classmethod
    def of(cls, points: BodyPoints, rows: NDArray[np.intp], cols: NDArray[np.intp]) -> "InPicture":
        """Return those pixels of a body's ``points``, (row, col)."""
        return cls(points=points.at((rows, cols)), row=rows, col=cols)


@dataclass(frozen=True, kw_only=True)
class AlongMotion:
    """What no surface explains of plates at points along a motion, ``values`` (plate, point); how it grows as points
    are moved right and down, ``slopes`` (2, plate, point), and as the body turns, ``turning`` (3, plate, point); what
    each point counts, ``weight`` (point,), 0 where too few plates are lit; and the mean ``share`` that is left, 0 to
    1."""

    values: Floats
    slopes: Floats
    turning: Floats
    weight: Floats
    share: float

    @classmethod
    def of(cls, motion: RigidMotion, seen: InPicture, plates: PlatesSeen) -> "AlongMotion":
        """Return that of some ``plates``."""
        lamps = plates.turned(motion)
        ways = motion.velocity(seen.points), motion.bend(seen.points)
        told = np.empty((PLANES, len(lamps), seen.row.size), np.float32)
        near = plates.above(seen.points.near, (seen.row, seen.col))
        left, beyond = left_of(plates, lamps, np.stack([seen.col, seen.row, *ways[0], *ways[1], near]), told)
        tells = beyond > 0
        return cls(
            values=told[0],
            slopes=told[1:3],
            turning=told[3:],
            weight=np.where(tells, np.square(1 - left), np.float32(0)),
            share=float(left[tells].mean(dtype=np.float64)) if tells.any() else 1.0,
        )

    def steps(self, per_number: Floats, unit: Doubles) -> Floats:
        """Return by how much what is left grows with a ``unit`` of each number, (number, plate, point), where
        ``per_number`` (number, 2, point) changes the points' velocities."""
        own = unit.astype(np.float32)[:, None, None]
        steps = np.einsum("nap,aip->nip", per_number * own, self.slopes)
        steps[SPIN] += self.turning * own[SPIN]
        return np.asarray(steps, np.float32)

    def equations(self, per_number: Floats, unit: Doubles) -> tuple[Doubles, Doubles]:
        """Return the normal equations of the numbers, of a ``unit`` each: squares (number, number), and pull."""
        steps = self.steps(per_number, unit)
        weighted = steps * self.weight
        squares = np.einsum("nip,mip->nm", weighted, steps, dtype=np.float64)
        return squares, -np.einsum("nip,ip->n", weighted, self.values, dtype=np.float64)


def left_of(plates: PlatesSeen, lamps: Floats, places: Floats, told: Floats) -> tuple[Floats, Floats]:
    """Return what no surface explains of plates under ``lamps`` (plate, 4 or more) at ``places`` (7, point), 0 to 1,
    and of how many plates more than a normal and an albedo need it is told, both (point,). Fill ``told``, as the loop
    does."""
    left = np.empty((2, places.shape[1]), np.float32)
    own = np.ascontiguousarray(places, np.float32)

    def run(first: int, last: int) -> None:
        along_points(plates.pictures, lamps, own, first, last, left, told)

    over_ranges(run, places.shape[1], each=EACH)
    return left[0], left[1]
