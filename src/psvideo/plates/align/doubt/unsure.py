"""By how much a light's plate at an instant may be off where the plates that it is made from do not agree.

What both plates show alike along the motion is sure. Where they differ, shading turned, something passed, or the motion
is not the true one; the plate at the instant then lies somewhere between them, the nearer in time to one the likelier.
"""

import numpy as np

from psvideo.model.arrays import Codes8, Floats
from psvideo.plates.align.doubt.own_means import own_mean
from psvideo.plates.align.velocity.brightness import ROOT_TOE, SCALE
from psvideo.plates.align.velocity.followed import Followed, Pair, odd_width

WINDOW_PX = 3
"""Plates are compared over this many pixels of their sketches: edges that come to lie beside each other are narrow."""
UNKNOWN = np.float32(1e4)
"""What nobody knows of a plate may be off by this much light: it turns a normal by more than any angle."""
NOISE_FACTOR = 1.6
"""Squares of a change below this many times those that noise makes of it are noise."""


def unsure_of(pair: Pair, before: Codes8, after: Codes8, motion: Followed, noise: float) -> Floats:
    """Return the standard error of a light's plate at an instant, (row, col) of the velocities, in units of its light.

    ``before`` and ``after`` are the codes of its sketches, moved to the instant, and ``noise`` is that of their change.
    """
    one, other = before.astype(np.float32), after.astype(np.float32)
    windows = (odd_width(WINDOW_PX, motion.step),) * 2
    square = own_mean((other - one) ** 2, windows, motion.moves) - np.float32(NOISE_FACTOR * noise**2)
    since_s, until_s = motion.time_s - pair.before.time_s, pair.after.time_s - motion.time_s
    share = min(abs(since_s), abs(until_s)) / (since_s + until_s)
    per_code = own_mean(one + other, windows, motion.moves) / np.float32(SCALE) + np.float32(2 * ROOT_TOE)
    per_code *= np.float32(share * pair.before.white / SCALE)
    return np.asarray(np.sqrt(np.maximum(square, 0)) * per_code, np.float32)
