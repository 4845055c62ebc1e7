"""When a sample is clipped: it shows no light any more, only that there was at least so much.

Light is linear, 1.0 = sensor saturation. A camera's sample is clipped from SATURATED on. A plate's pixel of which any
sample was clipped holds the plate's own saturation, to the bit; code that scales plates also allows for ROUNDING.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

SATURATED = 0.998
"""A camera's sample from here on is clipped: noise and the white level's rounding leave some just below 1.0."""
ROUNDING = 1e-5
"""How far below its saturation what is clipped may come out, as a share of it, where plates were scaled."""
LOSSY_MARGIN = 0.018
"""Compressed files blur the very end: pictures that may come from such count as clipped this much sooner."""
SMALL_PLATE_MARGIN = 0.048
"""A small plate's pixel is a mean that may hide brighter ones: what is measured there stays this much further away."""


def at_saturation(image: NDArray[np.floating[Any]]) -> NDArray[np.bool_]:
    """Return where a plate that may have been scaled is clipped, of the image's shape."""
    clipped: NDArray[np.bool_] = image >= 1 - ROUNDING
    return clipped
