"""The body that a moving part is: its motion and the depth of its points."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from psvideo.model.arrays import Floats
from psvideo.plates.align.rigid.along_motion import InPicture
from psvideo.plates.align.rigid.depth_blocks import DepthBlocks
from psvideo.plates.align.rigid.flow_fit import motion_of_flow
from psvideo.plates.align.rigid.joint_fit import MovingPoints, fitted_together, some_of
from psvideo.plates.align.rigid.moving_parts import MovingPart
from psvideo.plates.align.rigid.plates_seen import PlatesSeen
from psvideo.plates.align.rigid.rigid_motion import NUMBERS, BodyPoints, RigidMotion
from psvideo.plates.align.rigid.seen_depth import depth_of
from psvideo.plates.align.rigid.surface_fit import motion_of_surface
from psvideo.plates.align.velocity.followed import Followed

MOST_POINTS, FEWEST_POINTS = 1000, 100
"""A body's motion is fitted to so many points at most, and to flow alone where fewer than the second were found."""


@dataclass(frozen=True, kw_only=True)
class RigidBody:
    """A ``part`` that moves, its ``points`` (row, col) and its ``motion``."""

    part: MovingPart
    points: BodyPoints
    motion: RigidMotion

    @classmethod
    def of(
        cls, part: MovingPart, found: Followed, normals: Floats, round_s: float, levels: Sequence[PlatesSeen]
    ) -> "RigidBody":
        """Return the body that moves as was ``found``, and on, as plates of all ``levels`` of smoothness show it.

        ``normals`` (row, col, 3), times albedo, are what is seen so far; a ``round_s`` lies between two plates of a
        light.
        """
        points = BodyPoints.of(depth_of(normals, part.about), part.about)
        unit = np.ones(NUMBERS) / round_s
        unit[2:] /= points.at(part.about).radius_px
        some = some_of(part.found, MOST_POINTS)
        motion = motion_of_flow(points.at(some), found.velocity[:, *some], unit)
        if levels and len(some[0]) >= FEWEST_POINTS:
            motion = motion_of_surface(motion, InPicture.of(points, *some), levels[0], unit)
            moving = MovingPoints(points=points, motion=motion, blocks=DepthBlocks.of(part.about, points.near))
            for plates in levels:
                moving = fitted_together(moving, part, plates, unit)
            points, motion = moving.points, moving.motion
        return cls(part=part, points=points, motion=motion)

    def moved(self, found: Followed) -> Followed:
        """Return what was ``found``, with all that is about the body moved along with it."""
        about = self.part.about
        velocity = np.where(about, self.motion.velocity(self.points), found.velocity)
        return replace(found, velocity=velocity, bend=np.where(about, self.motion.bend(self.points), found.bends))
