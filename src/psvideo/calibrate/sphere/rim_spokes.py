"""What the spokes across a sphere's rim show: how likely each place of the rim is on each of them.

Some spokes are misled (a stand, a mirrored window along the rim), so on each the rim may with a small chance be
anywhere. Odds are logarithms, against chance.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.calibrate.sphere.rim_model import SHIFT_PX, Surface, across_rim, likely_blur, log_likelihood
from psvideo.calibrate.sphere.sphere_view import SphereView
from psvideo.model.arrays import Doubles, Floats

MISLED = 0.05
"""Chance that on a spoke something else than the rim is seen."""
REACH_SHARE, LEAST_REACH_PX, MOST_REACH_PX = 0.045, 8.0, 60.0
"""How far to both sides of the rim the picture counts."""
SPOKE_PX, FEWEST_SPOKES, MOST_SPOKES = 8.0, 48, 144
AGREES = 1.1
"""A spoke agrees with an outline where the rim is likelier there than on average, by this factor at least."""
WAVERS_PX, WAVERS_PER_BLUR = 0.3, 0.3
"""How far the result of one spoke may be off by itself (standard deviation), in pixels and per pixel of blur."""
BLURS_PX = (0.3, 0.45, 0.6, 0.8, 1.1, 1.5, 2.0, 2.7, 3.6, 5.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class Spokes:
    """What the spokes show: logarithms of odds (spoke, shift), how each spoke's rim moves with the outline's numbers
    (spoke, number), where the spokes cross the outline they were taken at (spoke, 2), that outline, and the blur."""

    odds: Doubles
    slopes: Doubles
    rim: Doubles
    around: Doubles
    most_px: float
    blur_px: float


def spokes_of(
    pictures: Sequence[Floats],
    view: SphereView,
    place: Doubles,
    surface: Surface,
    most_px: float,
    *,
    most_spokes: int = MOST_SPOKES,
    blurs: Sequence[float] = BLURS_PX,
    mirrored: bool = False,
) -> Spokes:
    """Return what spokes across an outline (5,) show up to ``most_px`` to both of its sides.

    ``blurs`` are the blurs in pixels among which the likeliest is taken; ``mirrored``: edges of the room may show
    within the rim.
    """
    reach_px = float(np.clip(np.ceil(REACH_SHARE * place[2]), LEAST_REACH_PX, MOST_REACH_PX))
    reach_px = max(reach_px, most_px + LEAST_REACH_PX / 2)
    count = int(np.clip(2 * np.pi * place[2] / SPOKE_PX, FEWEST_SPOKES, most_spokes))
    values, rim = across_rim(pictures, view, place, reach_px=reach_px, spokes=count)
    few = values[:, :: max(count // 48, 1)]
    blur_px = likely_blur(few, reach_px=reach_px, most_px=most_px, surface=surface, blurs=blurs)
    logs = log_likelihood(
        values, blur_px=blur_px, reach_px=reach_px, most_px=most_px, surface=surface, mirrored=mirrored
    )
    wavers_px = float(np.hypot(WAVERS_PX, WAVERS_PER_BLUR * blur_px))
    return Spokes(
        odds=_odds(logs, wavers_px),
        slopes=_slopes(view, rim, place),
        rim=rim,
        around=place,
        most_px=most_px,
        blur_px=blur_px,
    )


def _odds(logs: Doubles, wavers_px: float) -> Doubles:
    """Return the logarithm of how much likelier each shift is than chance, where a spoke may waver or be misled."""
    likely = np.exp(logs - logs.max(axis=1, keepdims=True))
    likely = likely @ _spread(likely.shape[1], wavers_px)
    likely /= likely.mean(axis=1, keepdims=True)
    odds: Doubles = np.log((1 - MISLED) * likely + MISLED)
    return odds


def _spread(count: int, width_px: float) -> Doubles:
    """Return the matrix (shift, shift) that blurs the odds of shifts by a standard deviation."""
    away = (np.arange(count)[:, None] - np.arange(count)) * SHIFT_PX / width_px
    kernel = np.exp(-0.5 * away**2)
    spread: Doubles = kernel / kernel.sum(axis=0)
    return spread


def _slopes(view: SphereView, rim: Doubles, place: Doubles) -> Doubles:
    """Return how far the rim moves outward on every spoke per unit of the outline's free numbers."""
    here = view.distance_px(rim, place)
    steps = np.diag([0.5, 0.5, 0.5, 1e-4, 1e-4])[: view.unknowns]
    return np.stack([(here - view.distance_px(rim, place + step)) / step.sum() for step in steps], axis=1)


def agreeing(spokes: Spokes, place: Doubles, free: int) -> tuple[NDArray[np.bool_], float]:
    """Return which spokes agree with an outline, and the evidence of all."""
    odds = looked_up(spokes.odds, spokes.slopes @ (place - spokes.around)[:free], spokes.most_px)
    agree: NDArray[np.bool_] = np.asarray(odds > np.log(AGREES), np.bool_)
    return agree, float(odds.sum())


def widened(odds: Doubles, width_px: float) -> Doubles:
    """Return odds of a rim that may lie off by ``width_px`` (standard deviation)."""
    if width_px == 0:
        return odds
    likely = np.exp(odds) @ _spread(odds.shape[1], width_px)
    wider: Doubles = np.log(likely / likely.mean(axis=1, keepdims=True))
    return wider


def looked_up(odds: Doubles, shift_px: Doubles, most_px: float) -> Doubles:
    """Return odds at one shift per spoke, (spoke,) or (outline, spoke), between the ones tried; beyond them, of a spoke
    that is misled."""
    shifts = odds.shape[1]
    at = (shift_px + most_px) / SHIFT_PX
    low = np.minimum(np.maximum(at.astype(np.intp), 0), shifts - 2)  # np.clip takes longer than all the rest
    share = np.minimum(np.maximum(at - low, 0.0), 1.0)
    flat = np.arange(0, odds.size, shifts) + low
    between: Doubles = odds.take(flat) * (1 - share) + odds.take(flat + 1) * share
    beyond: NDArray[np.bool_] = np.abs(shift_px) > most_px
    return np.where(beyond, np.log(MISLED), between)
