"""How ambient light swings with the mains, as the fit of a clip's timing shows it.

Every window of frames gives each row a swing of its own, in proportion to the row's ambient light: what they have in
common is one amplitude and phase per window. Mains are off their nominal frequency by a little, by which the phase
turns from window to window; one frequency must explain all of them.
"""

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.model.rows.ripple import MOST_SWING, Ripple
from psvideo.sync.rowfit.compiled_profiles import brightnesses
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import Fit

MAINS_OFF_HZ = 0.5
"""Light pulses come this much faster or slower at most: twice what grids allow of 50 and 60 Hz."""
LEAST_WINDOWS = 3
"""Fewer windows do not show how far they are apart by chance."""
SURE = 5.0
"""Standard errors by which the swing must stand out."""


def mains_swing(plan: Plan, rows: Profiles, fit: Fit) -> Ripple | None:
    """Return the ripple of a clip whose fit found mains light, None where the windows do not agree on one."""
    if not fit.beat.beat_hz:
        return None
    at_s, amplitude, trust = _by_window(plan, rows, fit)
    if len(at_s) < LEAST_WINDOWS or not trust.any():
        return None
    step_hz = 0.1 / max(float(np.ptp(at_s)), rows.period_s)
    steps = int(np.ceil(MAINS_OFF_HZ / step_hz))
    off_hz = np.arange(-steps, steps + 1) * step_hz
    means = np.exp(-2j * np.pi * np.outer(off_hz, at_s)) @ (trust * amplitude) / trust.sum()
    best = int(np.abs(means).argmax())
    common = complex(means[best])
    left = np.abs(amplitude - common * np.exp(2j * np.pi * off_hz[best] * at_s))
    error = float(np.sqrt((trust**2 * left**2).sum() / (1 - 1.5 / len(at_s))) / trust.sum())
    if abs(common) > MOST_SWING or abs(common) < SURE * error:
        return None
    return Ripple(hz=fit.beat.beat_hz[0] + float(off_hz[best]), amplitude=common, error=error)


def _by_window(plan: Plan, rows: Profiles, fit: Fit) -> tuple[Doubles, NDArray[np.complex128], Doubles]:
    """Return the windows' middles, the amplitude against the nominal frequency, and what it is worth, (window,)."""
    bounds = np.append(rows.window_start, len(rows.value))
    found = []
    for first, last in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
        part = rows.take(slice(first, last)).one_window()
        light = brightnesses(plan, part, fit.beat, np.ascontiguousarray(fit.weight[first:last]))
        ambient, cosine, sine = light[:, 0], light[:, -2], light[:, -1]
        square = float((ambient**2).sum())
        turning = complex((ambient * cosine).sum(), -(ambient * sine).sum()) / max(square, 1e-30)
        found.append((float(part.frame_start_s.mean()), turning, square))
    middles_s, amplitudes, squares = zip(*found, strict=True)
    return np.array(middles_s), np.array(amplitudes, np.complex128), np.array(squares)
