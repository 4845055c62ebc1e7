"""Plates of one light that differ in brightness as a whole (exposure set by the camera, lamps that sag) are compared as
if they did not: a change of exposure is no motion.
"""

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.compute.ranks import median
from psvideo.model.arrays import Floats
from psvideo.plates.align.velocity.flow import TOE, Sketch

LIT, NEAR_WHITE = 32, 250
"""Codes between which brightness is compared: below is mostly black, above may be cut off at a sketch's white."""
FEWEST = 64
"""Blocks that are compared, at least."""
EXPLAINED = 0.5
"""Brightness is evened out where it leaves less than this share of the usual block's change unexplained: what moves
changes few blocks, but these a lot."""
EVERY_CODE = np.arange(256, dtype=np.float32)
ROOT_TOE = float(np.sqrt(TOE))
SCALE = 255 / (float(np.sqrt(1 + TOE)) - ROOT_TOE)


def evened(before: Sketch, after: Sketch) -> Sketch:
    """Return ``after`` in the brightness of ``before`` where a factor explains most of the usual change; else as it is.

    Both sketches are of one light and one scale. What moves changes few blocks by one factor, so that the median over
    all lit blocks gives the exposure, and motion is left to be found.
    """
    both = before.seen & after.seen
    rows, cols = (
        np.linspace(0, pixels - 1, blocks).astype(np.intp)
        for pixels, blocks in zip(both.shape, before.blocks.shape, strict=True)
    )
    seen = both[np.ix_(rows, cols)]
    one, other = before.blocks[seen], after.blocks[seen]
    lit = (np.minimum(one, other) > LIT) & (np.maximum(one, other) < NEAR_WHITE)
    if np.count_nonzero(lit) < FEWEST:
        return after
    gain = median(light_of(one[lit]) / light_of(other[lit]))
    change = median(np.abs(other[lit] - one[lit]))
    most = float(np.abs(_brightened(EVERY_CODE, gain) - EVERY_CODE).max())
    if most <= (1 - EXPLAINED) * change:  # so little that it leaves more: at rest
        return after
    left = median(np.abs(_brightened(other[lit], gain) - one[lit]))
    if left >= EXPLAINED * change:
        return after
    table = np.rint(_brightened(EVERY_CODE, gain)).astype(np.uint8)
    codes = table[after.codes]
    codes = np.where(after.codes < NEAR_WHITE, codes, np.maximum(codes, before.codes))  # clipped: so bright at least
    codes = np.where(np.maximum(codes, before.codes) < LIT, before.codes, codes)  # nearly black: noise cut off at zero
    size = after.blocks.shape[1], after.blocks.shape[0]
    blocks = cv2.resize(codes.astype(np.float32), size, interpolation=cv2.INTER_AREA)
    return replace(after, codes=codes, blocks=np.asarray(blocks, np.float32))


def light_of(codes: NDArray[np.float32]) -> Floats:
    """Return the light that a sketch's codes stand for, 1 = white."""
    return np.asarray(np.square(codes / np.float32(SCALE) + np.float32(ROOT_TOE)) - np.float32(TOE), np.float32)


def _brightened(codes: NDArray[np.float32], gain: float) -> Floats:
    """Return the codes of this many times the light."""
    light = np.clip(np.float32(gain) * light_of(codes), 0, 1)
    return np.asarray((np.sqrt(light + np.float32(TOE)) - np.float32(ROOT_TOE)) * np.float32(SCALE), np.float32)
