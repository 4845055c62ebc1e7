"""The filter on phase and rate: a Kalman filter whose clock runs straight between measurements (Kalman 1960).

Measured is by how much all flashes of a window of frames come later than the clock says; the state is that shift and
the clock's rate. Windows overlap, and each counts only as much as is new in it. Looking back, ``smoothed`` gives what
all measurements together say of every moment (Rauch, Tung and Striebel 1965).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.sync.rowfit.beat import FoundClock

WANDER_PPM = 1.0
"""By how much a rate may wander in a second (as the root of the seconds): boards and cameras that warm up."""
LEAST_ERROR_S = 2e-8
"""No window is believed to be surer than this: edges are softer than a model."""


@dataclass(frozen=True, kw_only=True)
class Measured:
    """A window's word: at ``at_s`` flashes came ``late_s`` later than some clock says, give or take ``error_s``."""

    at_s: float
    late_s: float
    error_s: float


@dataclass(frozen=True, kw_only=True)
class PhaseFilter:
    """The clock as it is known at ``at_s``, and the covariance (2, 2) of its shift (s) and its rate (ppm)."""

    clock: FoundClock
    at_s: float
    covariance: Doubles

    @property
    def error_s(self) -> float:
        """The standard error of the phase."""
        return float(np.sqrt(self.covariance[0, 0]))

    def error_at_s(self, at_s: float) -> float:
        """Return the standard error of the phase at another time."""
        return float(np.sqrt(_grown(self.covariance, at_s - self.at_s)[0, 0]))

    def corrected(self, at_s: float, shift_s: float, error_s: float) -> "PhaseFilter":
        """Return the filter after a window at ``at_s`` was seen to come ``shift_s`` later than the clock says."""
        before = _grown(self.covariance, at_s - self.at_s)
        known = max(error_s, LEAST_ERROR_S) ** 2
        gain = before[:, 0] / (before[0, 0] + known)
        clock = self.clock.shifted(float(gain[0]) * shift_s, float(gain[1]) * shift_s, pivot_s=at_s)
        return replace(self, clock=clock, at_s=at_s, covariance=before - np.outer(gain, before[0]))


def started(clock: FoundClock, at_s: float, error_s: float, error_ppm: float) -> PhaseFilter:
    """Return a filter that begins with a clock and its errors."""
    return PhaseFilter(clock=clock, at_s=at_s, covariance=np.diag([error_s**2, error_ppm**2]))


def smoothed(points: Sequence[Measured]) -> Doubles:
    """Return the shifts (measurement,) at the times of the measurements that all of them together give."""
    first = points[0]
    state, covariance = np.array([first.late_s, 0.0]), np.diag([first.error_s**2, 1e6])
    states, kept, ahead = [state], [covariance], []
    for before, point in pairwise(points):
        step = point.at_s - before.at_s
        guess, grown = _forward(step) @ state, _grown(covariance, step)
        gain = grown[:, 0] / (grown[0, 0] + max(point.error_s, LEAST_ERROR_S) ** 2)
        state, covariance = guess + gain * (point.late_s - guess[0]), grown - np.outer(gain, grown[0])
        states.append(state)
        kept.append(covariance)
        ahead.append((step, guess, grown))
    later = states[-1]
    found = [later[0]]
    for (step, guess, grown), own, covariance in zip(reversed(ahead), states[-2::-1], kept[-2::-1], strict=True):
        back = covariance @ _forward(step).T @ np.linalg.inv(grown)
        later = own + back @ (later - guess)
        found.append(later[0])
    return np.array(found[::-1])


def _forward(step_s: float) -> Doubles:
    return np.array([[1.0, 1e-6 * step_s], [0.0, 1.0]])


def _grown(covariance: Doubles, step_s: float) -> Doubles:
    """Return what is known after a time without measurements, before or after."""
    forward, wander = _forward(step_s), WANDER_PPM**2 * abs(step_s)
    lever = 1e-6 * step_s
    noise = wander * np.array([[lever**2 / 3, lever / 2], [lever / 2, 1.0]])
    grown: Doubles = forward @ covariance @ forward.T + noise
    return grown
