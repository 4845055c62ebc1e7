"""Whether normals face outwards where a subject ends: a surface turns away from the camera at its outline.

At the outline of a body that stands free the normal lies in the picture, square to the outline, and faces out of the
body (K. Ikeuchi and B. K. P. Horn, "Numerical shape from shading and occluding boundaries", Artificial Intelligence 17,
1981). Lights that are exchanged, mirrored or turned face normals elsewhere there, also where slopes still are those of
one surface: a ball becomes a saddle, which three lights explain as well.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles, Floats
from psvideo.model.surface import Surface

STEEP = 0.6
"""Normals count that lean so far (the sine of 37 degrees): a box's front meets its outline facing the camera."""
NEAR, BLUR = 2.5, 1.5
"""How far from the outline they may lie, and how far that is smoothed, in points."""
CLEAR = 0.12
"""Of a smoothed step, what its slope is at least, a point: cracks and single points have no side that is outside."""
LEAST_POINTS, LEAST_SHARE = 40, 0.5
"""So many points at the outline must be steep, and this share of those that three lights reach: where a mask cuts
through a relief, 0.3 are. (Of bodies that stand free 0.6 and more, under any rig.)"""
BEYOND, DARKER = 4.0, 0.5
"""So many points beyond the outline there is less than this share of the light in it: else a mask cuts the subject."""
ALL_AROUND = 0.7
"""Outlines that face one way tell little: their mean direction is shorter than this."""
SECTORS = 12
"""Ways out are compared with others of the same sector, 30 degrees wide: within one, the cosines of a ball that lights
make a saddle differ by 0.3 at most."""


@dataclass(frozen=True, kw_only=True)
class Facing:
    """How normals at a subject's outline face: the mean cosine between them and the way out, and by how much cosines
    differ (a standard deviation) where the way out is the same."""

    cosine: float
    apart: float


def outward(
    some: Surface,
    subject: NDArray[np.bool_],
    light: NDArray[np.float32],
    shown: NDArray[np.bool_] | None = None,
) -> Facing | None:
    """Return how steep normals at the subject's outline face. The mean cosine to the way out is 1 for a body that
    stands free, about 0 under lights that are exchanged, -1 for a bowl. A rig that is wrong turns normals that were
    alike alike, so that those of one way out still are; a bowl beside a body has both there, 1 apart at most. None
    where too little of an outline shows.

    some: a surface, thinned as the ``subject`` (row, col) is, and the brightest ``light`` of any lamp (row, col). Where
    the picture ends the subject does not, nor where rows end that are ``shown`` (row, col) under all lights.
    """
    away, right, up = _ways_out(subject)
    slope = np.hypot(right, up)
    normals = some.normals.astype(np.float32)
    leaning = np.hypot(normals[..., 0], normals[..., 1])
    rim = subject & some.measured & (away <= NEAR) & (slope > CLEAR)
    if shown is not None:
        rim &= _far_from_unseen(shown)
    rim[rim] = _ends(light, rim, right[rim] / slope[rim], up[rim] / slope[rim])
    at = rim & (leaning > STEEP)
    if at.sum() < max(LEAST_POINTS, LEAST_SHARE * rim.sum()):
        return None
    ways = np.stack([right[at], up[at]]) / slope[at]
    if np.hypot(*ways.mean(axis=1)) > ALL_AROUND:
        return None
    cosines = (ways * normals[at][:, :2].T / leaning[at]).sum(axis=0)
    return Facing(cosine=float(cosines.mean()), apart=_apart(cosines, ways))


def _apart(cosines: Doubles | Floats, ways: Doubles | Floats) -> float:
    """Return by how much cosines (point,) differ among ways out (2, point) of the same sector."""
    sector = np.floor((np.arctan2(ways[1], ways[0]) / (2 * np.pi) + 0.5) * SECTORS).astype(np.intp) % SECTORS
    count = np.bincount(sector, minlength=SECTORS)
    means = np.bincount(sector, weights=cosines, minlength=SECTORS) / np.maximum(count, 1)
    return float(np.sqrt(np.mean((cosines - means[sector]) ** 2)))


def _ends(
    light: NDArray[np.float32], rim: NDArray[np.bool_], right: Doubles | Floats, up: Doubles | Floats
) -> NDArray[np.bool_]:
    """Return whether light ends beyond the points of a rim, in the ways out of it: where it goes on, a body may."""
    rows, cols = np.nonzero(rim)
    beyond = np.rint(rows - BEYOND * up).astype(np.intp), np.rint(cols + BEYOND * right).astype(np.intp)
    there = light[tuple(np.clip(at, 0, size - 1) for at, size in zip(beyond, light.shape, strict=True))]
    return np.asarray(there < np.float32(DARKER) * light[rows, cols])


def _far_from_unseen(shown: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which points have none near them that some light does not show."""
    reach = 2 * int(BEYOND) + 1
    return np.asarray(cv2.erode(shown.astype(np.uint8), np.ones((reach, reach), np.uint8)) > 0)


def _ways_out(subject: NDArray[np.bool_]) -> tuple[Floats, Floats, Floats]:
    """Return how far every point of a subject lies from its outline, and the way out: the slope of the smoothed subject
    to the right and up."""
    inside = subject.astype(np.uint8)
    away = cv2.distanceTransform(cv2.copyMakeBorder(inside, 1, 1, 1, 1, cv2.BORDER_REPLICATE), cv2.DIST_L2, 5)
    soft = cv2.GaussianBlur(inside.astype(np.float32), (0, 0), BLUR, borderType=cv2.BORDER_REPLICATE)
    right, down = (
        cv2.Sobel(soft, cv2.CV_32F, across, 1 - across, scale=1 / 8, borderType=cv2.BORDER_REPLICATE)
        for across in (1, 0)
    )
    return np.asarray(away[1:-1, 1:-1], np.float32), np.asarray(-right, np.float32), np.asarray(down, np.float32)
