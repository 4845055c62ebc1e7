"""Ripple of lamps on the mains: by how much the light of an exposure differs from the mean, by when it was open."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles

MOST_SWING = 0.9


@dataclass(frozen=True, kw_only=True)
class Exposures:
    """Whose exposures went into a plate's rows: ``shares`` and ``middles_s`` (frame, row)."""

    shares: Doubles
    middles_s: Doubles

    @property
    def middle_s(self) -> Doubles:
        """The mean moment of each row's exposures, shape (row,)."""
        middle: Doubles = (self.shares * self.middles_s).sum(axis=0) / np.maximum(self.shares.sum(axis=0), 1e-12)
        return middle

    def phasor(self, hz: float) -> NDArray[np.complex128]:
        """Return where in a pulse each row's exposures lie on average, shape (row,)."""
        turns = np.exp(2j * np.pi * hz * self.middles_s)
        mean: NDArray[np.complex128] = (self.shares * turns).sum(axis=0) / np.maximum(self.shares.sum(axis=0), 1e-12)
        return mean


@dataclass(frozen=True, kw_only=True)
class Ripple:
    """The swing of the ambient light's exposures: of ``abs(amplitude)`` of their mean, ``hz`` times a second.

    An exposure whose middle is ``t`` seconds on the camera's clock collects ``1 + Re(amplitude exp(2 pi i hz t))``
    times the mean; ``error`` is the amplitude's standard error.
    """

    hz: float
    amplitude: complex
    error: float = 0.0

    def swing(self, opened: Exposures) -> Doubles:
        """Return by which factor the rows' exposures were off the mean, shape (row,)."""
        return swing(self.amplitude, opened.phasor(self.hz))


def swing(amplitude: complex, phasor: NDArray[np.complex128]) -> Doubles:
    """Return by which factor exposures were off the mean that lie at ``phasor`` (row,) in a pulse; never near 0."""
    factor: Doubles = np.maximum(1 + (amplitude * phasor).real, 1 - MOST_SWING)
    return factor
