"""What no rig would explain of a matte surface's light, highlights and shadows aside: gloss leaves it under any rig.

Where a rig L is wrong, what it leaves over of a matte point's light is linear in the normal that it gives there:
``light = T b``, with the true lights T, leaves ``(1 - L L+) T (L+ T)^-1`` times that normal. A highlight is not. So
what is left is fitted by such a matrix, by reweighted least squares: few points in highlights or shadow do not count,
as they would in the eigenvalues of all light.
"""

import numpy as np

from psvideo.compute.ranks import median
from psvideo.model.arrays import Doubles

OUTLIER = 2.2
"""Residuals are taken for Cauchy's, this many times their median wide."""
ROUNDS = 15
LEAST = 1e-9


def left_by_any_rig(left: Doubles, normals: Doubles) -> float:
    """Return the median share of points' light that is left over under the rig that suits them best, at most what is
    ``left`` (point, light) now; ``normals`` (point, 3) are what the rig makes of them, both for light of length 1."""
    rest, sizes = left, np.sqrt(np.einsum("pi,pi->p", left, left))
    best = median(sizes)
    for _ in range(ROUNDS):
        weights = 1 / (1 + (sizes / (OUTLIER * median(sizes) + LEAST)) ** 2)
        weighted = normals * weights[:, None]
        moments = np.einsum("pi,pj->ij", weighted, normals) + LEAST * np.eye(3)  # BLAS would cut sums by threads
        rest = left - normals @ np.linalg.solve(moments, np.einsum("pi,pj->ij", weighted, left))
        sizes = np.sqrt(np.einsum("pi,pi->p", rest, rest))
        best = min(best, median(sizes))
    return best
