"""Whether plates were read by another transfer curve than they were recorded with.

A curve bends light alike for all normals, and the lights of a rig explain bent light worse than straight light.
"""

from dataclasses import dataclass

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.model.srgb import srgb_share

STEPS = 1025
SHADOW = 0.08
"""A pixel is reached by all lights where each gives at least this share of the brightest."""
LEAST_POINTS = 60


@dataclass(frozen=True, kw_only=True)
class OtherCurves:
    """Which share of a point's light no normal explains, once the plates are bent: ``undone`` as if what was read as
    light were sRGB's signal, ``redone`` as if light were read as that signal."""

    undone: float
    redone: float


def other_curves(light: Doubles, beyond: Doubles, *, white: Doubles) -> OtherCurves:
    """Return what points (point, light) leave over under other curves, which bend what the sensor saw: the share of the
    light that saturates, ``white`` (point, light). ``beyond`` projects to what no normal explains, (light, light)."""
    share = light / white
    steps = np.linspace(0, 1, STEPS) ** 2.4  # as finely where sRGB is steep
    signals = srgb_share(steps.astype(np.float32))
    undone = np.interp(share, signals, steps) * white
    reached = undone.min(axis=1) > SHADOW * undone.max(axis=1)  # shadow that sRGB makes brighter is shadow after all
    if reached.sum() < LEAST_POINTS:
        reached[:] = True
    return OtherCurves(
        undone=_left_over(undone[reached], beyond),
        redone=_left_over(np.interp(share, steps, signals) * white, beyond),
    )


def _left_over(light: Doubles, beyond: Doubles) -> float:
    sizes = np.maximum(np.linalg.norm(light, axis=1), 1e-12)
    return float(np.median(np.linalg.norm(light @ beyond, axis=1) / sizes))
