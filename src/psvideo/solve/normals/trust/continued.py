"""Where doubt is narrow, normals continue across it: at edges of paint plates lie a part of a pixel beside each other.

A strip of a pixel or two, on whose both sides normals are trusted and agree, is no hole in the surface. Its normals are
means of what was solved there and of a plane through those around, each counted by its error.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.threads import over_ranges
from psvideo.model.arrays import Doubles, Floats, Indices, Mask
from psvideo.model.surface import Surface
from psvideo.solve.normals.trust.moving_doubt import at_points

REACH_PX, NEAR_PX = 3, 1.5
"""Pixels this far around tell, by a Gaussian of the second; of large pictures, whose motion is found on a coarser grid,
every n-th one."""
FINEST = 2
"""So many pixels go to one of a grid on which motion is found: strips are twice as wide where it is twice that."""
ALBEDO_MARGIN = 0.02
"""What is brighter or darker than all around by more than this share is another thing: a wire before a wall."""
FEWEST, MOST_UNCERTAIN = 0.2, 3.0
"""At least this share of the window must tell; and a plane's value is no more uncertain than so many times a mean's, as
it is beside what tells."""
GAIN, AGREES = 0.8, 1.5
"""What continues must be surer than this times the pixel's own error, which it may contradict by so many times."""
OF_APART = 0.4
"""So much of what it contradicts the pixel's own normal by it may be off itself."""
LEAST_DEG = 0.2
AT_ONCE = 4096
"""Points that a thread takes together."""


def continued(surface: Surface, moves: Mask, *, limit_deg: float) -> Surface:
    """Return the surface with normals that are trusted on across narrow doubt in what ``moves``, a mask on a grid of
    its own. What was trusted stays; ``limit_deg`` is the error up to which a normal is. The surface's memory is taken
    over; one without errors passes as it is."""
    error = surface.error_deg
    if error is None:
        return surface
    there = at_points(moves, error.shape)
    asked = there & ~surface.valid & (error > 0)
    if not asked.any() or not (surface.valid & there).any():
        return surface
    stride = max(round(error.shape[1] / moves.shape[1] / FINEST), 1)
    part = _Part.around(asked, (surface, error), surface.valid & there, stride)
    normal, error_deg, takes = part.looked_at(limit_deg)
    rows, cols = (part.places[takes] + np.array(part.corner, np.uint32)).T
    surface.normals[rows, cols] = normal[takes].astype(surface.normals.dtype)
    error[rows, cols] = error_deg[takes].astype(error.dtype)
    valid = surface.valid.copy()
    valid[rows, cols] = True
    return replace(surface, valid=valid)


@dataclass(frozen=True, kw_only=True)
class _Part:
    """What lies around the pixels that are asked: their ``places`` (point, 2) from its ``corner`` on; ``normals`` (3,
    row, col), the mean albedo, ``level``, and ``error`` in degrees, (row, col); and what is ``sure``, of which every
    ``stride``-th pixel in rows and columns is looked at."""

    places: Indices
    corner: tuple[int, int]
    normals: Floats
    level: Floats
    error: Floats
    sure: Mask
    stride: int

    @classmethod
    def around(cls, asked: Mask, given: tuple[Surface, NDArray[np.floating]], sure: Mask, stride: int) -> "_Part":
        """Return what lies around what is ``asked`` (row, col) of a surface, which is ``given`` with its errors."""
        (surface, error), reach = given, REACH_PX * stride
        spans = [np.flatnonzero(asked.any(axis=axis)) for axis in (1, 0)]
        part = tuple(slice(max(int(span[0]) - reach, 0), int(span[-1]) + reach + 1) for span in spans)
        albedo = surface.albedo[part].astype(np.float32)
        return cls(
            places=np.argwhere(asked[part]).astype(np.uint32),
            corner=(part[0].start, part[1].start),
            normals=np.ascontiguousarray(np.moveaxis(surface.normals[part], -1, 0), np.float32),
            level=np.ascontiguousarray(albedo if albedo.ndim == 2 else albedo.mean(axis=-1)),
            error=np.ascontiguousarray(error[part], np.float32),
            sure=np.ascontiguousarray(sure[part]),
            stride=stride,
        )

    def looked_at(self, limit_deg: float) -> tuple[Doubles, Doubles, Mask]:
        """Return the points' normals (point, 3) and errors in degrees with what continues from around, and which of
        them are sure enough."""
        from psvideo.solve.normals.trust.continued_kernel import AroundPoint, continue_points

        around = AroundPoint(
            normals=self.normals,
            level=self.level,
            error=self.error,
            sure=self.sure.view(np.uint8),
            near=_nearness(),
            stride=self.stride,
            margin=ALBEDO_MARGIN,
        )
        found = np.empty((len(self.places), 6))

        def look(first: int, last: int) -> None:
            continue_points(self.places, around, found, first, last)

        over_ranges(look, len(self.places), each=AT_ONCE)
        rows, cols = self.places.T
        own, own_deg = self.normals[:, rows, cols].T.astype(np.float64), self.error[rows, cols].astype(np.float64)
        onward, continues_deg, uncertain, share = found[:, :3], found[:, 3], found[:, 4], found[:, 5]
        apart = np.degrees(np.arccos(np.clip((own * onward).sum(axis=1), -1, 1)))
        error_deg = np.hypot(continues_deg, OF_APART * apart)
        takes = (share > FEWEST) & (uncertain < MOST_UNCERTAIN) & (error_deg <= limit_deg)
        takes &= (error_deg < GAIN * own_deg) & (apart < AGREES * own_deg)
        counts = [1 / np.square(np.maximum(each, LEAST_DEG))[:, None] for each in (own_deg, error_deg)]
        mean = counts[0] * own + counts[1] * onward
        return mean / np.linalg.norm(mean, axis=1, keepdims=True), error_deg, takes


def _nearness() -> Doubles:
    """Return how much pixels around count by how near they are, (2 r + 1, 2 r + 1), 0 in the middle."""
    y, x = np.mgrid[-REACH_PX : REACH_PX + 1, -REACH_PX : REACH_PX + 1]
    near = np.exp(-(x * x + y * y) / (2 * NEAR_PX * NEAR_PX))
    near[REACH_PX, REACH_PX] = 0
    return np.asarray(near, np.float64)
