"""How far off each light's measurements are, beside those of a light of mean strength: what they are weighed by.

Noise in the dark is the same under every lamp, photon noise grows with the root of its strength, and what is not matte,
or a rig that is wrong, with the strength itself.
"""

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.plate_noise import PlateNoise
from psvideo.solve.normals.task import LIGHTS, Task


def combined_noise(noise: PlateNoise, lit: Illumination) -> tuple[float, float]:
    """Return the variance of a measurement, its channels combined, in the dark, and what a unit of light adds."""
    dark, light = lit.noise_shares
    return noise.read * dark, noise.photon * light


def with_noise(given: Task, lit: Illumination, noise: tuple[float, float]) -> Task:
    """Return a task with the noise of every light's measurements, of which ``noise`` is what ``combined_noise`` gives:
    where lights' colours differ, it is more under some than under others."""
    each = np.stack([noise[0] * lit.noisiness**2, np.full(given.lights, noise[1])], axis=-1)
    return given._replace(noise=np.pad(each, ((0, len(given.tone) - given.lights), (0, 0))).astype(np.float32))


def light_sigmas(
    lit: Illumination, noise: tuple[float, float], *, light: float, share: float = float(LIGHTS)
) -> Doubles:
    """Return the standard deviations of all lights' measurements (light,), over that of a light of mean strength.

    noise: of a measurement, as ``combined_noise`` gives it. light: what a light of mean strength, straight above, makes
    of a typical pixel, in units of saturation. share: what such a pixel's measurements are off by beyond noise, of
    their own light.
    """
    strengths = lit.intensities.mean(axis=1)
    strengths = strengths / strengths.mean()
    dark, photon = noise
    off = share * light
    squares = dark * lit.noisiness**2 + photon * light * strengths + (off * strengths) ** 2
    typical = dark + photon * light + off**2
    return np.asarray(np.sqrt(squares / typical)) if typical > 0 else np.ones(len(strengths))


def root_sigmas(lit: Illumination) -> Doubles:
    """Return the same where nothing is known of noise and subject: half way between noise in the dark and what grows
    with strength."""
    strengths = lit.intensities.mean(axis=1)
    return np.asarray(np.sqrt(strengths / strengths.mean()))
