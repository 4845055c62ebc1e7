"""A body's motion and the depth of its points, fitted together to what one surface leaves of the plates of all lights.

A point that is nearer to the camera goes farther: what is left changes with its depth along one line, in which the
turn moves it. What depth makes up for in a motion that is off, and the other way round, is solved for at once: Gauss
and Newton's steps, of which depth is eliminated first (by Schur's complement), since it is sought on many blocks.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import diags_array
from scipy.sparse.linalg import splu

from psvideo.model.arrays import Doubles, Flags
from psvideo.plates.align.rigid.along_kernel import UNLIKE
from psvideo.plates.align.rigid.along_motion import AlongMotion, InPicture
from psvideo.plates.align.rigid.depth_blocks import DepthBlocks
from psvideo.plates.align.rigid.moving_parts import MovingPart
from psvideo.plates.align.rigid.plates_seen import PlatesSeen
from psvideo.plates.align.rigid.rigid_motion import NUMBERS, BodyPoints, Pixels, RigidMotion

MOST_POINTS = 3000
"""So many points are asked at most."""
STEPS, FARTHEST, FARTHEST_PX = 6, 3.0, 10.0
"""So many steps, in each of which no number changes by more units, and no depth by more pixels."""
FIRM, LEAST = 0.01, 1e-6
"""How firmly numbers are held back, as a share of what is known of each; and depth, as a number."""


@dataclass(frozen=True, kw_only=True)
class MovingPoints:
    """A body's ``points`` (row, col), their ``motion``, and by how much ``blocks`` of them depart from the depth that
    normals tell."""

    points: BodyPoints
    motion: RigidMotion
    blocks: DepthBlocks

    def changed(self, part: MovingPart, by: Doubles, by_px: Doubles) -> "MovingPoints":
        """Return the same with a motion whose numbers are more by so much, and blocks of a ``part`` nearer by so many
        pixels."""
        off_px, near = self.blocks.off_px + by_px, self.points.near
        near = np.where(part.about, near + self.blocks.spread(by_px, near.shape), near).astype(np.float32)
        return replace(
            self,
            points=replace(self.points, near=near),
            motion=self.motion.changed(by),
            blocks=replace(self.blocks, off_px=off_px),
        )


def fitted_together(start: MovingPoints, part: MovingPart, plates: PlatesSeen, unit: Doubles) -> MovingPoints:
    """Return the motion and the depth of a ``part`` from ``start`` on of which one surface explains ``plates`` best.

    ``unit`` (number,) is by how much each number is to change to move points by about a pixel from plate to plate.
    """
    pixels, best = some_of(part.found, MOST_POINTS), start
    for _ in range(STEPS):
        by, by_px = _step(best, pixels, plates, unit)
        by_px = np.clip(by_px, -FARTHEST_PX, FARTHEST_PX)
        best = best.changed(part, np.clip(by, -FARTHEST, FARTHEST) * unit, by_px)
    return best


def _step(now: MovingPoints, pixels: Pixels, plates: PlatesSeen, unit: Doubles) -> tuple[Doubles, Doubles]:
    """Return by how many units numbers are to change, (number,), and by how many pixels blocks are, (block,)."""
    blocks, motion, seen = now.blocks, now.motion, InPicture.of(now.points, *pixels)
    block, count = blocks.at(pixels), len(blocks.off_px)
    along = AlongMotion.of(motion, seen, plates)
    each = along.weight / np.maximum(np.bincount(block, minlength=count), 1)[block] / float(UNLIKE) ** 2
    steps = along.steps(seen.points.per_number(), unit)
    nearer = motion.spin[1] * along.slopes[0] - motion.spin[0] * along.slopes[1]

    def of_blocks(values: Doubles) -> Doubles:
        return np.asarray(np.bincount(block, values * each, count), np.float64)

    own = np.einsum("nip,mip,p->nm", steps, steps, each)
    pull = -np.einsum("nip,ip,p->n", steps, along.values, each)
    cross = np.stack([of_blocks(one) for one in np.einsum("nip,ip->np", steps, nearer)])
    known = of_blocks(np.square(nearer).sum(axis=0))
    pull_px = -of_blocks((nearer * along.values).sum(axis=0)) - blocks.even @ blocks.off_px
    held = (blocks.even + diags_array(known + LEAST)).tocsc()  # type: ignore[no-untyped-call]
    solved = splu(held).solve(np.concatenate([cross, pull_px[None]]).T)  # type: ignore[no-untyped-call]
    left = own - cross @ solved[:, :NUMBERS] + FIRM * np.diag(np.diag(own) + LEAST)
    by = np.linalg.solve(left, pull - cross @ solved[:, NUMBERS])
    return by, solved[:, NUMBERS] - solved[:, :NUMBERS] @ by


def some_of(there: Flags, most: int) -> Pixels:
    """Return at most so many of the pixels that are ``there``, evenly spread, by row and column."""
    rows, cols = np.nonzero(there)
    every = max(-(-len(rows) // most), 1)
    return rows[::every], cols[::every]
