"""Bright spots inside a mirror sphere's outline: where each is, how well that is known, and which can be no highlight.

Spots are compact and bright. What is as bright in most other lights' pictures at the same place is no highlight of this
light (a window, a white object that every light lights), and neither is what covers much of the sphere.

A spot's place is the centroid of its light above a threshold. It is taken at several thresholds: how far the place
moves with them says how well it is known. A clipped spot is flat on top, and around it are glare and the streaks of
scratches; there pixels count by how deep inside the spot they lie, so that its round core decides, not thin arms.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles

LEVELS = (0.1, 0.2, 0.35, 0.5)
CLIPPED_LEVELS = (0.8, 0.9, 0.98)
"""Thresholds, as shares of a spot's peak, at which its centroid is taken."""
CANDIDATE_LEVEL = 0.3
"""Spots dimmer than this share of the brightest thing inside the outline are no candidates."""
LARGEST_SPOT = 0.06
"""Share of the sphere's disc that a highlight may cover; a matte sphere's shading covers far more."""
USUAL_SPOT = 0.004
"""Share of the disc of a lamp 14 degrees wide. Light in larger spots counts less: by the area squared."""
SKIRT_PX = 2
"""How far beyond the candidate's edge its light is counted: a small spot's flanks show where it is."""
FEW_CLIPPED = 40
"""This many clipped pixels do not yet hide where a spot's middle is: its flanks show it."""
STATIC = 0.6
"""A spot that is this bright under half of the other lights too, relative to its own peak, is not this light's."""
PLACE_ERROR_PX = 0.1
SPOT_ERROR_SHARE = 0.04
"""What a centroid may be off in any case: in pixels, and as a share of the spot's radius (its shape is not known)."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Spot:
    """A bright spot: its place (x, y) and standard error in pixels, area in pixels, and why it was not chosen."""

    place: Doubles
    error_px: float
    area_px: float
    peak: float
    score: float
    clipped: bool
    why_not: str = ""

    @property
    def radius_px(self) -> float:
        """The radius of a disc of the spot's area."""
        return float(np.sqrt(self.area_px / np.pi))


def spots_of(
    light: NDArray[np.float32],
    n: int,
    smooth: NDArray[np.float32],
    clipped: NDArray[np.bool_],
    corner: tuple[int, int],
    disc_px: int,
) -> list[Spot]:
    """Return the bright spots of one light's picture (light, row, col), the best first."""
    picture = light[n]
    bright = (smooth >= CANDIDATE_LEVEL * smooth.max()).astype(np.uint8)
    count, labels, boxes, _ = cv2.connectedComponentsWithStats(bright)
    order = np.argsort(boxes[1:, cv2.CC_STAT_AREA])[::-1][:8] + 1
    usual_px = USUAL_SPOT * disc_px
    spots = []
    for label in order[: count - 1]:
        left, top, wide, tall = (int(value) for value in boxes[label, :4])
        left, top, right, bottom = max(left - SKIRT_PX, 0), max(top - SKIRT_PX, 0), left + wide, top + tall
        cut = np.s_[top : bottom + SKIRT_PX, left : right + SKIRT_PX]
        mine = cv2.dilate((labels[cut] == label).astype(np.uint8), np.ones((2 * SKIRT_PX + 1,) * 2, np.uint8)) > 0
        mine &= (labels[cut] == label) | (labels[cut] == 0)
        others = [light[k][cut][labels[cut] == label] for k in range(len(light)) if k != n]
        own = labels[cut] == label
        spot = _spot(np.where(mine, picture[cut], 0.0), clipped[cut] & mine, (corner[0] + top, corner[1] + left))
        spot = replace(spot, score=spot.score / (1 + (spot.area_px / usual_px) ** 2))
        spots.append(_judged(spot, picture[cut][own], others, disc_px))
    return sorted(spots, key=lambda one: one.score, reverse=True)


def _spot(values: NDArray[np.floating], clipped: NDArray[np.bool_], corner: tuple[int, int]) -> Spot:
    """Return a spot's place and size from its cut-out of the picture, dark elsewhere."""
    peak = float(values.max())
    rows, cols = np.mgrid[: values.shape[0], : values.shape[1]].astype(np.float64)
    places, areas = [], []
    is_clipped = int(np.count_nonzero(clipped)) > FEW_CLIPPED
    for level in CLIPPED_LEVELS if is_clipped else LEVELS:
        core = _largest(values >= level * peak)
        depth = cv2.distanceTransform(np.pad(core, 1).astype(np.uint8), cv2.DIST_L2, 5)[1:-1, 1:-1]
        weight = depth.astype(np.float64) if is_clipped else np.where(core, values - 0.95 * level * peak, 0.0)
        x, y = (float((weight * along).sum() / weight.sum()) for along in (cols, rows))
        places.append((x + corner[1], y + corner[0]))
        areas.append(float(core.sum()))
    half = _largest(values >= 0.5 * peak)
    drawn = _drawn_out(np.where(half, 1.0, 0.0), cols - cols[half].mean(), rows - rows[half].mean())
    at = np.array(places)
    spread = float(np.sqrt(at.var(axis=0, ddof=1).sum() / 2))
    radius = np.sqrt(areas[1] / np.pi)
    return Spot(
        place=at.mean(axis=0),
        error_px=float(np.sqrt(PLACE_ERROR_PX**2 + spread**2 + (SPOT_ERROR_SHARE * radius) ** 2)),
        area_px=areas[1],
        peak=peak,
        score=float(values.sum()) / drawn,
        clipped=is_clipped,
    )


def _largest(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the largest connected part of a mask."""
    _, labels, boxes, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8))
    return np.asarray(labels == 1 + int(np.argmax(boxes[1:, cv2.CC_STAT_AREA])), np.bool_)


def _drawn_out(weight: Doubles, x: Doubles, y: Doubles) -> float:
    """Return how many times longer than wide a spot is, by its second moments."""
    total = weight.sum()
    moments = np.array([[(weight * a * b).sum() / total for a in (x, y)] for b in (x, y)]) + np.eye(2) / 12
    small, large = np.linalg.eigvalsh(moments)
    return float(np.sqrt(large / small))


def _judged(spot: Spot, own: NDArray[np.floating], others: Sequence[NDArray[np.floating]], disc_px: int) -> Spot:
    """Give a spot that cannot be a highlight the reason why, and no score."""
    why = ""
    if spot.area_px > LARGEST_SPOT * disc_px:
        why = f"it covers {spot.area_px / disc_px:.0%} of the sphere: no mirrored lamp, or far too bright"
    elif others and np.median([float(other.mean()) for other in others]) > STATIC * float(own.mean()):
        why = "the same spot is as bright under the other lights"
    if not why:
        return spot
    return replace(spot, score=0.0, why_not=why)
