"""How far a subject's light stands out of the noise: what exposure is for, whatever the scale of a curve."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from psvideo.compute.ranks import median
from psvideo.plates.sequence import Round
from psvideo.report.observe.facts import Seen
from psvideo.solve.normals.plate_noise import noise_of


@dataclass(frozen=True, kw_only=True)
class AgainstNoise:
    """The ``level`` of a subject's light (1.0 = saturation): its median under the brightest light of every pixel; and
    the variance of a plate's sample at a level, ``read + photon * level``. A pixel has so many ``samples``, one for
    each channel."""

    level: float
    read: float
    photon: float
    samples: int = 1

    @property
    def ratio(self) -> float:
        """How many times its standard deviation the light is."""
        return self.level / self.sigma

    @property
    def sigma(self) -> float:
        """The standard deviation at the subject's level."""
        return float(np.sqrt(self.read + self.photon * self.level))

    @property
    def pixel_ratio(self) -> float:
        """How many times its standard deviation the light of a pixel is, in the mean of its samples."""
        return self.ratio * float(np.sqrt(self.samples))

    def stops_to(self, ratio: float) -> float:
        """Return by how many stops more light is as many times its noise: the root of ``(kL)² = ratio² (read + photon
        kL)``."""
        grain = ratio**2 * self.photon
        light = (grain + np.sqrt(grain**2 + 4 * ratio**2 * self.read)) / 2
        return float(np.log2(light / self.level))


def against_noise(one: Round, seen: Seen) -> AgainstNoise | None:
    """Return how a round's light stands out of its noise; None where there is no subject, or no light on it."""
    known = seen.subject & seen.shown.any(axis=0)
    if not known.any():
        return None
    level = median(np.where(seen.shown, seen.bright, 0).max(axis=0)[known])
    if level <= 0:
        return None
    noise, samples = noise_of([plate.picture for plate in one.plates]), int(np.prod(one.plates[0].shape[2:]))
    return AgainstNoise(level=float(level), read=noise.read, photon=noise.photon, samples=samples)


def usual(found: Sequence[AgainstNoise]) -> AgainstNoise:
    """Return the middle of several by their ratio, at least one."""
    return sorted(found, key=lambda one: one.ratio)[len(found) // 2]
