"""What share of which flash each row of each frame saw.

Row i of frame n is open over ``[a, a + exposure)`` and flash k is on over ``[s, s + d)``, both on the camera's clock.
The weight is their overlap as a share of the flash: 1 where the row saw all of it, 0 where it saw nothing. Against the
flash's start it is a trapezoid. This is the one model that finding the timing and rebuilding the plates share.
"""

import numpy as np
from numpy.typing import NDArray

from psvideo.model.camera import Camera, FloatArray

IntArray = NDArray[np.int64]


def row_weights(camera: Camera, start_s: FloatArray, duration_s: FloatArray, *, frames: range) -> FloatArray:
    """Return the fraction of each flash that each row saw in each frame, shape (flash, frame, row), 0 to 1.

    ``start_s`` and ``duration_s`` have shape (flash,) and are on the camera's clock; ``frames`` are frame indices.

    >>> from fractions import Fraction
    >>> camera = Camera(width_px=1, height_px=2, fps=Fraction(100), exposure_s=0.01, readout_s=0.01)
    >>> row_weights(camera, np.array([0.009]), np.array([0.002]), frames=range(0, 2)).round(3)[0]
    array([[0.5, 1. ],
           [0.5, 0. ]])
    """
    opens_s = (
        np.arange(frames.start, frames.stop, frames.step)[:, None] * camera.frame_period_s + camera.row_offsets_s()
    )
    on_s = np.asarray(start_s, np.float64)[:, None, None]
    length_s = np.asarray(duration_s, np.float64)[:, None, None]
    overlap_s = np.minimum(opens_s + camera.exposure_s, on_s + length_s) - np.maximum(opens_s, on_s)
    weights: FloatArray = np.clip(overlap_s, 0.0, None) / length_s
    return weights


def frames_touched(camera: Camera, start_s: FloatArray, duration_s: FloatArray) -> tuple[IntArray, IntArray]:
    """Return the first and the last frame of which any row sees any of each flash, each of shape (flash,).

    Two or three frames at 360 degrees with a long readout (§3.3), often one where the readout is short; frames before
    the clip's first have negative numbers. Where the last comes before the first, the flash fell between exposures.

    >>> from fractions import Fraction
    >>> camera = Camera(width_px=1, height_px=100, fps=Fraction(100), exposure_s=0.01, readout_s=0.01)
    >>> first, last = frames_touched(camera, np.array([0.0095]), np.array([0.0008]))
    >>> int(first[0]), int(last[0])
    (-1, 1)
    """
    offsets_s = camera.row_offsets_s()
    period_s = camera.frame_period_s
    first = np.floor((start_s - offsets_s.max() - camera.exposure_s) / period_s) + 1
    last = np.ceil((start_s + duration_s - offsets_s.min()) / period_s) - 1
    return first.astype(np.int64), last.astype(np.int64)
