"""What share of which flash each row of each frame saw.

Row i of frame n is open over ``[a, a + exposure)`` and flash k is on over ``[s, s + d)``, both on the camera's clock.
The weight is the share of the flash's light that the row collected: 1 where it saw all of it, 0 where it saw nothing.
Against a square flash's start it is a trapezoid; an LED that rises and falls slowly rounds it. Plates are
made by it. The fit has the same model compiled (``sync/rowfit/row_model``); ``tests/test_sync.py`` holds the two
together.
"""

from dataclasses import dataclass

import numpy as np

from psvideo.model.arrays import Doubles, Integers
from psvideo.model.camera import Camera

REACH = 9.0
"""After this many fall times a flash counts as over: e^-9 of its last light is left, a ten-thousandth."""


@dataclass(frozen=True, kw_only=True)
class Pulse:
    """How an LED answers its drive: 1/e rise and fall times in seconds, 0 for a square flash."""

    rise_s: float = 0.0
    fall_s: float = 0.0

    @property
    def tail_s(self) -> float:
        """How long after its drive ends a flash still gives light."""
        return REACH * self.fall_s

    def given_off(self, since_s: Doubles, duration_s: Doubles) -> Doubles:
        """Return the share of its light, 0 to 1, that a flash has given off ``since_s`` after its drive's start.

        Both are arrays that broadcast. The drive lasts ``duration_s``; the light rises as ``1 - exp(-t / rise_s)`` and
        falls as ``exp(-t / fall_s)``.

        >>> slow = Pulse(rise_s=1e-4, fall_s=1e-4)
        >>> slow.given_off(np.array([0.0, 0.0008, 0.01]), np.array(0.0008)).round(3)
        array([0.   , 0.875, 1.   ])
        """
        lit_s, after_s = np.clip(since_s, 0.0, duration_s), np.maximum(since_s - duration_s, 0.0)
        given_s, whole_s = np.asarray(lit_s, np.float64), np.asarray(duration_s, np.float64)
        reached: Doubles = np.ones_like(whole_s)
        if self.rise_s > 0:
            given_s = lit_s + self.rise_s * np.expm1(-lit_s / self.rise_s)
            reached = -np.expm1(-whole_s / self.rise_s)
            whole_s = whole_s - self.rise_s * reached
        if self.fall_s > 0:
            given_s = given_s - reached * self.fall_s * np.expm1(-after_s / self.fall_s)
            whole_s = whole_s + reached * self.fall_s
        share: Doubles = given_s / whole_s
        return share


SQUARE = Pulse()


def row_weights(
    camera: Camera, start_s: Doubles, duration_s: Doubles, *, frames: range, pulse: Pulse = SQUARE
) -> Doubles:
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
    parts = [_seen(opens_s + later_s, on_s, length_s, camera.exposure_s, pulse) for later_s in camera.within_row_s()]
    return parts[0] if len(parts) == 1 else np.mean(parts, axis=0, dtype=np.float64)


def _seen(opens_s: Doubles, on_s: Doubles, length_s: Doubles, exposure_s: float, pulse: Pulse) -> Doubles:
    """Return the share of flashes that exposures collect which begin at ``opens_s``; all broadcast."""
    if pulse != SQUARE:
        since_s = opens_s - on_s
        seen: Doubles = pulse.given_off(since_s + exposure_s, length_s) - pulse.given_off(since_s, length_s)
        return seen
    overlap_s = np.minimum(opens_s + exposure_s, on_s + length_s) - np.maximum(opens_s, on_s)
    weights: Doubles = np.clip(overlap_s, 0.0, None) / length_s
    return weights


def frames_touched(
    camera: Camera, start_s: Doubles, duration_s: Doubles, *, pulse: Pulse = SQUARE
) -> tuple[Integers, Integers]:
    """Return the first and the last frame of which any row sees any of each flash, each of shape (flash,).

    Two or three frames at 360 degrees with a long readout (§3.3), often one where the readout is short; frames before
    the clip's first have negative numbers. Where the last comes before the first, the flash fell between exposures.

    >>> from fractions import Fraction
    >>> camera = Camera(width_px=1, height_px=100, fps=Fraction(100), exposure_s=0.01, readout_s=0.01)
    >>> first, last = frames_touched(camera, np.array([0.0095]), np.array([0.0008]))
    >>> int(first[0]), int(last[0])
    (-1, 1)
    """
    offsets_s = camera.row_offsets_s()[:, None] + camera.within_row_s()
    period_s = camera.frame_period_s
    first = np.floor((start_s - offsets_s.max() - camera.exposure_s) / period_s) + 1
    last = np.ceil((start_s + duration_s + pulse.tail_s - offsets_s.min()) / period_s) - 1
    return first.astype(np.int64), last.astype(np.int64)
