"""Which way a camera reads: the way in which an LED's stripes step from frame to frame.

From one frame to the next the LED goes on by ``LED rate * frame period`` blinks. Read from the top, the stripes' phase
goes on by the fraction of that; read from the bottom, back by it. Where the fraction is near 0 or 1/2, both are the
same; and one frame alone looks the same both ways.
"""

from fractions import Fraction
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Direction = Literal["top-down", "bottom-up", "unknown"]

CAMERA_CLOCK_PPM = 100.0
LEAST_ERROR_CYCLES = 0.01
ERRORS = 3.0


def find_direction(
    fundamental: NDArray[np.complex128],
    places: tuple[int, ...] | None,
    *,
    fps: Fraction | None,
    led_hz: float,
    tolerance_ppm: float,
) -> tuple[Direction, str]:
    """Return the direction and a sentence on why.

    ``fundamental`` (frame, block) are the stripes' complex amplitudes, ``places`` the frames' places in time.
    """
    if places is None or fps is None:
        return "unknown", "the pictures' times are not known: that takes a clip and its frame rate"
    steps = _steps(fundamental, places)
    if not steps.size:
        return "unknown", "that takes three consecutive frames"
    mean = steps.mean()
    step = float(np.angle(mean) / (2 * np.pi))
    scatter = np.sqrt(max(-2 * np.log(max(abs(mean), 1e-9)), 0.0) / steps.size) / (2 * np.pi)
    blinks = led_hz / float(fps)
    unsure = LEAST_ERROR_CYCLES + blinks * (tolerance_ppm + CAMERA_CLOCK_PPM) * 1e-6 + ERRORS * float(scatter)
    if _apart(2 * blinks) <= 2 * unsure:
        return "unknown", (
            f"{blinks:.3f} blinks a frame make the stripes step alike both ways: use an LED rate that makes about a "
            "quarter of a blink more than a whole number"
        )
    is_down, is_up = _apart(step - blinks) <= unsure, _apart(step + blinks) <= unsure
    if is_down != is_up:
        return ("top-down" if is_down else "bottom-up"), (
            f"the stripes step by {step:+.3f} of a period a frame, and {blinks:.3f} blinks go by"
        )
    return "unknown", (
        f"the stripes step by {step:+.3f} of a period a frame, which does not fit {blinks:.3f} blinks: the LED's "
        "rate or the frame rate is not quite what was given"
    )


def _steps(fundamental: NDArray[np.complex128], places: tuple[int, ...]) -> NDArray[np.complex128]:
    """Return how the phase goes on, as numbers on the unit circle, for all three frames in a row.

    Differences of neighbours are compared, in which everything that stands still cancels.
    """
    change = np.diff(fundamental, axis=0)
    turn = (change[1:] * change[:-1].conj()).sum(axis=1)
    gaps = np.diff(np.array(places))
    turn = turn[(gaps[1:] == 1) & (gaps[:-1] == 1)]
    turned: NDArray[np.complex128] = turn / np.maximum(np.abs(turn), 1e-300)
    return turned


def _apart(cycles: float) -> float:
    """Return how far a number of cycles is from a whole one."""
    return abs(cycles - round(cycles))
