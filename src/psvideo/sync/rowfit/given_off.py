"""What a flash has given off, compiled: the share of its light by a time, and the rate at which it does so then.

A flash is a square pulse with an exponential rise and fall (1/e times). Compression and scaling blur rows as if every
flash were spread out evenly to either side, which is a time as well.
"""

import numpy as np

from psvideo.compute.compiled import EXACT

OVER = 40.0
"""After this many, double precision cannot tell that it is not."""
SPREAD = 3.0**0.5
"""Three points, at these standard deviations with weights 1, 4 and 1, blur as a Gaussian (Gauss-Hermite quadrature).
No row takes light from nearer than the next one: where a blur is less than that, the outer points are there, and weigh
less."""


@EXACT.kept
def reach_s(blur_s: float, row_s: float) -> float:
    """Return how far a blur takes light from, 0 where there is none."""
    return max(SPREAD * blur_s, row_s) if blur_s > 0.0 else 0.0


@EXACT.kept
def given_off(
    since_s: float, duration_s: float, rise_s: float, fall_s: float, blur_s: float, row_s: float
) -> tuple[float, float]:
    """Return the share of its light that a flash has given off, and the rate at which it does so now."""
    share, rate = _sharp(since_s, duration_s, rise_s, fall_s)
    if blur_s <= 0.0:
        return share, rate
    apart_s = reach_s(blur_s, row_s)
    outer = 0.5 * (blur_s / apart_s) ** 2
    before, rate_before = _sharp(since_s - apart_s, duration_s, rise_s, fall_s)
    after, rate_after = _sharp(since_s + apart_s, duration_s, rise_s, fall_s)
    inner = 1.0 - 2.0 * outer
    return inner * share + outer * (before + after), inner * rate + outer * (rate_before + rate_after)


@EXACT.called
def share_between(
    open_s: float, close_s: float, duration_s: float, rise_s: float, fall_s: float, blur_s: float, row_s: float
) -> float:
    """Return the share of a flash that is given off between two times since its start."""
    after, _ = given_off(close_s, duration_s, rise_s, fall_s, blur_s, row_s)
    before, _ = given_off(open_s, duration_s, rise_s, fall_s, blur_s, row_s)
    return after - before


@EXACT.kept
def _sharp(since_s: float, duration_s: float, rise_s: float, fall_s: float) -> tuple[float, float]:
    """Return the share and the rate where nothing is blurred."""
    if since_s <= 0.0:
        return 0.0, 0.0
    reached, whole = 1.0, duration_s
    if rise_s > 0.0:
        reached = 1.0 - np.exp(-duration_s / rise_s)
        whole -= rise_s * reached
    whole += reached * fall_s
    if since_s < duration_s:
        if rise_s > 0.0:
            lit = 1.0 - np.exp(-since_s / rise_s)
            return (since_s - rise_s * lit) / whole, lit / whole
        return since_s / whole, 1.0 / whole
    if fall_s <= 0.0:
        return 1.0, 0.0
    left = reached * np.exp(-(since_s - duration_s) / fall_s)
    return 1.0 - fall_s * left / whole, left / whole
