"""Whether lamps that a rig takes for distant stand near: their light then falls off over the picture.

A lamp at r picture widths in a direction l lights what lies towards it more: its gain rises along the picture by
2 l / r, and the turn of its direction, which no normal explains either, makes that 3 l / r. One number for all lamps
says how near they are.
"""

from dataclasses import dataclass

import numpy as np

from psvideo.model.camera import FloatArray

RISE = 3.0
"""What a width of the picture adds to a lamp's gain, times its distance in widths: 2.9 at ten widths, 2.7 at three."""
LEAN_DEG = 16.0
"""By how much a typical normal leans for a rise of 1 over the subject: 15 to 17 on balls, waves and bumps."""


@dataclass(frozen=True, kw_only=True)
class Nearness:
    """``rise`` is by how much lamps' gains change over a picture's width, for a lamp in the picture's plane; 0 for
    distant ones. ``misfit`` is the share of a point's light that no normal explains once that is taken off, and
    ``extent`` how many widths the points cover."""

    rise: float
    misfit: float
    extent: float

    @property
    def widths(self) -> float:
        """How far away the lamps are, in widths of the picture."""
        return RISE / self.rise if self.rise > 0 else float("inf")

    @property
    def lean_deg(self) -> float:
        """By how much normals lean, in the mean over the subject, if the lamps are taken for distant."""
        return LEAN_DEG * max(self.rise, 0.0) * self.extent


def nearness(unit: FloatArray, beyond: FloatArray, vectors: FloatArray, places: FloatArray) -> Nearness:
    """Return how near the lamps are by points that all of them reach.

    unit: (point, light), their light as unit vectors; beyond: (light, light), the projector to what no normal explains.
    vectors: (light, 3) towards the lamps; places: (point, 2), x right and y up in widths of the picture.
    """
    aside = vectors[:, :2] / np.linalg.norm(vectors, axis=1, keepdims=True)
    aside = aside - aside.mean(axis=0)  # what all lamps share is the albedo's
    away = places - np.median(places, axis=0)
    plain, risen = unit @ beyond, (unit * (away @ aside.T)) @ beyond
    rise = float((plain * risen).sum() / max(float((risen * risen).sum()), 1e-12))
    left = np.linalg.norm(plain - rise * risen, axis=1)
    reach = np.percentile(away, [2, 98], axis=0)
    return Nearness(rise=rise, misfit=float(np.median(left)), extent=float((reach[1] - reach[0]).max()))
