"""The highlight of a light on a mirror sphere, chosen among the bright spots inside its outline.

Of the spots that can be highlights (``spots``) the one that sends most light without being too large or too drawn out
is taken; a second one nearly as good makes it doubtful. What is larger than lamps are is none either where another
light shows it in the same place, or where the other lights' highlights are far smaller: a table or a wall that stands
near, and only this light reaches.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.calibrate.light_pictures import LightPictures
from psvideo.calibrate.mirror.spots import USUAL_SPOT, Spot, spots_of
from psvideo.calibrate.sphere.outline import Outline

RIM = 0.97
"""Share of the radius up to which highlights are looked for: beyond, a light would stand behind the sphere."""
DARK_PEAK = 0.02
"""A peak below this share of saturation, or of the other lights' peaks, is no highlight."""
ODD_SIZE = 10.0
"""A spot larger than a lamp's that covers this many times as much as the other lights' highlights do is none."""
FLOODED = 0.3
"""From this share of the disc on that is clipped in all channels, a picture shows no highlight, nor what is static."""
ALIKE = 0.5
"""A second spot with more than this share of the first one's score makes the choice doubtful."""


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
        spots = [] if fault else spots_of(light, n, smooth[n], clipped[n], corner, int(disc.sum()))
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
