"""How far normals are off at most that plates of more than three lights agree on, where things move.

What makes plates of a moving subject doubtful (they differ along the motion, normals around are torn) says where they
may be wrong. Whether they are, the lights show: plates that are off leave something over of the one normal that is
fitted to them.
"""

from dataclasses import dataclass, replace

import numpy as np

from psvideo.model.arrays import Floats
from psvideo.solve.normals.evidence import Evidence
from psvideo.solve.normals.plate_noise import PlateNoise
from psvideo.solve.normals.trust.doubting import Doubting, doubt_deg
from psvideo.solve.normals.trust.signs import Signs
from psvideo.solve.normals.trust.thin_surface import ThinSurface
from psvideo.solve.normals.trust.witness import left_over, noise_share

LEAST_LEFT_DEG, LEAST_DOUBT_DEG = np.float32(1), np.float32(0.3)
"""Less than the first of what is left says no more: shading that turns evenly leaves nothing and turns normals by as
much; doubts count for no less than the second."""
TIMES = np.float32(1.3)
"""What the lights show of a doubt counts so many times: a wall behind bars that is carried along with them leaves less
than it is turned by."""


@dataclass(frozen=True, kw_only=True)
class Agreeing:
    """What is left over of plates, (row, col) of the points: by how many degrees errors as large would turn the normal,
    ``left_deg``, how many lights beyond three show it, ``free``; how far anything ``stirs``, 0 to 1; and the doubt of
    what stands still as well, but for torn normals, ``least_deg``, which no lights take away."""

    left_deg: Floats
    free: Floats
    stirs: Floats
    least_deg: Floats

    def limited(self, doubt_deg: Floats) -> Floats:
        """Return how far normals may be off that were doubted by so much: no more than before.

        It is the geometric mean of the doubt and of what every light beyond three shows. Of 94,000 pixels of moving
        virtual subjects that two lights check, doubted by 18 degrees and more, two thirds are within 0.4 degrees where
        0.5 are left, 2.8 where 1 to 2, 10 where 5 to 8, and 29 where 12 to 20.
        """
        share = 1 / (self.free + 1)
        left, doubt = np.hypot(self.left_deg, LEAST_LEFT_DEG), np.maximum(doubt_deg, LEAST_DOUBT_DEG)
        shown = np.maximum(TIMES * left ** (1 - share) * doubt**share, self.least_deg)
        return np.asarray(doubt_deg - self.stirs * np.maximum(doubt_deg - shown, 0), np.float32)


def agreeing(
    points: ThinSurface, one: Evidence, noise: PlateNoise, signs: Signs, stirs: Floats, how: Doubting
) -> Agreeing | None:
    """Return what the plates of the points' lights leave over, None where these are no more than three, or stand still.
    ``stirs`` (row, col) is how far anything does, 0 to 1."""
    if one.left is None:
        return None
    dark = noise_share(points, noise, float(one.lit.intensities.mean()))
    free, _, seen = left_over(one.left, points.known, dark)
    if not free.any():
        return None
    square = np.maximum(seen / np.maximum(free, 1) - dark * dark, 0)
    none = np.zeros_like(signs.torn_deg)
    return Agreeing(
        left_deg=np.asarray(np.degrees(np.sqrt(square * _across(points, one))), np.float32),
        free=free,
        stirs=stirs,
        least_deg=doubt_deg(replace(signs, torn_deg=none, likely_torn_deg=none), how=how),
    )


def _across(points: ThinSurface, one: Evidence) -> Floats:
    """Return the square by which errors of a share of albedo under every light turn the points' normals, in radians,
    as least squares spreads them."""
    normals = points.surface.normals.astype(np.float32)
    strength = one.lit.intensities.mean(axis=1)
    pulls = np.linalg.pinv(one.lit.directions * strength[:, None]).T.astype(np.float32)
    turned = np.zeros(points.known.shape, np.float32)
    for pull, lamp in zip(pulls, strength.astype(np.float32), strict=True):
        turned += np.maximum(np.float32(pull @ pull) - (normals @ pull) ** 2, 0) * lamp * lamp
    return turned
