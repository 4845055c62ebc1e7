"""The filter on phase, rate and drift: a Kalman filter whose clock drifts evenly between measurements (Kalman 1960).

Measured is by how much all flashes of a window of frames come later than the clock says; the state is that shift, the
clock's rate, and by how much the rate drifts: a board that warms up drifts for minutes, and a filter that knew of no
drift would lag behind it and not say so. Windows overlap, and each counts only as much as is new in it. Looking back,
``smoothed`` gives what all measurements together say of every moment (Rauch, Tung and Striebel 1965).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.sync.rowfit.beat import FoundClock

WANDER_PPM = 1.0
"""By how much a rate may wander in a second (as the root of the seconds), beside its drift."""
HELD_WANDER_PPM = 5.0
"""The same of a strobe that is trimmed, of which no drift is estimated: 5 ppm a second of drift, or 30 ppm that wander
in 20 s, are followed within 2 errors; with 1 they were off by 5 to 13."""
DRIFT_PPM_PER_S = 5.0
"""How fast a rate may drift when it is found: of a board on a ceramic resonator, just switched on."""
DRIFT_WANDERS = 1.0
"""By how much a drift may wander in a second (as the root of the seconds), in ppm a second."""
LEAST_ERROR_S = 2e-8
"""No window is believed to be surer than this: edges are softer than a model."""
UNKNOWN_PPM = 1e3
"""What may be believed of a rate before anything is measured."""
US = 1e6
"""A shift in the state is in microseconds: a rate is one of them a second, and all parts are of one size."""


@dataclass(frozen=True, kw_only=True)
class Measured:
    """A window's word: at ``at_s`` flashes came ``late_s`` later than some clock says, give or take ``error_s``."""

    at_s: float
    late_s: float
    error_s: float

    @property
    def variance(self) -> float:
        """The square of its error, in us ** 2."""
        return (max(self.error_s, LEAST_ERROR_S) * US) ** 2


@dataclass(frozen=True, kw_only=True)
class PhaseFilter:
    """The clock as it is known at ``at_s``, its drift, and the covariance (3, 3) of its shift (us), its rate (ppm) and
    its drift (ppm/s). ``wander_ppm`` and ``drift_wanders``: by how much rate and drift may change, as ``WANDER_PPM``
    and ``DRIFT_WANDERS``."""

    clock: FoundClock
    at_s: float
    covariance: Doubles
    drift_ppm_per_s: float = 0.0
    wander_ppm: float = WANDER_PPM
    drift_wanders: float = DRIFT_WANDERS

    def error_at_s(self, at_s: float) -> float:
        """Return the standard error of the phase, in seconds, at any time."""
        return float(np.sqrt(self._grown(at_s - self.at_s)[0, 0])) / US

    def corrected(self, measured: Measured) -> "PhaseFilter":
        """Return the filter after a window; its ``late_s`` is against this filter's own clock."""
        step_s = measured.at_s - self.at_s
        before = self._grown(step_s)
        drifted_us, drifted_ppm, drift = _forward(step_s) @ [0.0, 0.0, self.drift_ppm_per_s]
        gain = before[:, 0] / (before[0, 0] + measured.variance)
        late_us, ppm, drift = gain * (measured.late_s * US - drifted_us) + [drifted_us, drifted_ppm, drift]
        clock = self.clock.shifted(float(late_us) / US, float(ppm), pivot_s=self.clock.unbent_s(measured.at_s))
        covariance = before - np.outer(gain, before[0])
        return replace(self, clock=clock, at_s=measured.at_s, covariance=covariance, drift_ppm_per_s=float(drift))

    def less_sure(self, error_s: float) -> "PhaseFilter":
        """Return the filter with a further error of its phase."""
        return replace(self, covariance=self.covariance + np.diag([(error_s * US) ** 2, 0.0, 0.0]))

    def without_drift(self) -> "PhaseFilter":
        """Return the filter of a clock whose rate only wanders, more: what it took for a drift is forgotten."""
        covariance = self.covariance * np.outer([1.0, 1.0, 0.0], [1.0, 1.0, 0.0])
        return replace(self, covariance=covariance, drift_ppm_per_s=0.0, wander_ppm=HELD_WANDER_PPM, drift_wanders=0.0)

    def _grown(self, step_s: float) -> Doubles:
        return _grown(self.covariance, step_s, self.wander_ppm, self.drift_wanders)


def started(clock: FoundClock, at_s: float, error_s: float, error_ppm: float) -> PhaseFilter:
    """Return a filter that begins with a clock and its errors."""
    return PhaseFilter(clock=clock, at_s=at_s, covariance=np.diag([error_s * US, error_ppm, DRIFT_PPM_PER_S]) ** 2)


def smoothed(points: Sequence[Measured]) -> Doubles:
    """Return the shifts (measurement,) at the times of the measurements that all of them together give, in seconds."""
    first = points[0]
    state = np.array([first.late_s * US, 0.0, 0.0])
    covariance = np.diag([first.variance, UNKNOWN_PPM**2, DRIFT_PPM_PER_S**2])
    states, kept, ahead = [state], [covariance], []
    for before, point in pairwise(points):
        step_s = point.at_s - before.at_s
        guess, grown = _forward(step_s) @ state, _grown(covariance, step_s, WANDER_PPM, DRIFT_WANDERS)
        gain = grown[:, 0] / (grown[0, 0] + point.variance)
        state, covariance = guess + gain * (point.late_s * US - guess[0]), grown - np.outer(gain, grown[0])
        states.append(state)
        kept.append(covariance)
        ahead.append((step_s, guess, grown))
    later = states[-1]
    found = [later[0]]
    for (step_s, guess, grown), own, covariance in zip(reversed(ahead), states[-2::-1], kept[-2::-1], strict=True):
        back = covariance @ _forward(step_s).T @ np.linalg.inv(grown)
        later = own + back @ (later - guess)
        found.append(later[0])
    return np.array(found[::-1]) / US


def _forward(step_s: float) -> Doubles:
    """Return how shift, rate and drift go on for a time."""
    return np.array([[1.0, step_s, 0.5 * step_s**2], [0.0, 1.0, step_s], [0.0, 0.0, 1.0]])


def _grown(covariance: Doubles, step_s: float, wander_ppm: float, drift_wanders: float) -> Doubles:
    """Return what is known after a time without measurements, before or after: rate and drift wander meanwhile."""
    forward, t = _forward(step_s), step_s
    rate = np.array([[t**2 / 3, t / 2, 0.0], [t / 2, 1.0, 0.0], [0.0, 0.0, 0.0]])
    drift = np.array([[t**4 / 20, t**3 / 8, t**2 / 6], [t**3 / 8, t**2 / 3, t / 2], [t**2 / 6, t / 2, 1.0]])
    noise = abs(t) * (wander_ppm**2 * rate + drift_wanders**2 * drift)
    grown: Doubles = forward @ covariance @ forward.T + noise
    return grown
