"""By how much normals are off because a surface turns between the two plates of every light.

A blend of what a light shows before and after an instant goes straight from the one to the other, where the surface
turns along an arc: it is off by the arc's height. All lights are off alike, a little more the farther their plates lie
from the instant, so that one normal explains them nearly as well as if they were right.
"""

from collections.abc import Sequence

import cv2
import numpy as np

from psvideo.model.arrays import Codes8, Floats
from psvideo.plates.align.plate_lamps import Lamps
from psvideo.plates.align.velocity.brightness import EVERY_CODE, light_of

WINDOW_PX = (5, 5)
"""Normals before and after are those of light averaged over so many pixels: noise and edges that lie beside each other
turn them as well."""
HEIGHT = np.float32(1 / 8)
"""An arc's height over its chord, as a share of its radius times the square of its angle, for angles well below 1."""
MOST_DEG = np.float32(4)
"""No more is claimed: what turns by more than 43 degrees is on no arc that its chord tells of, and off by as much (bare
boxes that turned by 55 and 59 degrees between two plates of a light by 3 to 5)."""
LEAST = np.float32(1e-6)

PlateEnds = tuple[Codes8, Codes8, float]
"""A light's codes before and after an instant, (row, col), moved to it, and the light of the brightest."""


def arc_deg(lamps: Lamps, ends: Sequence[PlateEnds]) -> Floats:
    """Return by how many degrees normals may be off because they turned between the plates of the lights, (row, col):
    the height of the arc, which goes with the square of the angle between the normals of what lights show before the
    instant and after it. ``ends`` come in the order of the ``lamps``."""
    pulls = np.linalg.pinv(lamps.matrix).T.astype(np.float32)
    shape = ends[0][0].shape
    normals = np.zeros((2, 3, *shape), np.float32)
    for pull, own, (before, after, white) in zip(pulls, lamps.evenings(shape), ends, strict=True):
        light = (np.float32(white) * light_of(EVERY_CODE)).astype(np.float32)
        for whole, codes in zip(normals, (before, after), strict=True):
            shown = cv2.blur(cv2.LUT(codes, light), WINDOW_PX) * own
            for plane, share in zip(whole, pull, strict=True):
                plane += share * shown
    lengths = [np.sqrt(np.square(each).sum(axis=0)) for each in normals]
    cosine = (normals[0] * normals[1]).sum(axis=0) / np.maximum(lengths[0] * lengths[1], LEAST)
    angle = np.arccos(np.clip(cosine, -1, 1))
    return np.asarray(np.minimum(np.degrees(HEIGHT * angle * angle), MOST_DEG), np.float32)
