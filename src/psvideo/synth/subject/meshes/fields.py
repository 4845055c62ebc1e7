"""Signed distances to sculpt with: blobs, limbs, planes, and soft unions and cuts (after Quilez's distance functions).

Points have shape (point, 3), distances (point,), negative inside; lengths in metres.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from psvideo.model.arrays import Doubles


def ball(p: Doubles, centre: ArrayLike, radius: float) -> Doubles:
    """Return the distance to a ball."""
    return np.asarray(_lengths(p - np.asarray(centre)) - radius)


def ellipsoid(p: Doubles, centre: ArrayLike, radii: ArrayLike) -> Doubles:
    """Return the distance to an axis-aligned ellipsoid, exact near its surface."""
    q = (p - np.asarray(centre)) / np.asarray(radii)
    reach = _lengths(q)
    slope = _lengths(q / np.asarray(radii))
    return np.asarray(reach * (reach - 1.0) / np.maximum(slope, 1e-9))


def limb(p: Doubles, start: ArrayLike, end: ArrayLike, start_radius: float, end_radius: float) -> Doubles:
    """Return the distance to a rounded limb whose radius runs from one end to the other."""
    a, ab = np.asarray(start, float), np.asarray(end, float) - np.asarray(start, float)
    share = np.clip((p - a) @ ab / (ab @ ab), 0.0, 1.0)
    radius = start_radius + share * (end_radius - start_radius)
    return np.asarray(_lengths(p - a - share[:, None] * ab) - radius)


def strand(p: Doubles, points: Sequence[ArrayLike], radii: Sequence[float], blend: float = 0.0) -> Doubles:
    """Return the distance to a chain of limbs through points."""
    limbs = [limb(p, points[i], points[i + 1], radii[i], radii[i + 1]) for i in range(len(points) - 1)]
    total = limbs[0]
    for piece in limbs[1:]:
        total = union(total, piece, blend)
    return total


def rotated(p: Doubles, centre: ArrayLike, axis: int, degrees: float) -> Doubles:
    """Return points turned back about a line parallel to an axis, so that what is drawn there appears turned."""
    angle = np.deg2rad(-degrees)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    q = p - np.asarray(centre)
    turned_q = q.copy()
    turned_q[:, i] = np.cos(angle) * q[:, i] - np.sin(angle) * q[:, j]
    turned_q[:, j] = np.sin(angle) * q[:, i] + np.cos(angle) * q[:, j]
    return np.asarray(turned_q + np.asarray(centre))


def union(a: Doubles, b: Doubles, blend: float = 0.0) -> Doubles:
    """Return the union, with a fillet about as wide as ``blend``."""
    if blend <= 0:
        return np.minimum(a, b)
    near = np.maximum(blend - np.abs(a - b), 0.0) / blend
    return np.asarray(np.minimum(a, b) - near**3 * blend / 6.0)


def difference(a: Doubles, b: Doubles, blend: float = 0.0) -> Doubles:
    """Return ``a`` without ``b``, with a rounded edge."""
    return -union(-a, b, blend)


def common(a: Doubles, b: Doubles, blend: float = 0.0) -> Doubles:
    """Return what ``a`` and ``b`` share, with a rounded edge."""
    return -union(-a, -b, blend)


def mirrored(p: Doubles) -> Doubles:
    """Return points folded onto x >= 0, so that what is drawn on the right appears on both sides."""
    return np.asarray(np.column_stack([np.abs(p[:, 0]), p[:, 1:]]))


def _lengths(vectors: Doubles) -> Doubles:
    # axis by axis: numpy is slow along a short last axis
    x, y, z = vectors.T
    return np.asarray(np.sqrt(x * x + y * y + z * z))
