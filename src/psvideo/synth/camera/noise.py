"""From collected light to numbers: shot noise, read noise, saturation, and the analogue-to-digital converter."""

from dataclasses import dataclass

import numpy as np

from psvideo.model.arrays import Image


@dataclass(frozen=True, kw_only=True)
class Noise:
    """What the sensor adds. ``full_well_e`` electrons are 1.0 in linear light; 0 means no shot noise and no read noise.

    Shot noise is taken as normal with the variance of the electron count (Foi et al. 2008), which holds above a few
    electrons, where read noise no longer hides the difference.
    """

    full_well_e: float = 0.0
    read_e: float = 0.0

    def add(self, light: Image, rng: np.random.Generator) -> Image:
        """Return the light as the sensor reads it, same shape and scale; unchanged where there is no noise."""
        if self.full_well_e <= 0:
            return light
        variance = np.maximum(light, 0.0) / np.float32(self.full_well_e) + np.float32(
            (self.read_e / self.full_well_e) ** 2
        )
        noise = rng.standard_normal(light.shape, dtype=np.float32)
        return light + noise * np.sqrt(variance)


NOISELESS = Noise()


def frame_rng(seed: int, frame: int) -> np.random.Generator:
    """Return the random numbers of one frame: the same for any frames that were made before it."""
    return np.random.default_rng([seed, 2, frame])
