"""How strong each light truly was, from plates of any scene under lights whose directions are known.

As ``calibrate/cho2020.py`` measures them, on the points at which a report looks at the rig.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.calibrate.cho2020 import LEAST_REACHED, fitted
from psvideo.model.arrays import Doubles

SHADOW = 0.1
"""A light reaches a point that gets this share of the brightest one's from it."""
WEAK, FAINT = 0.25, 0.01
"""A light that the rig says is weaker than the first share of the strongest reaches a point by what it sends, too. Less
light than the second, of saturation, says nothing of such a light: black levels are off by up to a tenth of it."""
LEAST_POINTS, MOST_POINTS = 100, 800
"""Of fewer, under every light, nothing is said; more than the second are not needed."""
FEWEST_LIGHTS = 8
"""Under fewer, strengths explain too much: of 16 right sets of five lights 4 came out as wrong, of six 2, of 45 sets of
8 to 12 none; and of six lights of which one is off, another was named in every third set."""


@dataclass(frozen=True, kw_only=True)
class LampStrengths:
    """``ratios`` (light,) are strengths over what the rig says, 1 for the median light. ``left`` and ``left_free`` are
    the typical share of a point's light that no normal explains under the rig's strengths and under these, which turn
    a typical normal by ``turned_deg``."""

    ratios: tuple[float, ...]
    left: float
    left_free: float
    turned_deg: float


def reaches(light: Doubles, vectors: Doubles, share: float, *, white: Doubles | float) -> NDArray[np.bool_]:
    """Return which lights reach a point, (point, light): they give more than a share of the brightest one's ``light``,
    as it is or, of lights that the rig calls weak, over what it sends, ``vectors`` (point or 1, light, 3). ``white``
    (point, light) is the light that saturates."""
    sizes = np.maximum(np.linalg.norm(vectors, axis=2), 1e-12)
    even = light / sizes
    by_rig = (even > share * even.max(axis=1, keepdims=True)) & (light > FAINT * white)
    weak = sizes < WEAK * sizes.max(axis=1, keepdims=True)
    return np.asarray((light > share * light.max(axis=1, keepdims=True)) | (by_rig & weak))


def lamp_strengths(light: Doubles, vectors: Doubles, *, white: Doubles | float = 1.0) -> LampStrengths | None:
    """Return the strengths that explain points best: ``light`` (point, light), 0 where it is not known, of ``white``
    (point, light) where it saturates, and ``vectors`` (point or 1, light, 3), what the rig sends there. None under
    fewer than FEWEST_LIGHTS, or where a light reaches too few points."""
    used = reaches(light, vectors, SHADOW, white=white) & (light > 0)
    enough = np.flatnonzero(used.sum(axis=1) >= LEAST_REACHED)
    if light.shape[1] < FEWEST_LIGHTS or len(enough) < LEAST_POINTS:
        return None
    some = enough[np.linspace(0, len(enough) - 1, min(len(enough), MOST_POINTS)).astype(np.intp)]
    unit = light[some] / np.linalg.norm(light[some], axis=1, keepdims=True)
    sent = np.broadcast_to(vectors if len(vectors) == 1 else vectors[some], (len(some), *vectors.shape[1:]))
    if used[some].sum(axis=0).min() < LEAST_POINTS:
        return None
    as_told = fitted(unit, sent, used[some], free=False)
    freely = fitted(unit, sent, used[some], free=True)
    if as_told is None or freely is None:
        return None
    cosines = (as_told.normals * freely.normals).sum(axis=1)
    return LampStrengths(
        ratios=tuple((1 / freely.inverse).tolist()),
        left=as_told.left,
        left_free=freely.left,
        turned_deg=float(np.degrees(np.median(np.arccos(np.clip(cosines, -1, 1))))),
    )
