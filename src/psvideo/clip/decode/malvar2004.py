"""Demosaicing by Malvar, He and Cutler, "High-quality linear interpolation for demosaicing of Bayer-patterned color
images", ICASSP 2004: each missing colour is its bilinear estimate, corrected by the Laplacian of the colour at hand.

It is linear, so plates may be split in the mosaic and demosaiced afterwards; measured samples are kept exactly.
"""

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.threads import over_ranges
from psvideo.errors import PsvideoError
from psvideo.model.camera import CFA_PATTERNS

EACH_ROWS = 64
"""Rows that a thread makes at a time."""


def demosaic(image: NDArray[np.float32], cfa: str) -> NDArray[np.float32]:
    """Return the full-size colour picture, shape (row, col, 3), of a mosaic of shape (row, col).

    ``cfa`` names the filters of the top left 2 x 2 pixels, row by row, e.g. ``RGGB``. Beyond the border the picture is
    mirrored about its outermost pixels, which keeps the pattern. Raises PsvideoError for another kind of pattern.
    """
    if cfa not in CFA_PATTERNS:
        raise PsvideoError(
            f"colour filter pattern {cfa!r} cannot be demosaiced; expected one of {', '.join(CFA_PATTERNS)}."
        )
    from psvideo.clip.decode.malvar_kernel import demosaic_rows  # loads the compiler, which help does without

    mosaic = np.ascontiguousarray(image, np.float32)
    colour = np.empty((*mosaic.shape, 3), np.float32)
    filters = np.array(["RGB".index(name) for name in cfa], np.intp).reshape(2, 2)
    over_ranges(lambda first, last: demosaic_rows(mosaic, filters, first, last, colour), len(mosaic), each=EACH_ROWS)
    return colour
