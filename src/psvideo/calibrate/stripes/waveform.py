"""The period of stripes to a small part of a row: a waveform of any shape, times the scene, fitted to row profiles.

Every profile g (one block of columns of one picture) has a smooth background B, a smooth envelope E (the scene, the
lamp's falloff, vignetting) and a waveform of its own, so phase, duty, exposure, saturation and transfer curve need not
be known and may differ. What all profiles share is the frequency f in periods per row, the inverse of the period:

    profile[i] = B[i] + E[i] * sum over h of (a_h cos(2 pi h f x) + b_h sin(2 pi h f x)),   x = i - (rows - 1) / 2

The envelope is real: it weakens stripes, but cannot move them. That is what makes the frequency well determined. All
unknowns are found together by Gauss-Newton steps under robust weights, those of each profile eliminated.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from psvideo.calibrate.stripes.error import Pulls, standard_error
from psvideo.calibrate.stripes.stripe_model import Equations, Nuisance, spline_basis, start, stripe_equations, waves_of
from psvideo.model.arrays import Doubles

STAGES = (1, 3, 8, 16)
"""Harmonics, from coarse to fine: many of them locate edges sharply, but only from close by."""
MOST_STEPS = 8
SETTLED_CYCLES = 1e-5
"""A step that moves the stripes over the whole picture by less than this share of a period is the last one."""
LONGEST_STEP_CYCLES = 0.3
SIGNAL_TO_NOISE = 2.0
"""Harmonics are kept where their mean energy is that many times what noise alone would give them."""
HIGHEST_HARMONIC = 0.45
"""Periods per row: beyond half a period a row cannot separate harmonics."""


@dataclass(frozen=True, kw_only=True)
class StripeFit:
    """Stripes in profiles. Frequencies are in periods per row, with their standard error.

    ``frame_frequencies`` (frame,) are each frame's own; ``fundamental`` (frame, group) is the first harmonic's complex
    amplitude at the middle row, ``swing`` (frame, group) the waveform's from darkest to brightest, and ``unexplained``
    the sum of the squares left over.
    """

    frequency: float
    frequency_error: float
    frame_frequencies: Doubles
    fundamental: NDArray[np.complex128]
    swing: Doubles
    unexplained: float


class _Solution(NamedTuple):
    """A frequency, every frame's own unknowns and last equations."""

    frequency: float
    state: list[Nuisance]
    found: list[Equations]

    @property
    def harmonics(self) -> int:
        """How many harmonics it has."""
        return int(self.state[0].harmonics.shape[1]) // 2


def fit_stripes(profiles: Doubles, frequency: float, *, most_harmonics: int = STAGES[-1]) -> StripeFit:
    """Refine the frequency of stripes in profiles, shape (frame, group, row), from a start within half a cycle.

    Method: separable least squares (Golub and Pereyra 1973) with Cauchy weights.
    """
    smooth = spline_basis(profiles.shape[2], frequency)
    best = _settle(profiles, frequency, 1, smooth)
    for stage in STAGES[1:]:
        harmonics = min(stage, most_harmonics, int(HIGHEST_HARMONIC / best.frequency))
        if harmonics > best.harmonics:
            best = _settle(profiles, best.frequency, harmonics, smooth)
    needed = _needed(best)
    if needed < best.harmonics:
        best = _settle(profiles, best.frequency, needed, smooth)
    return _summary(profiles, best)


def _settle(profiles: Doubles, frequency: float, harmonics: int, smooth: Doubles) -> _Solution:
    """Solve for this many harmonics."""
    rows = profiles.shape[2]
    lowest, highest = max(frequency - 1 / rows, 1 / rows), frequency + 1 / rows
    state = [start(frame, waves_of(rows, frequency, harmonics), smooth) for frame in profiles]
    for _ in range(MOST_STEPS):
        waves = waves_of(rows, frequency, harmonics)
        found = [stripe_equations(frame, own, waves, smooth) for frame, own in zip(profiles, state, strict=True)]
        step = sum(part.pull.sum() for part in found) / max(sum(part.information.sum() for part in found), 1e-300)
        step = float(np.clip(step, -LONGEST_STEP_CYCLES / rows, LONGEST_STEP_CYCLES / rows))
        step = float(np.clip(frequency + step, lowest, highest)) - frequency
        frequency += step
        state = [own.moved(part.move - step * part.drag) for own, part in zip(state, found, strict=True)]
        if abs(step) * rows < SETTLED_CYCLES:
            break
    return _Solution(frequency, state, found)


def _needed(solution: _Solution) -> int:
    """Return the highest harmonic that stands out of the noise; those above would only pretend to sharp edges."""
    cosines, sines = np.split(np.array([own.harmonics for own in solution.state]), 2, axis=2)
    noise = np.array([part.residual.var(axis=1) for part in solution.found])[:, :, None] * 4
    energy = (cosines**2 + sines**2) * solution.found[0].residual.shape[1] / np.maximum(noise, 1e-12)
    heard = np.flatnonzero(energy.mean(axis=(0, 1)) > SIGNAL_TO_NOISE)
    return int(heard[-1]) + 1 if heard.size else 1


def _summary(profiles: Doubles, solution: _Solution) -> StripeFit:
    frequency, state, found = solution
    information = np.array([part.information.sum() for part in found])
    pull = np.array([part.pull for part in found])
    pulls = Pulls(
        rows=np.sum([part.row_pull for part in found], axis=0),
        information=np.sum([part.row_information for part in found], axis=0),
        frames=pull.sum(axis=1),
        groups=pull.sum(axis=0),
    )
    harmonics = np.array([own.harmonics for own in state])
    cosines, sines = np.split(harmonics, 2, axis=2)
    return StripeFit(
        frequency=frequency,
        frequency_error=standard_error(pulls, 1 / frequency),
        frame_frequencies=frequency + pull.sum(axis=1) / information,
        fundamental=cosines[:, :, 0] - 1j * sines[:, :, 0],
        swing=np.ptp(harmonics @ waves_of(profiles.shape[2], frequency, cosines.shape[2]).T, axis=2),
        unexplained=float(sum((part.residual**2).sum() for part in found)),
    )
