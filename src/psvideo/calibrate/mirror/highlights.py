"""The highlight of a light on a mirror sphere, separated from other bright spots.

Candidates are the compact bright spots inside the outline. What is as bright in most other lights' pictures at the
same place is no highlight of this light (a window, a white object that every light lights). Of the rest, the one that
sends most light without being too large or too drawn out is taken; a second one nearly as good makes it doubtful.
What is larger than lamps are is none either where another light shows it in the same place, or where the other lights'
highlights are far smaller: a table or a wall that stands near, and only this light reaches.

A spot's place is the centroid of its light above a threshold. It is taken at several thresholds: how far the place
moves with them says how well it is known. A clipped spot is flat on top, and around it are glare and the streaks of
scratches; there pixels count by how deep inside the spot they lie, so that its round core decides, not thin arms.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.calibrate.light_pictures import LightPictures
from psvideo.calibrate.sphere.outline import Outline
from psvideo.model.camera import FloatArray

LEVELS = (0.1, 0.2, 0.35, 0.5)
CLIPPED_LEVELS = (0.8, 0.9, 0.98)
"""Thresholds, as shares of a spot's peak, at which its centroid is taken."""
CANDIDATE_LEVEL = 0.3
"""Spots dimmer than this share of the brightest thing inside the outline are no candidates."""
RIM = 0.97
"""Share of the radius up to which highlights are looked for: beyond, a light would stand behind the sphere."""
DARK_PEAK = 0.02
"""A peak below this share of saturation, or of the other lights' peaks, is no highlight."""
LARGEST_SPOT = 0.06
"""Share of the sphere's disc that a highlight may cover; a matte sphere's shading covers far more."""
USUAL_SPOT = 0.004
"""Share of the disc of a lamp 14 degrees wide. Light in larger spots counts less: by the area squared."""
ODD_SIZE = 10.0
"""A spot larger than a lamp's that covers this many times as much as the other lights' highlights do is none."""
FLOODED = 0.3
"""From this share of the disc on that is clipped in all channels, a picture shows no highlight, nor what is static."""
SKIRT_PX = 2
"""How far beyond the candidate's edge its light is counted: a small spot's flanks show where it is."""
FEW_CLIPPED = 40
"""This many clipped pixels do not yet hide where a spot's middle is: its flanks show it."""
ALIKE = 0.5
"""A second spot with more than this share of the first one's score makes the choice doubtful."""
STATIC = 0.6
"""A spot that is this bright under half of the other lights too, relative to its own peak, is not this light's."""
PLACE_ERROR_PX = 0.1
SPOT_ERROR_SHARE = 0.04
"""What a centroid may be off in any case: in pixels, and as a share of the spot's radius (its shape is not known)."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Spot:
    """A bright spot: its place (x, y) and standard error in pixels, area in pixels, and why it was not chosen."""

    place: FloatArray
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


@dataclass(frozen=True, kw_only=True)
class FoundHighlight:
    """What was found of one light on one sphere in one picture: the highlight or why there is none, and other spots."""

    light: str
    highlight: Spot | None
    others: tuple[Spot, ...] = ()
    fault: str = ""
    alike: tuple[Spot, ...] = field(default=())


def find_highlights(pictures: LightPictures, outline: Outline) -> list[FoundHighlight]:
    """Return what is found of every light on one sphere."""
    disc, corner = _disc(pictures, outline)
    rows, cols = disc.shape
    top, left = corner
    crop = np.s_[:, top : top + rows, left : left + cols]
    light = np.where(disc, pictures.grey[crop], 0.0).astype(np.float32)
    clipped = pictures.saturated[crop]
    clipped = (clipped if clipped.ndim == 3 else clipped.all(axis=3)) & disc
    share = clipped.sum(axis=(1, 2)) / max(int(disc.sum()), 1)
    fit = share < FLOODED
    light[~fit] = 0.0
    light = np.where(fit[:, None, None], light - light[fit].min(axis=0), 0.0) if fit.sum() > 2 else light
    blur_px = max(0.7, 0.004 * outline.radius_px)
    smooth = [np.where(disc, cv2.GaussianBlur(one, (0, 0), blur_px), 0.0).astype(np.float32) for one in light]
    peaks = [float(one.max()) for one in smooth]
    usual = float(np.median(np.array(peaks)[fit])) if fit.any() else 0.0
    found = []
    for n, name in enumerate(pictures.names):
        fault = _too_dark(peaks[n], usual) if fit[n] else _flooded(float(share[n]))
        spots = [] if fault else _spots(light, n, smooth[n], clipped[n], corner, int(disc.sum()))
        found.append(_chosen(name, spots, fault))
    return _unlike_lamps(found, USUAL_SPOT * int(disc.sum()))


def _disc(pictures: LightPictures, outline: Outline) -> tuple[NDArray[np.bool_], tuple[int, int]]:
    """Return where inside the outline highlights may be, and the top left pixel (row, col) of that cut-out."""
    rim = outline.view.curve(outline.place)
    low = np.maximum(np.floor(rim.min(axis=0)).astype(int), 0)
    high = np.minimum(np.ceil(rim.max(axis=0)).astype(int), (pictures.width_px - 1, pictures.height_px - 1))
    cols, rows = np.meshgrid(np.arange(low[0], high[0] + 1), np.arange(low[1], high[1] + 1))
    points = np.stack([cols.ravel(), rows.ravel()], axis=1).astype(np.float64)
    inside = outline.view.distance_px(points, outline.place) < -(1 - RIM) * outline.radius_px
    return inside.reshape(rows.shape), (int(low[1]), int(low[0]))


def _flooded(share: float) -> str:
    return (
        f"{share:.0%} of the sphere is saturated in all channels, so that no highlight stands out: expose less, or dim "
        "the light"
    )


def _too_dark(peak: float, usual: float) -> str:
    if peak >= DARK_PEAK * max(usual, 1.0 if usual < DARK_PEAK else usual):
        return ""
    return (
        f"no highlight: the brightest place inside the outline has {peak:.2g} of saturation, and under the other "
        f"lights {usual:.2g}; the light is off, hidden from the sphere, or behind it"
    )


def _spots(
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


def _drawn_out(weight: FloatArray, x: FloatArray, y: FloatArray) -> float:
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


def _chosen(name: str, spots: list[Spot], fault: str) -> FoundHighlight:
    """Choose the highlight among spots, the best first."""
    fit = [spot for spot in spots if spot.score > 0]
    if not fit:
        reasons = "; ".join(dict.fromkeys(spot.why_not for spot in spots))
        return FoundHighlight(
            light=name, highlight=None, others=tuple(spots), fault=fault or f"no highlight: {reasons}"
        )
    alike = tuple(spot for spot in fit[1:] if spot.score > ALIKE * fit[0].score)
    return FoundHighlight(
        light=name, highlight=fit[0], others=tuple(spot for spot in spots if spot is not fit[0]), alike=alike
    )


def _unlike_lamps(found: Sequence[FoundHighlight], usual_px: float) -> list[FoundHighlight]:
    """Take back highlights larger than lamps that are seen under another light too, or that no other light has."""
    checked = []
    for one in found:
        others = [other for other in found if other is not one and other.highlight is not None]
        why = _unlike_lamp(one.highlight, others, usual_px) if one.highlight is not None else ""
        checked.append(
            FoundHighlight(light=one.light, highlight=None, others=(*_spot_of(one), *one.others), fault=why)
            if why
            else one
        )
    return checked


def _spot_of(found: FoundHighlight) -> tuple[Spot, ...]:
    return () if found.highlight is None else (found.highlight,)


def _unlike_lamp(spot: Spot, others: Sequence[FoundHighlight], usual_px: float) -> str:
    """Return what speaks against a highlight, given those of the other lights; empty where nothing does."""
    if spot.area_px <= usual_px or not others:
        return ""
    shown = [(other.light, mine) for other in others for mine in _spot_of(other)]
    same = [light for light, mine in shown if np.hypot(*(mine.place - spot.place)) < 0.5 * spot.radius_px]
    x, y = spot.place
    if same:
        return (
            f"no highlight: the brightest spot, at {x:.0f},{y:.0f}, is the brightest under {same[0]!r} too: something "
            "that both lights light, no lamp. Cover it or expose longer"
        )
    if spot.area_px > ODD_SIZE * float(np.median([mine.area_px for _, mine in shown])):
        return (
            f"no highlight: the brightest spot, at {x:.0f},{y:.0f}, is {spot.radius_px:.0f} pixels to each side, far "
            "wider than those of the other lights: something that the light reaches, no lamp. Cover it or expose longer"
        )
    return ""
