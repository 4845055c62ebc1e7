"""The fast path where a whole rectangle is valid: Poisson's equation by cosine transforms.

R. Frankot and R. Chellappa (1988) project slopes onto integrable ones by Fourier transforms, which takes the picture
for periodic; the cosine transform (T. Simchony et al. 1990) leaves its border free instead.
"""

import numpy as np

from psvideo.compute.spilled import BAND_ROWS, let_go
from psvideo.model.arrays import Doubles
from psvideo.solve.depth.view import Slopes


def poisson_height(slopes: Slopes) -> Doubles:
    """Return the height (row, col), of mean 0, whose steps fit the slopes' best in the sense of least squares.

    A step between two pixels is to be the mean of their slopes, all steps count alike. Every pixel must be valid: a
    ``facing`` of 0 anywhere gives no sense.
    """
    from scipy.fft import dctn, idctn  # scipy takes 15 MB, which runs without depth do without

    rows, cols = slopes.facing.shape
    spectrum = dctn(_divergence(slopes), type=2, norm="ortho", overwrite_x=True)
    down, across = _eigenvalues(rows), _eigenvalues(cols)
    down[0] = 1.0  # the mean, which is nothing at all
    spectrum[0] /= np.append(1.0, across[1:])
    for row in range(1, rows):
        spectrum[row] /= down[row] + across
    spectrum[0, 0] = 0.0
    height: Doubles = idctn(spectrum, type=2, norm="ortho", overwrite_x=True)
    return height


def _divergence(slopes: Slopes) -> Doubles:
    """Return how much more goes out of every pixel than comes in, (row, col), one row after the other."""
    rows, cols = slopes.facing.shape
    divergence, above = np.zeros((rows, cols)), np.zeros(cols)
    for row in range(rows):
        facing = slopes.facing[row].astype(np.float64)
        across = slopes.across[row] / facing
        east = 0.5 * (across[1:] + across[:-1])
        divergence[row, :-1] += east
        divergence[row, 1:] -= east
        down = slopes.down[row] / (facing * slopes.aspect)
        if row:
            south = 0.5 * (down + above)
            divergence[row - 1] += south
            divergence[row] -= south
        above = down
        if row % BAND_ROWS == BAND_ROWS - 1 or row == rows - 1:
            done = slice(row // BAND_ROWS * BAND_ROWS, row + 1)
            let_go(slopes.facing[done], slopes.across[done], slopes.down[done])
    return divergence


def _eigenvalues(count: int) -> Doubles:
    """The second difference's eigenvalues with free ends, for a row of this many pixels."""
    values: Doubles = 2.0 * np.cos(np.pi * np.arange(count) / count) - 2.0
    return values
