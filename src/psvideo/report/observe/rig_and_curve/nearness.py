"""Whether lamps that a rig takes for distant stand near: their light then falls off over the picture.

A lamp at r picture widths in a direction l lights what lies towards it more: its gain rises along the picture by
2 l / r, and the turn of its direction, which no normal explains either, makes that 3 l / r. One number for all lamps
says how near they are.

What bulges towards the camera faces a lamp where it lies towards it. There skin, wax and satin, which give more or
less light than a matte surface, rise along the picture as under near lamps; but they rise with the normals as well.
"""

from dataclasses import dataclass

import numpy as np

from psvideo.model.arrays import Doubles

RISE = 3.0
"""What a width of the picture adds to a lamp's gain, times its distance in widths: 2.9 at ten widths, 2.7 at three."""
LEAN_DEG = 16.0
"""By how much a typical normal leans for a rise of 1 over the subject: 15 to 17 on balls, waves and bumps."""


@dataclass(frozen=True, kw_only=True)
class Nearness:
    """``rise`` is by how much lamps' gains change over a picture's width, for a lamp in the picture's plane; 0 for
    distant ones. ``misfit`` is the share of a point's light that no normal explains once that is taken off,
    ``by_surface`` what is left where gains change with the normals instead, and ``extent`` how many widths the points
    cover."""

    rise: float
    misfit: float
    by_surface: float
    extent: float

    @property
    def widths(self) -> float:
        """How far away the lamps are, in widths of the picture."""
        return RISE / self.rise if self.rise > 0 else float("inf")

    @property
    def lean_deg(self) -> float:
        """By how much normals lean, in the mean over the subject, if the lamps are taken for distant."""
        return LEAN_DEG * max(self.rise, 0.0) * self.extent


def nearness(unit: Doubles, beyond: Doubles, vectors: Doubles, places: Doubles) -> Nearness:
    """Return how near the lamps are by points that all of them reach.

    unit: (point, light), their light as unit vectors; beyond: (light, light), the projector to what no normal explains.
    vectors: (light, 3) towards the lamps; places: (point, 2), x right and y up in widths of the picture.
    """
    aside = vectors[:, :2] / np.linalg.norm(vectors, axis=1, keepdims=True)
    aside = aside - aside.mean(axis=0)  # what all lamps share is the albedo's
    away = places - np.median(places, axis=0)
    plain = unit @ beyond
    rise, left = _taken_off(plain, (unit * (away @ aside.T)) @ beyond)
    normals = unit @ np.linalg.pinv(vectors).T
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    _, by_surface = _taken_off(plain, (unit * (normals[:, :2] @ aside.T)) @ beyond)
    reach = np.percentile(away, [2, 98], axis=0)
    return Nearness(rise=rise, misfit=left, by_surface=by_surface, extent=float((reach[1] - reach[0]).max()))


def _taken_off(plain: Doubles, risen: Doubles) -> tuple[float, float]:
    """Return how much of ``risen`` (point, light) is in ``plain``, and what a typical point has left without it."""
    rise = float((plain * risen).sum() / max(float((risen * risen).sum()), 1e-12))
    return rise, float(np.median(np.linalg.norm(plain - rise * risen, axis=1)))
