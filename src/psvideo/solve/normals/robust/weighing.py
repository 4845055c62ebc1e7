"""How the robust solver weighs measurements, and up to which predicted error its normals are valid."""

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from psvideo.model.surface import Misfit, Reflectance

MOST_TYPICAL_DEG = 30.0
"""However bad a picture is as a whole, beyond this no normal is valid."""
EVERYTHING_DEG = 179.0
TUKEY_WIDTH = 4.685  # beside Cauchy's, as far as weights go: this wide, Tukey's keeps 95 % of what Gaussian noise holds
LEAST_CLAIMED = 0.3
"""Where the noise is known, residuals predict no less than this much of a dark measurement's: noise is counted beside
them, and what lies in a dark part of the picture was said to be off by what cameras are thought to have at least."""
BROAD, MIDDLE, NARROW = 8, 32, 128
"""The powers of the cosine that are a subject's highlights (``model.surface.Reflectance``)."""


@dataclass(frozen=True, kw_only=True)
class Reweighting:
    """How measurements are weighed; ``noise`` and ``signal_noise`` are the least that any camera's residuals have.

    rounds: how often weights are taken again.
    loss: "cauchy" weighs everything a little, "tukey" leaves what is far off out entirely.
    width: the residual, over the pixel's own median residual as a standard deviation, where Cauchy's weight is a half
        and Tukey's becomes 0 at that times ``TUKEY_WIDTH``; narrower with the root of their number where more than nine
        measurements are usable.
    noise: in units of sensor saturation, of a picture that is well lit (``WELL_LIT``).
    signal_noise: as a share of the pixel's albedo under one light, as lights and lenses are never known better.
    darkest, brightest: the shares of the measurements that the start leaves out.
    contradiction: four measurements contradict each other beyond this many times the noise.
    most_error_deg, beside_typical: a normal whose predicted standard error is larger than this is not valid, unless
        that error is less than this many times what is typical of the picture.
    """

    rounds: int = 3
    loss: Literal["cauchy", "tukey"] = "cauchy"
    width: float = 0.6
    noise: float = 0.0005
    signal_noise: float = 0.01
    darkest: float = 0.2
    brightest: float = 0.5
    contradiction: float = 3.0
    most_error_deg: float = 6.0
    beside_typical: float = 2.5


class Weights(NamedTuple):
    """How measurements are weighed, and which normals are trusted; ``Reweighting`` describes the fields.

    ``most_error_deg`` is the limit for this picture, and ``common`` the share of a pixel's light that its lights
    usually leave unexplained.
    """

    rounds: int
    tukey: bool
    width: np.float32
    noise: np.float32
    least: np.float32  # the same where residuals predict errors
    signal_noise: np.float32
    darkest: np.float32
    brightest: np.float32
    contradiction: np.float32
    most_error_deg: np.float32
    common: np.float32
    curve: np.float32  # what the subject reflects beyond n . l: the numbers of surface.Reflectance, in g's unit
    rough: np.float32
    soft: np.float32
    broad: np.float32
    middle: np.float32
    narrow: np.float32


def limit_deg(reweighting: Reweighting, misfit: Misfit | None) -> float:
    """Return the predicted error up to which a normal is valid: the limit, or more where the whole picture is worse."""
    if misfit is None:
        return max(reweighting.most_error_deg, 0.0)
    return max(reweighting.most_error_deg, min(reweighting.beside_typical * misfit.error_deg, MOST_TYPICAL_DEG))


def weights(
    reweighting: Reweighting, noise: tuple[float, float], *,
    most_error_deg: float, common: float, model: Reflectance | None = None, unit: float = 1.0,
) -> Weights:  # fmt: skip
    """Return what the compiled loops take: ``noise`` is that of a dark measurement and per unit of light (variances),
    ``unit`` turns the model's highlights into the plates' unit of albedo."""
    curve, rough, soft, *shine = (0.0,) * 6 if model is None else model
    least = min(reweighting.noise, LEAST_CLAIMED * noise[0] ** 0.5) if noise[0] > 0 else reweighting.noise
    tukey = reweighting.loss == "tukey"
    return Weights(
        rounds=reweighting.rounds,
        tukey=tukey,
        width=np.float32(reweighting.width * (TUKEY_WIDTH if tukey else 1.0)),
        noise=np.float32(reweighting.noise),
        least=np.float32(least),
        signal_noise=np.float32(reweighting.signal_noise),
        darkest=np.float32(reweighting.darkest),
        brightest=np.float32(reweighting.brightest),
        contradiction=np.float32(reweighting.contradiction),
        most_error_deg=np.float32(most_error_deg),
        common=np.float32(common),
        curve=np.float32(curve),
        rough=np.float32(rough),
        soft=np.float32(soft),
        broad=np.float32(shine[0] * unit),
        middle=np.float32(shine[1] * unit),
        narrow=np.float32(shine[2] * unit),
    )
