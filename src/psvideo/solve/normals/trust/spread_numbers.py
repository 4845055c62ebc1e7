"""The numbers by which noise becomes errors of normals, as the compiled loops of judging take them."""

from typing import NamedTuple

import numpy as np

from psvideo.model.arrays import Floats


class Spread(NamedTuple):
    """How noise spreads into normals under all lights.

    shares: (channel,), by how much channels count beside the surface's own colour, as shares of white light's.
    inverse: (3, 3), of the lights' normal equations. scale: degrees that hold a share of errors, per radian.
    variances: of a dark sample, per unit of albedo, of its square; the last instead of that for what residuals say.
    toward: (3,), the lights' mean direction by their strengths: what a normal has along it is the mean light there, as
        a share of what would shine straight on it.
    dim, wider: of near lights, at the points of a grid: irradiance over that in the middle, and by how much more noise
        spreads there for the lights' directions; empty for distant lights.
    """

    shares: Floats
    inverse: Floats
    variances: Floats
    scale: np.float32
    toward: Floats
    dim: Floats
    wider: Floats
