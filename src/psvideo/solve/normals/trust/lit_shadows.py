"""Shadows that are lit from around: what is left of a lamp's light there passes for light that grazes the surface.

Such normals keep one angle to that lamp, whichever way the surface turns on into its shadow. Under three lights nothing
contradicts them. A surface that the lamp does graze turns away from it as much as it turns at all.
"""

from typing import NamedTuple

import numpy as np

from psvideo.compute.ranks import median
from psvideo.model.arrays import Floats, Mask
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.trust.thin_surface import ThinSurface, blurred, width_of
from psvideo.solve.normals.trust.unchecked import towards

AROUND = 0.03
"""How normals turn is looked at over this share of the subject's size."""
DIM, DARK = 0.1, 0.04
"""A lamp that shines at a cosine below the first number may not reach a point, below the second it likely does not. (Of
what was trusted of a bear and a ball under three lights 69 and 65 % of such points lie in its shadow.)"""
TURNS, KEEPS = 0.8, 0.4
"""Where the angle to that lamp changes by the second share of how much normals turn, or by less, they keep it; chance
makes it 0.58, and a surface that turns away 0.7. In two shadows normals do not turn at all, but by their noise."""
BLACK, LIT = 0.57, 0.47
"""That share, typical of points which any lamp hardly lights, from where on shadows are black, and up to where they are
lit. (Over ten sets of three lights: bear, cat and ball 0.13 to 0.46; Washington's sphere, whose shadows are black, a
rendered bunny and a virtual bust 0.57 to 0.73.)"""
HARDLY_LIT, LEAST_POINTS = 0.08, 50
"""Which points these are, by the cosine, and how many there are at least."""
LEAST_TURN = np.float32(np.radians(0.05))
"""Where normals turn by less, not even by their noise, they lie in a plane, which has one angle to every lamp."""
OFF_DEG = 10.0
"""By how much such normals may be off: of those of bear, cat and ball the mean is 13 to 23 degrees, and of those that
were trusted 28 to 44 % were over 10."""


class LitShadows(NamedTuple):
    """By how many degrees normals may be off because a shadow passes for light, (row, col) of the points; and whether
    the subject's shadows are lit, 0 to 1. Zeros where they are black, or too few points show."""

    off_deg: Floats
    lit: float


def shadows_of(points: ThinSurface, lit: Illumination, known: Mask) -> LitShadows:
    """Return what shadows that are lit from around make of normals; the points that are ``known`` speak for the
    subject."""
    ways = towards(points, lit)
    cosines = (ways * points.planes).sum(axis=1)
    least, next_least = np.partition(cosines, 1, axis=0)[:2]
    keeps = _angle_beside_turn(points.planes, _of_lamp(ways, cosines.argmin(axis=0)), known)
    dim = known & (least < HARDLY_LIT)
    if np.count_nonzero(dim) < LEAST_POINTS:
        return LitShadows(np.zeros(known.shape, np.float32), 0.0)
    share = float(_falling(np.array(median(keeps[dim])), LIT, BLACK))
    each = _falling(least, DARK, DIM) * np.maximum(_falling(keeps, KEEPS, TURNS), _falling(next_least, DARK, DIM))
    return LitShadows(np.asarray(np.float32(OFF_DEG * share) * each * known, np.float32), share)


def _of_lamp(ways: Floats, lamp: np.ndarray) -> Floats:
    """Return the way to one lamp of every point, (3, row, col)."""
    if ways.shape[2:] == (1, 1):
        return np.asarray(np.moveaxis(ways[:, :, 0, 0][lamp], -1, 0))
    return np.asarray(np.take_along_axis(ways, lamp[None, None], axis=0)[0])


def _angle_beside_turn(normals: Floats, way: Floats, known: Mask) -> Floats:
    """Return by how much the cosine between normals and a way, (3, row, col) each, changes around every point, over how
    much normals turn there, standard deviations (row, col)."""
    pairs = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    each = np.stack([*normals, *(normals[i] * normals[j] for i, j in pairs), np.ones_like(normals[0])]) * known
    means = blurred(np.asarray(each, np.float32), width_of(known, AROUND))
    means[:-1] /= np.maximum(means[-1], np.float32(1e-6))
    spread = [means[3 + n] - means[i] * means[j] for n, (i, j) in enumerate(pairs)]
    along = sum(((1 if i == j else 2) * way[i] * way[j] * one for (i, j), one in zip(pairs, spread, strict=True)))
    turn = np.maximum(spread[0] + spread[1] + spread[2], 0)
    shares = np.sqrt(np.maximum(along, 0) / np.maximum(turn, LEAST_TURN**2))
    return np.asarray(np.where(turn < LEAST_TURN**2, 1, shares), np.float32)


def _falling(value: np.ndarray, whole: float, none: float) -> Floats:
    """Return 1 up to ``whole``, 0 from ``none`` on, and what lies between."""
    return np.asarray(np.clip((none - value) / (none - whole), 0, 1), np.float32)
