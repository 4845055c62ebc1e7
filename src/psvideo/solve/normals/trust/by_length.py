"""Albedo that stands out where residuals do: what turns a normal makes it longer or shorter as well.

A shadow's edge, light that came by way of other surfaces, a highlight: whatever is wrong in a few measurements is
spread by the lights along the normal as well as across it. So a pixel whose albedo differs from what is around it, and
whose measurements do not fit, is off, and by more than either says. Each by itself says little: paint differs and fits,
and of residuals smooth ones are typical of the whole subject and show in its ``surroundings``.
"""

import numpy as np

from psvideo.model.arrays import Floats
from psvideo.solve.normals.trust.surroundings import UNSURE_OF_NOISE
from psvideo.solve.normals.trust.thin_surface import ThinSurface, blurred, width_of

AROUND, BESIDE = 0.05, 3
"""Albedo is compared with its mean over this share of the subject's size; residuals are of a square of so many points,
since a pixel's own fits by chance."""
OF_NOISE = np.float32(2)
"""Residuals count from this many times the square on that noise makes of them: of few points it is not the mean."""
FIT_COUNTS = np.float32(4)
"""An albedo that differs by four degrees, a fourteenth, says as much as residuals of one degree; whichever is less
limits both."""
USUAL, AT_LEAST_DEG = np.float32(1.5), np.float32(0.5)
"""What is usual around, so many times, and little more is no pixel's own: it is typical of the subject."""
OUTLYING, LARGEST_DEG = np.float32(3), np.float32(30)
"""For what is usual a pixel counts up to so many times the mean; and nothing stands out by more than the
second."""
LEAST_SHOWN, TINY = np.float32(1e-4), np.float32(1e-6)
"""Albedo, of which the logarithm is taken, and what is divided by, is no less."""
TO_DEG = np.float32(180 / np.pi)


def by_length_deg(points: ThinSurface, squares: Floats, noise: Floats) -> Floats:
    """Return by how many degrees albedo and residuals together stand out at every point, (row, col), beyond what is
    usual around it.

    squares: of the error in degrees that residuals predict, ``UNSURE_OF_NOISE`` times ``noise`` taken off; below 0
        where they are less.
    noise: the square of what noise makes of them.
    """
    known, near = points.known.astype(np.float32), points.widths[0]
    beyond = _mean(squares - (OF_NOISE - UNSURE_OF_NOISE) * noise, known, BESIDE)
    fit = FIT_COUNTS * np.sqrt(np.maximum(beyond, np.float32(0)))
    if not fit.any():
        return fit
    length = np.log(np.maximum(points.brightness, LEAST_SHOWN))
    off = TO_DEG * np.abs(length - _mean(length, known, width_of(points.known, AROUND))) * known
    both = off * fit / (off + fit + TINY)
    usual = _mean(np.minimum(both, OUTLYING * _mean(both, known, near)), known, near)
    return np.asarray(np.clip(both - USUAL * usual - AT_LEAST_DEG, 0, LARGEST_DEG) * known, np.float32)


def _mean(plane: Floats, known: Floats, width: int) -> Floats:
    """Return the mean over squares so many points wide, of those that are ``known`` (1, else 0)."""
    return np.asarray(blurred(plane * known, width) / np.maximum(blurred(known, width), TINY), np.float32)
