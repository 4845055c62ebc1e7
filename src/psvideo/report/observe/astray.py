"""By how far the camera, or the subject, moved between pictures of one scene that were taken under one light each.

Under distant lights a matte surface sends every lamp its direction times one vector per pixel, so that of more than
three lights what cannot be so is left over. Of a picture that lies ``d`` off, that is ``-g . d``, ``g`` being the
slopes of its brightness: linear least squares over many pixels gives every picture's place, but for what is common to
all (B. Lucas and T. Kanade, "An iterative image registration technique", IJCAI 1981, with the surface as the template).
Only fine detail is asked: shading, gloss and light by way of other surfaces are broad. Parts of the picture are asked
one by one, and where they say different things, shape or shine speaks and no motion.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.model.camera import FloatArray
from psvideo.plates.light_plate import LightPlate
from psvideo.report.observe.rig_and_curve.rigpoints import CHANNEL, RigPoints

LIGHTS_FOR_ASTRAY = 5
"""Of four, one value a pixel is left over, which errors of many kinds explain."""
MOST_LIGHTS = 24
"""Of more pictures this many are compared, spread evenly over the list: they show whether the camera stood."""
PARTS, LEAST_PARTS, PART_PX = 4, 6, 160
"""Parts down and across the subject, how many must have something to say, and the pixels of each that are looked at."""
FINE_PX, BROAD_PX = 1.0, 4.0
"""Detail is what a blur of the first (standard deviation) leaves and one of the second does not."""
LIT, DARK = 0.06, 0.03
"""A lamp reaches a pixel that has this share of what the brightest gives it, by their strengths, and a pixel counts
that has this share of the picture's brightest hundredth."""
CLEAR_PX = 9
"""No edge of a shadow is so near (half of a square of this side): it moves with the lamp."""
LEAST_PIXELS = 150
SLACK = 1e-3
"""What is common to all pictures is not known: it is taken for none."""
LEAST_SHOWN_PX, SURELY = 0.5, 2.5
"""Pictures that lie this far apart, and this many times their standard error, do not belong together. (Where the camera
stood: 0.02 to 0.29 px on six photographed objects, 0.01 to 0.5 on rendered ones, 2.2 times the error at most; 0.24 to
0.40 px on three whose neighbouring pictures show by themselves that the camera was touched.)"""
OF_MEDIAN = 1.25 * 1.4826
"""The standard error of a median of n, times the root of n, over the median distance from it."""


@dataclass(frozen=True, kw_only=True)
class Astray:
    """How far pictures lie from where they lie on the mean, in pixels: ``typical_px`` (root mean square), by how much
    that is unsure by what parts of the picture say, and the ``light`` whose picture is farthest off, by ``most_px``."""

    typical_px: float
    error_px: float
    light: str
    most_px: float

    @property
    def shows(self) -> bool:
        """Whether the pictures are surely not aligned."""
        return self.typical_px > max(LEAST_SHOWN_PX, SURELY * self.error_px)

    @property
    def within_px(self) -> float:
        """What they may lie apart at most, as far as parts of the picture show."""
        return max(self.typical_px, self.error_px)


