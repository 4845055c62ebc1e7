"""How a plate is exposed: counts of its light in stops below saturation, and what they say of power and aperture."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Integers

STOPS = 14
PER_STOP = 8
BINS = STOPS * PER_STOP
_BASE = (127 - STOPS) * PER_STOP
_EDGES = np.concatenate([2.0 ** (octave - STOPS) * (1 + np.arange(PER_STOP) / PER_STOP) for octave in range(STOPS)])
TARGET_QUANTILE = 0.995
"""This share of the subject should be below HEADROOM of saturation."""
HEADROOM = 0.9
"""The share of saturation below which TARGET_QUANTILE of the subject should be."""
LEAST_POWER = 0.1


def count_levels(light: NDArray[np.float32], saturation: float) -> Integers:
    """Return how many samples lie in every bin, shape (BINS + 2,): first those below 14 stops under saturation, last
    those that are clipped. Bins are read off the numbers' own bits: 8 of equal width per doubling."""
    relative = np.ascontiguousarray(light, np.float32).ravel() / np.float32(saturation)
    place = relative.view(np.int32) >> 20
    place -= _BASE - 1
    np.maximum(np.minimum(place, BINS + 1, out=place), 0, out=place)
    return np.bincount(place, minlength=BINS + 2).astype(np.int64)


@dataclass(frozen=True)
class Levels:
    """The light of one lamp on the subject over a take, as ``counts`` of ``count_levels``."""

    counts: Integers

    @cached_property
    def total(self) -> int:
        """How many samples were counted."""
        return int(self.counts.sum())

    @property
    def clipped_share(self) -> float:
        """Which share of the samples is saturated."""
        return float(self.counts[-1] / max(self.total, 1))

    def quantile(self, share: float) -> float:
        """Return the light, 1.0 = saturation, below which a share of the samples lies; 1.0 where it is clipped, and 0
        where nothing was counted."""
        if not self.total:
            return 0.0
        upto = np.concatenate([[0], np.cumsum(self.counts[:-1])]) / max(self.total, 1)
        if share >= upto[-1]:
            return 1.0
        edges = np.concatenate([[0.0], _EDGES, [1.0]])
        return float(np.interp(share, upto, edges))

    def stops(self, share: float) -> float:
        """Return a quantile in stops below saturation: 0 is saturation, -1 half of it; -14 at least."""
        return float(np.log2(max(self.quantile(share), 2.0**-STOPS)))

    def right_power(self, whole: "Sequence[Levels]" = ()) -> float:
        """By which factor to change the lamp's light so that 99.5 % of the subject lie just below saturation.

        What is clipped shows no level. How much brighter the brightest parts are than those that just clip is taken
        from other lamps on the same subject that do not clip, ``whole``. Without any, the brightest half of what is not
        clipped is carried on in a straight line, which is the least that a rounded matte subject comes to.
        """
        clipped = self.clipped_share
        if clipped <= 1 - TARGET_QUANTILE:
            return HEADROOM / max(self.quantile(TARGET_QUANTILE), 2.0**-STOPS)
        tops = [one.quantile(TARGET_QUANTILE) / max(one.quantile(1 - clipped), 2.0**-STOPS) for one in whole]
        if tops:
            return float(np.clip(HEADROOM / max(float(np.median(tops)), 1.0), LEAST_POWER, 0.9))
        if clipped == 1:  # nothing says by how much
            return LEAST_POWER
        shares = np.linspace(0.5, 0.98, 13) * (1 - clipped)
        levels = np.array([self.quantile(float(share)) for share in shares])
        slope, start = np.polyfit(shares, levels, 1)
        expected = max(start + slope * TARGET_QUANTILE, 1 / HEADROOM)
        return float(np.clip(HEADROOM / expected, LEAST_POWER, 0.9))

    def by_stop(self, per_stop: int = 4) -> NDArray[np.float64]:
        """Return the share of samples in ``per_stop`` bins a stop, darkest first, the clipped last, for drawing."""
        inner = self.counts[1:-1].reshape(STOPS * per_stop, PER_STOP // per_stop).sum(axis=1)
        inner[0] += self.counts[0]
        return np.append(inner, self.counts[-1]) / max(self.total, 1)
