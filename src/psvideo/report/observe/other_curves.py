"""Whether plates were read by another transfer curve than they were recorded with.

A curve bends light alike for all normals, and the lights of a rig explain bent light worse than straight light.
"""

from dataclasses import dataclass

import numpy as np

from psvideo.clip.transfer import find_curve, to_light
from psvideo.model.camera import FloatArray

CURVE = "srgb"


@dataclass(frozen=True, kw_only=True)
class OtherCurves:
    """Which share of a point's light no normal explains, once the plates are bent: ``undone`` as if what was read as
    light were sRGB's signal, ``redone`` as if light were read as that signal."""

    undone: float
    redone: float


def other_curves(light: FloatArray, beyond: FloatArray) -> OtherCurves:
    """Return what points (point, light), 1.0 = saturation, leave over under other curves; ``beyond`` projects to what
    no normal explains, (light, light)."""
    signals = np.linspace(0, 1, 1025)
    by_light = np.asarray(to_light(find_curve(CURVE), signals), np.float64)
    held = np.clip(light, 0, 1)
    return OtherCurves(
        undone=_left_over(np.interp(held, signals, by_light), beyond),
        redone=_left_over(np.interp(held, by_light, signals), beyond),
    )


def _left_over(light: FloatArray, beyond: FloatArray) -> float:
    sizes = np.maximum(np.linalg.norm(light, axis=1), 1e-12)
    return float(np.median(np.linalg.norm(light @ beyond, axis=1) / sizes))