def astray(plates: Sequence[LightPlate], points: RigPoints, box: tuple[slice, slice]) -> Astray | None:
    """Return how far a round's plates, of the lights of ``points``, lie apart.

    ``box`` is where the subject is, rows and columns. None where there are too few lights, or too little fine detail
    that all of them reach.
    """
    lights = list(range(0, len(plates), -(-len(plates) // MOST_LIGHTS)))
    if len(lights) < LIGHTS_FOR_ASTRAY:
        return None
    asked = [plates[light] for light in lights]
    found = [_places_px(asked, part, _vectors_at(points, part)[lights]) for part in _parts(box)]
    known = np.array([one for one in found if one is not None])
    if len(known) < LEAST_PARTS:
        return None
    usual = np.median(known, axis=0)
    errors = OF_MEDIAN * np.median(np.abs(known - usual), axis=0) / np.sqrt(len(known))
    off_px = np.hypot(*usual.T)
    worst = int(off_px.argmax())
    return Astray(
        typical_px=float(np.sqrt((off_px**2).mean())),
        error_px=float(np.sqrt((errors**2).sum(axis=1).mean())),
        light=asked[worst].light,
        most_px=float(off_px[worst]),
    )


def _parts(box: tuple[slice, slice]) -> Iterator[tuple[slice, slice]]:
    """Yield the middles of equal parts of a box."""
    edges = [np.linspace(side.start, side.stop, PARTS + 1).astype(int) for side in box]
    downs, acrosses = (
        [slice(max(a, (a + b - PART_PX) // 2), min(b, (a + b + PART_PX) // 2)) for a, b in pairwise(side.tolist())]
        for side in edges
    )
    parts = ((down, across) for down in downs for across in acrosses)
    yield from (part for part in parts if all(side.start < side.stop for side in part))


def _vectors_at(points: RigPoints, part: tuple[slice, slice]) -> FloatArray:
    """Return what the rig sends to the middle of a part, (light, 3)."""
    if len(points.vectors) == 1:
        return np.asarray(points.vectors[0], np.float64)
    row, col = ((side.start + side.stop) / 2 for side in part)
    nearest = int(np.hypot(points.rows - row, points.cols - col).argmin())
    return np.asarray(points.vectors[nearest], np.float64)


def _places_px(plates: Sequence[LightPlate], part: tuple[slice, slice], vectors: FloatArray) -> FloatArray | None:
    """Return where each plate lies in a part of the picture, (light, 2) as columns and rows from their mean."""
    light = np.stack([_cut(plate, part) for plate in plates])
    clear = _clear(light, plates, vectors)
    if clear.sum() < LEAST_PIXELS:
        return None
    fine = [cv2.GaussianBlur(one, (0, 0), FINE_PX) - cv2.GaussianBlur(one, (0, 0), BROAD_PX) for one in light]
    slopes = [np.gradient(one, axis=axis)[clear] for axis in (1, 0) for one in fine]
    left_of = np.eye(len(plates)) - vectors @ np.linalg.pinv(vectors)
    left = left_of @ np.stack([one[clear] for one in fine])
    every = np.stack(slopes).astype(np.float64)
    square = np.tile(left_of, (2, 2)) * (every @ every.T)
    right = -(every * np.tile(left, (2, 1))).sum(axis=1)
    found = np.linalg.solve(square + SLACK * np.trace(square) / len(square) * np.eye(len(square)), right)
    places = found.reshape(2, -1).T
    return np.asarray(places - places.mean(axis=0))


def _cut(plate: LightPlate, part: tuple[slice, slice]) -> NDArray[np.float32]:
    down, across = part
    rows = plate.picture.rows(range(down.start, down.stop))[:, across]
    return np.ascontiguousarray(rows if rows.ndim == 2 else rows[..., CHANNEL], np.float32)


def _clear(light: NDArray[np.float32], plates: Sequence[LightPlate], vectors: FloatArray) -> NDArray[np.bool_]:
    """Return where every lamp shines and clips nothing, with room to the nearest edge of a shadow."""
    strengths = np.linalg.norm(vectors, axis=1).astype(np.float32)
    even = light / np.maximum(strengths, np.float32(1e-9))[:, None, None]
    top = even.max(axis=0)
    whole = np.array([plate.saturation for plate in plates], np.float32)[:, None, None]
    good = ((light < whole) & (even > LIT * top)).all(axis=0) & (top > DARK * np.percentile(top, 99))
    eroded = cv2.erode(good.astype(np.uint8), np.ones((CLEAR_PX, CLEAR_PX), np.uint8), borderValue=0)
    return np.asarray(eroded > 0)
