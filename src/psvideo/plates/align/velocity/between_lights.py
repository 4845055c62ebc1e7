"""Whether lights show the same paint at one instant, once each one's plate is brought there along a velocity.

Plates of one light lie a round apart, and what repeats itself (a checker, a fence, folds) fits the next of its kind
there. Plates of two lights lie a flash apart. Their shading differs, but paint and outlines are edges under both: the
correlation of what is left of the logarithm of light without its shading says how well two lights agree.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from psvideo.compute.threads import over_ranges
from psvideo.model.arrays import Codes8, Floats
from psvideo.plates.align.velocity.brightness import light_of
from psvideo.plates.align.velocity.flow import TOE
from psvideo.plates.align.velocity.moving_kernel import moved_rows

SMOOTH_PX, SHADING_PX, EVEN_PX = 1.0, 13, 21
"""Detail is the logarithm of smoothed light without its mean over the second, as a share of its size over the third."""
LEAST_DETAIL = np.float32(0.03)
"""Less detail, as a share of light, is noise."""
MIDDLE, CODES_EACH = np.float32(128), np.float32(40)
"""Codes of no detail, and of as much as there is around."""
LEAST = np.float32(0.05) * CODES_EACH**2
"""Detail whose square is less than this shows nothing that could agree."""
STRIDE = 2
"""Agreement is a mean over windows: every second velocity, in rows and columns, is enough."""


@dataclass(frozen=True, kw_only=True)
class BetweenLights:
    """The detail of every light's plate that is nearest to the instant, (light, row, col), in the order of time, the
    seconds from each of them to the instant, (light,), below 0 where it is later, and how many velocities there are,
    (row, col)."""

    details: Codes8
    since_s: Floats
    shape: tuple[int, int]

    @classmethod
    def of(cls, codes: Sequence[tuple[Codes8, Codes8]], spans_s: Floats, shape: tuple[int, int]) -> "BetweenLights":
        """``codes`` are those of the plates before and after, and ``spans_s`` (light, 2) the times since and until."""
        first = np.abs(spans_s[:, 0]) <= np.abs(spans_s[:, 1])
        since_s = np.where(first, spans_s[:, 0], -spans_s[:, 1])
        order = np.argsort(-since_s, kind="stable")
        details = np.empty((len(codes), *codes[0][0].shape), np.uint8)

        def sharpen(place: int, _: int) -> None:
            before, after = codes[order[place]]
            details[place] = edges_of(before if first[order[place]] else after)

        over_ranges(sharpen, len(codes), each=1)
        return cls(details=details, since_s=since_s[order], shape=shape)

    def disagree(self, velocity: Floats, window_px: int) -> Floats:
        """Return how little lights that follow each other agree along a velocity over windows of pixels of the
        sketches, (row, col): one minus their correlation, 0 to 2, in the mean."""
        stride = STRIDE * self.details.shape[1] // self.shape[0]
        size = (max(window_px // stride | 1, 3),) * 2
        moved = over_ranges(lambda place, _: self._moved(place, velocity), len(self.details), each=1)
        sizes = over_ranges(lambda place, _: np.sqrt(cv2.blur(moved[place] ** 2, size)), len(moved), each=1)

        def unlike(place: int, _: int) -> Floats:
            agree = cv2.blur(moved[place] * moved[place + 1], size)
            return np.asarray(1 - agree / (sizes[place] * sizes[place + 1] + LEAST), np.float32)

        total = np.zeros_like(moved[0])
        for one in over_ranges(unlike, len(moved) - 1, each=1):
            total += one
        total /= max(len(self.details) - 1, 1)
        return np.asarray(cv2.resize(total, self.shape[::-1], interpolation=cv2.INTER_LINEAR), np.float32)

    def _moved(self, place: int, velocity: Floats) -> Floats:
        out = np.empty([-(-length // STRIDE) for length in self.shape], np.float32)
        moved_rows(self.details[place], self.since_s[place], velocity, STRIDE, 0, len(out), out)
        out -= MIDDLE
        return out


def edges_of(codes: Codes8) -> Codes8:
    """Return edges of paint and shape, whatever the light on them, in codes."""
    smooth = np.asarray(cv2.GaussianBlur(codes.astype(np.float32), (0, 0), SMOOTH_PX), np.float32)
    level = np.log(light_of(smooth) + np.float32(2 * TOE))
    detail = level - cv2.blur(level, (SHADING_PX,) * 2)
    size = np.sqrt(np.maximum(cv2.blur(detail * detail, (EVEN_PX,) * 2), 0)) + LEAST_DETAIL
    return np.asarray(np.clip(MIDDLE + CODES_EACH * detail / size + np.float32(0.5), 0, 255), np.uint8)
