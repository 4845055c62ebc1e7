"""Looking for round outlines in a picture: edges vote for the centres of circles, radius by radius.

Every edge says which way it faces, so for a given radius it votes for two centres only, one on either side (a sphere
may be darker or brighter than what is behind it). A circle's votes are counted as a share of its circumference.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from psvideo.model.arrays import Doubles, Floats

SMALL_PX = 400
"""The longer side of the picture in which circles are looked for."""
RADII = 100
LEAST_RADIUS_PX = 10.0
"""In the small picture; there a sphere is a fortieth of its width."""
LARGEST_SHARE = 0.75
"""The largest radius over the picture's shorter side: a sphere may be cut, but must show most of its outline."""
SMOOTHING_PX = 1.2
NEIGHBOURHOOD_PX = 31


@dataclass(frozen=True, kw_only=True)
class RoundThing:
    """A circle that edges voted for, in pixels; ``votes`` is their share of its circumference."""

    x: float
    y: float
    radius: float
    votes: float


def round_things(picture: Floats, *, count: int = 6) -> list[RoundThing]:
    """Return the best circles of a picture (row, col) in the order of their votes times the root of their radius.

    Longer outlines count more at the same share, as they come less by chance. Circles that nearly coincide with a
    better one are left out.
    """
    scale = min(1.0, SMALL_PX / max(picture.shape))
    small = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA).astype(np.float32)
    points, facing = _edges(small)
    if len(points) < 20:
        return []
    largest = LARGEST_SHARE * min(small.shape)
    found = [
        _best_centre(points, facing, radius, small.shape) for radius in np.geomspace(LEAST_RADIUS_PX, largest, RADII)
    ]
    found.sort(key=lambda one: one.votes * np.sqrt(one.radius), reverse=True)
    apart: list[RoundThing] = []
    for one in found:
        if all(_differ(one, other) for other in apart):
            apart.append(one)
    half = 0.5 / scale - 0.5
    return [
        RoundThing(x=one.x / scale + half, y=one.y / scale + half, radius=one.radius / scale, votes=one.votes)
        for one in apart[:count]
    ]


def _differ(one: RoundThing, other: RoundThing) -> bool:
    apart = np.hypot(one.x - other.x, one.y - other.y) + abs(one.radius - other.radius)
    return bool(apart > 0.12 * max(one.radius, other.radius))


def _edges(picture: Floats) -> tuple[Doubles, Doubles]:
    """Return edge points (edge, 2) and the unit gradients there, faint ones too where all around is even fainter."""
    smooth = cv2.GaussianBlur(picture, (0, 0), SMOOTHING_PX)
    across = cv2.Sobel(smooth, cv2.CV_32F, 1, 0, ksize=3)
    down = cv2.Sobel(smooth, cv2.CV_32F, 0, 1, ksize=3)
    steep = np.hypot(across, down)
    beside = cv2.blur(steep, (NEIGHBOURHOOD_PX, NEIGHBOURHOOD_PX))
    strength = steep / (beside + 0.5 * np.median(steep) + 1e-6)
    unit = np.stack([across, down], axis=-1) / (steep + 1e-9)[..., None]
    rows, cols = np.mgrid[: picture.shape[0], : picture.shape[1]].astype(np.float32)
    ahead, behind = (
        cv2.remap(steep, cols + side * unit[..., 0], rows + side * unit[..., 1], cv2.INTER_LINEAR) for side in (1, -1)
    )
    crest = (steep >= ahead) & (steep > behind)
    crest[:3] = crest[-3:] = crest[:, :3] = crest[:, -3:] = False
    if not crest.any():
        return np.zeros((0, 2)), np.zeros((0, 2))
    crest &= strength > max(float(np.quantile(strength[crest], 0.6)), 1.5)
    return np.argwhere(crest)[:, ::-1].astype(np.float64), unit[crest].astype(np.float64)


def _best_centre(points: Doubles, facing: Doubles, radius: float, shape: tuple[int, ...]) -> RoundThing:
    """Return the circle of one radius with most votes."""
    rows, cols = shape
    centres = np.concatenate([points + radius * facing, points - radius * facing]).round().astype(np.int64)
    inside = ((centres >= 0) & (centres < (cols, rows))).all(axis=1)
    places = centres[inside, 1] * cols + centres[inside, 0]
    votes = np.bincount(places, minlength=rows * cols).reshape(rows, cols).astype(np.float32)
    blur = max(1.0, 0.02 * radius)
    votes = cv2.GaussianBlur(votes, (0, 0), blur) * (2 * np.pi * blur**2)
    row, col = np.unravel_index(int(votes.argmax()), votes.shape)
    return RoundThing(x=float(col), y=float(row), radius=radius, votes=float(votes[row, col] / (2 * np.pi * radius)))
