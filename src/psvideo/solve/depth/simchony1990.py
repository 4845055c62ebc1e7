"""The fast path where a whole rectangle is valid: Poisson's equation by cosine transforms.

R. Frankot and R. Chellappa (1988) project slopes onto integrable ones by Fourier transforms, which takes the picture
for periodic; the cosine transform (T. Simchony et al. 1990) leaves its border free instead.
"""

import numpy as np
from scipy.fft import dctn, idctn

from psvideo.model.camera import FloatArray
from psvideo.solve.depth.view import Slopes


def poisson_height(slopes: Slopes) -> FloatArray:
    """Return the height (row, col), of mean 0, whose steps fit the slopes' best in the sense of least squares.

    A step between two pixels is to be the mean of their slopes, all steps count alike. Every pixel must be valid: a
    ``facing`` of 0 anywhere gives no sense.
    """
    rows, cols = slopes.facing.shape
    across = slopes.across / slopes.facing
    down = slopes.down / (slopes.facing * slopes.aspect)
    east = 0.5 * (across[:, 1:] + across[:, :-1])
    south = 0.5 * (down[1:] + down[:-1])
    divergence = np.zeros((rows, cols))
    divergence[:, :-1] += east
    divergence[:, 1:] -= east
    divergence[:-1] += south
    divergence[1:] -= south
    spectrum = dctn(divergence, type=2, norm="ortho")
    scale = _eigenvalues(rows)[:, None] + _eigenvalues(cols)
    scale[0, 0] = 1.0
    spectrum /= scale
    spectrum[0, 0] = 0.0
    height: FloatArray = idctn(spectrum, type=2, norm="ortho")
    return height


def _eigenvalues(count: int) -> FloatArray:
    """The second difference's eigenvalues with free ends, for a row of so many pixels."""
    values: FloatArray = 2.0 * np.cos(np.pi * np.arange(count) / count) - 2.0
    return values
