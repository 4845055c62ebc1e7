"""How far apart the levels lie that a picture's files can hold, where its subject is."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles
from psvideo.model.rows.clipping import SATURATED
from psvideo.report.observe.facts import DARKEST

AROUND = 3.0
"""Levels between a third of the subject's usual light and three times as much are looked at."""
FEWEST_LEVELS, PIXELS_EACH = 6, 4
"""So many levels at least are to be seen, each in so many pixels in the mean: of more, fine ones lack by chance."""
SMOOTH, MOSTLY = 1.6, 0.8
"""Steps of a file grow smoothly from level to level, by this factor at most between most of the neighbours: a subject
of a few even colours, without noise, has levels anywhere."""
STEP = 2
"""Every second row and column is looked at."""


def code_step(frames: Iterable[NDArray[np.float32]]) -> float | None:
    """Return by which share of its light one step of the files' levels changes the subject's, by the frame in which
    that is least; ``frames`` are linear light, (row, col[, channel]). None where levels are too fine to be told apart,
    or too few."""
    found = map(_step, frames)  # which holds none while the next one is made
    return min((step for step in found if step is not None), default=None)


def _step(frame: NDArray[np.float32]) -> float | None:
    channel = frame if frame.ndim == 2 else frame[..., frame.shape[2] // 2]
    light = channel[::STEP, ::STEP].ravel()
    light = light[np.isfinite(light) & (light < SATURATED)]
    if not light.size:
        return None
    subject = light[light > DARKEST * np.quantile(light, 0.99)]
    usual = float(np.median(subject)) if subject.size else 0.0
    near = subject[(subject > usual / AROUND) & (subject < usual * AROUND)]
    levels = np.unique(near).astype(np.float64)
    if usual <= 0 or len(levels) < FEWEST_LEVELS or near.size < PIXELS_EACH * len(levels):
        return None
    steps: Doubles = np.diff(levels)
    if np.mean(np.abs(np.diff(np.log(steps))) < np.log(SMOOTH)) < MOSTLY:
        return None
    return float(np.median(steps / levels[:-1]))
