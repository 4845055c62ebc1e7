"""What lights that follow each other show of motion: which velocity they propose, how well they agree along one.

Plates of one light lie a round apart, and what repeats itself (a checker, a fence, folds) fits the next of its kind
there. Plates of two lights lie a flash apart. Their shading differs, but paint and outlines are edges under both: flow
leads from the logarithm of light without its shading to that of the next light, and the correlation of the two, once
each is brought to one instant along a velocity, says how well they agree.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from psvideo.compute.threads import over_ranges
from psvideo.model.arrays import Codes8, Flags, Floats
from psvideo.plates.align.velocity.brightness import light_of
from psvideo.plates.align.velocity.flow import TOE, evenly_spread, flow_from, flow_threads
from psvideo.plates.align.velocity.moving_kernel import arriving_rows, moved_rows

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
MOST_STEPS = 4
"""Flow is looked for between at most so many lights and those that follow them, evenly spread."""
LEAST_STEP = 1e-3
"""Lights that lie nearer together in time than this share of them all are of one flash."""
COARSER = 1
"""Flow from flash to flash is found on pictures halved once more than that from round to round: it takes a third of the
time, and is as good where the way is short."""
LONE_PX = 5
"""The middle of what steps propose is the middle over such a window, too: single steps go astray in single places."""


@dataclass(frozen=True, kw_only=True)
class BetweenLights:
    """The detail of every light's plate that is nearest to the instant, (light, row, col), in the order of time, the
    seconds from each of them to the instant, (light,), below 0 where it is later, and how many velocities there are,
    (row, col). Where the rows of a plate show several instants, ``rows_s`` (light, row) are the seconds from each of
    the velocities' rows, and the lights are in the order in which they come."""

    details: Codes8
    since_s: Floats
    shape: tuple[int, int]
    rows_s: Floats | None = None

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

    @classmethod
    def of_rows(
        cls, codes: Sequence[tuple[Codes8, Codes8]], rows_s: Floats, each_row_s: Floats, shape: tuple[int, int]
    ) -> "BetweenLights":
        """The same of plates whose rows show several instants: the times to them (light, 2, row), of every row of the
        codes, and of every row of velocities."""
        details = np.empty((len(codes), *codes[0][0].shape), np.uint8)

        def sharpen(place: int, _: int) -> None:
            first = _is_first(rows_s[place])
            details[place] = edges_of(np.where(first[:, None], *codes[place]))

        over_ranges(sharpen, len(codes), each=1)
        near = np.stack([np.where(_is_first(one), one[0], -one[1]) for one in each_row_s])
        return cls(details=details, since_s=near.mean(axis=1), shape=shape, rows_s=near)

    def proposed(self) -> list[Floats]:
        """Return the velocity, (2, row, col), in the middle of those by which one light's edges become those of the
        next; none where all lights are of one flash, or a plate's rows of several."""
        if self.rows_s is not None:
            return []
        last_s = float(self.since_s[0] - self.since_s[-1])
        steps = [
            place
            for place in range(len(self.details) - 1)
            if self.since_s[place] - self.since_s[place + 1] > LEAST_STEP * last_s
        ]
        if not steps:
            return []
        chosen = [steps[place] for place in evenly_spread(len(steps), MOST_STEPS)]
        ways = over_ranges(lambda n, _: self._stepped(chosen[n]), len(chosen), each=1, threads=flow_threads())
        return [np.stack([cv2.medianBlur(plane, LONE_PX) for plane in _middle(ways)])]

    def _stepped(self, place: int) -> Floats:
        """Return the velocity, (2, row, col), by which a light's edges become those of the next one."""
        since_s = float(self.since_s[place])
        step_s = since_s - float(self.since_s[place + 1])
        flow = flow_from(self.details[place], self.details[place + 1], coarser=COARSER)
        out = np.empty((2, *self.shape), np.float32)
        shares, per_s = (np.full(self.shape[0], value, np.float32) for value in (since_s / step_s, 1 / step_s))
        arriving_rows(flow, shares, per_s, 0, self.shape[0], out)
        return out

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
        since_s = np.full(self.shape[0], self.since_s[place], np.float32)
        if self.rows_s is not None:
            since_s = self.rows_s[place]
        moved_rows(self.details[place], since_s, velocity, STRIDE, 0, len(out), out)
        out -= MIDDLE
        return out


def _is_first(spans_s: Floats) -> Flags:
    """Return which rows are nearer to the plate before than to the one after, by the times to both, (2, row)."""
    return np.asarray(np.abs(spans_s[0]) <= np.abs(spans_s[1]))


def _middle(few: Sequence[Floats]) -> Floats:
    """Return the median of one to four arrays of a shape.

    >>> [float(_middle([np.float32(one) for one in range(first, 5)])) for first in range(1, 5)]
    [2.5, 3.0, 3.5, 4.0]
    """
    total = np.sum(few, axis=0)
    if len(few) <= 2:
        return np.asarray(total / np.float32(len(few)), np.float32)
    total -= np.max(few, axis=0) + np.min(few, axis=0)
    return np.asarray(total / np.float32(len(few) - 2), np.float32)


def edges_of(codes: Codes8) -> Codes8:
    """Return edges of paint and shape, whatever the light on them, in codes."""
    smooth = np.asarray(cv2.GaussianBlur(codes.astype(np.float32), (0, 0), SMOOTH_PX), np.float32)
    level = np.log(light_of(smooth) + np.float32(2 * TOE))
    detail = level - cv2.blur(level, (SHADING_PX,) * 2)
    size = np.sqrt(np.maximum(cv2.blur(detail * detail, (EVEN_PX,) * 2), 0)) + LEAST_DETAIL
    return np.asarray(np.clip(MIDDLE + CODES_EACH * detail / size + np.float32(0.5), 0, 255), np.uint8)
