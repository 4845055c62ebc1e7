"""Normals that belong to no surface: along a closed way the slopes of a surface add up to nothing."""

import math

import numpy as np

from psvideo.model.arrays import Floats
from psvideo.solve.depth.view import View
from psvideo.solve.normals.trust.thin_surface import ThinSurface, blurred, line

TORN, NEAR = 5, 9
"""Slopes are added up along the edges of squares of this many points, averaged over those of the second."""
LEAST_FACING, MOST_TORN = np.float32(0.25), np.float32(0.5)
"""Slopes are those of normals that face the camera at least this much; and around four points they count up to this
much, since where one thing is before another they say nothing of either."""
TORN_OF_NOISE, SURELY_TORN = np.float32(0.27), np.float32(0.35)
"""How much of what noise does to a normal shows in slopes added up: on nothing but noise, and with a margin."""


def torn_angles_deg(
    points: ThinSurface, misfit_deg: Floats, uneven: Floats, view: View, shape: tuple[int, ...]
) -> tuple[Floats, Floats]:
    """Return the angle by which the normals around every point surely cannot be one surface's, and likely: around any
    four points the slopes of a surface add up to 0, and what these add up to is averaged over a square. Through a lens,
    whose ``view`` it is of a picture of this ``shape``, it is the slopes of the logarithm of depth that do."""
    from psvideo.solve.normals.trust.signs_kernel import fill_torn, fill_torn_deg, square_torn

    torn = np.empty((2, *points.known.shape), np.float32)
    fill_torn(_along_rays(points, view, shape), points.known_bytes, float(LEAST_FACING), float(MOST_TORN), torn)
    square_torn(blurred(torn, TORN).reshape(2, -1), torn.reshape(2, -1), math.degrees(TORN / 2))
    angles = np.empty((2, *points.known.shape), np.float32)
    noise_deg = points.noise_deg if points.noisier is None else points.noise_deg * np.sqrt(points.noisier)
    given = line(noise_deg), line(misfit_deg), line(uneven)
    shares = float(SURELY_TORN), float(TORN_OF_NOISE)
    fill_torn_deg(blurred(torn, NEAR).reshape(2, -1), *given, *shares, angles.reshape(2, -1))
    return angles[0], angles[1]


def _along_rays(points: ThinSurface, view: View, shape: tuple[int, ...]) -> Floats:
    """Return the points' normals, (3, row, col), with what faces the camera along each one's ray in the place of z."""
    if not view.perspective:
        return points.planes
    x, y = (np.asarray(rays[:: points.step], np.float32) for rays in view.rays(shape[0], shape[1]))
    across, up, facing = points.planes
    return np.stack([across, up, facing - x * across - y * up])
