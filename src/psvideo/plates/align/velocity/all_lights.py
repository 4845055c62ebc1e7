"""The plates of all lights around an instant: which velocities they propose, and how unlike they are along one.

Flow between the plates of single lights (before and after the instant) proposes velocities, and so does what the
picture's change as a whole correlates with, where flow does not reach. Plates are compared by their detail, since
shading changes as surfaces turn.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.compute.eight_lanes import EIGHT
from psvideo.compute.threads import over_ranges
from psvideo.model.arrays import Codes8, Flags, Floats
from psvideo.plates.align.velocity.correlation import displacements
from psvideo.plates.align.velocity.detail import FINEST_PX, detail_of, smoothed
from psvideo.plates.align.velocity.flow import (
    FINE_PIXELS,
    comparable,
    evenly_spread,
    flow_from,
    flow_threads,
    pixel_places,
)
from psvideo.plates.align.velocity.followed import Pair, mean_over, odd_width
from psvideo.plates.align.velocity.moving_kernel import arriving_rows, unlike_rows

MOST_FLOWS = 4
"""Flow is computed between the plates of at most this many lights, evenly spread: more give the same proposals."""
STILL_CODES, STILL_LIGHTS, STILL_SHARE, STILL_PX = 3.0, 2, 0.7, 3
"""Pixels that change by fewer codes than the first, under at least two lights and this share of all, are at rest: what
changes under the other lights is a shadow, or something that passes."""
FAR = 2
"""Then this many displacements of all changing parts together are tried."""
COARSE = 2
"""Sketches of FINE_PIXELS and more get a velocity in every second row and column: flow is no finer there."""
BAND_PIXELS = 1 << 14
WINDOW_PX, FINE_PX = 9, 3
"""A velocity is tested over the first window; over the second, a smaller one, rest must not explain the plates
better."""


@dataclass(frozen=True, kw_only=True)
class AllLights:
    """The lights' codes as flow sees them (before, after), their detail (light, row, col), and the times to them: of
    every light, ``spans_s`` (light, 2), and where rows of a plate show several instants, of each row of velocities,
    ``rows_s`` (light, 2, row); None where all rows of a plate show one."""

    codes: tuple[tuple[Codes8, Codes8], ...]
    befores: Codes8
    afters: Codes8
    spans_s: Floats
    rows_s: Floats | None = None

    @classmethod
    def of(cls, pairs: Sequence[Pair], time_s: float, rows_s: Floats | None = None) -> "AllLights":
        """Make the plates of pairs comparable at an instant; ``rows_s`` (light, 2, row of the sketches) are the times
        to their rows, where these show several instants."""
        codes = tuple(comparable(pair.before, pair.after) for pair in pairs)
        befores, afters = np.empty((2, len(pairs), *codes[0][0].shape), np.uint8)

        def sharpen(light: int, _: int) -> None:
            befores[light], afters[light] = map(detail_of, codes[light])

        over_ranges(sharpen, len(pairs), each=1)
        if rows_s is not None:
            step = COARSE if befores[0].size >= FINE_PIXELS else 1
            each = np.ascontiguousarray(rows_s[:, :, : len(befores[0]) // step * step : step])
            return cls(codes=codes, befores=befores, afters=afters, spans_s=rows_s.mean(axis=2), rows_s=each)
        spans_s = [(time_s - pair.before.time_s, pair.after.time_s - time_s) for pair in pairs]
        return cls(codes=codes, befores=befores, afters=afters, spans_s=np.array(spans_s, np.float32))

    @cached_property
    def each_row_s(self) -> Floats:
        """The times to every light's plates, of every row of velocities, (light, 2, row)."""
        if self.rows_s is not None:
            return self.rows_s
        return np.repeat(self.spans_s[:, :, None], self.shape[0], axis=2)

    @property
    def count(self) -> int:
        """How many lights there are."""
        return len(self.codes)

    @property
    def step(self) -> int:
        """How many pixels of the sketches lie between two velocities."""
        return COARSE if self.befores[0].size >= FINE_PIXELS else 1

    @property
    def shape(self) -> tuple[int, int]:
        """How many velocities there are, (row, col)."""
        rows, cols = self.befores.shape[1:]
        return rows // self.step, cols // self.step

    def mean(self, values: Floats, window_px: int) -> Floats:
        """Return means over windows of this many pixels of the sketches."""
        return mean_over(values, odd_width(window_px, self.step))

    def unlike(self, velocity: Floats) -> Floats:
        """Return how unlike all lights' plates are along velocities, shape (row, col), 0 to the number of lights."""
        out, spans_s = np.empty(self.shape, np.float32), self.each_row_s

        def run(first: int, last: int) -> None:
            room = np.zeros((4, -(-self.shape[1] // EIGHT) * EIGHT), np.float32)
            unlike_rows(self.befores, self.afters, spans_s, velocity, first, last, room, out)

        over_ranges(run, self.shape[0], each=max(BAND_PIXELS // self.shape[1], 1))
        return out

    def unlike_over_windows(self, velocity: Floats) -> tuple[Floats, Floats]:
        """Return how unlike plates are along velocities over both windows, a wide and a fine one, (row, col)."""
        unlike = self.unlike(velocity)
        return self.mean(unlike, WINDOW_PX), self.mean(unlike, FINE_PX)

    def stays(self, velocity: Floats) -> Flags:
        """Return what is within the picture at both ends of its way: the rest is hidden in one plate of every light."""
        before_s, after_s = (np.float32(span_s) for span_s in self.spans_s.mean(axis=0))
        within = np.ones(self.shape, np.bool_)
        for places, own, size in zip(pixel_places(*self.shape), velocity, self.shape[::-1], strict=True):
            for ends in (places - before_s * own, places + after_s * own):
                within &= (ends >= 0) & (ends <= size - 1)
        return within

    def least_at_ends(self, values: Floats, velocity: Floats) -> Floats:
        """Return the least of what values (row, col) are half a round before and behind every pixel, along velocities:
        what moves goes on there, and what it hides does not."""
        half = np.float32(self.spans_s.sum(axis=1).mean() / 2) * velocity
        return np.minimum(_shifted(values, half), _shifted(values, -half))

    def unchanged(self) -> NDArray[np.int16]:
        """Return under how many lights every pixel shows the same at rest, shape (row, col)."""
        rows, cols = (length * self.step for length in self.shape)

        def still(light: int, _: int) -> Flags:
            one, other = self.codes[light]
            change = cv2.GaussianBlur(cv2.subtract(other, one, dtype=cv2.CV_32F), (0, 0), FINEST_PX)
            little = mean_over(np.asarray(change * change, np.float32), STILL_PX) < STILL_CODES**2
            known = True if self.rows_s is None else self.rows_s[light].any(axis=0)[:, None]
            return np.asarray(little[: rows : self.step, : cols : self.step] & known)

        return np.asarray(np.sum(over_ranges(still, self.count, each=1), axis=0, dtype=np.int16))

    def at_rest(self, unchanged: NDArray[np.int16], others: int) -> Flags:
        """Return what rests, by under how many lights it is ``unchanged``, both (row, col), among them ``others`` under
        which nothing moves."""
        if self.rows_s is None:
            return np.asarray(unchanged >= max(STILL_LIGHTS, STILL_SHARE * (self.count + others)))
        known = self.rows_s.any(axis=1).sum(axis=0) + others
        return np.asarray(unchanged >= np.maximum(STILL_LIGHTS, STILL_SHARE * known)[:, None])

    def proposed(self) -> list[Floats]:
        """Return the velocities that flow proposes: both ways of few lights, one way of each of more."""
        chosen = evenly_spread(self.count, MOST_FLOWS)
        ways = [(light, bool(n % 2)) for n, light in enumerate(chosen)]
        if len(chosen) <= MOST_FLOWS // 2:
            ways = [(light, back) for light in chosen for back in (False, True)]
        return self._flows([(light, back, None) for light, back in ways])

    def proposed_far(self) -> list[Floats]:
        """Return velocities of what moved farther than flow reaches by itself."""
        pairs = (tuple(map(smoothed, pair)) for pair in self.codes)
        found = displacements(pairs, self.codes[0][0].shape, FAR)
        some = evenly_spread(self.count, MOST_FLOWS // FAR)
        constant = [np.empty((2, *self.shape), np.float32) for _ in found]
        for plane, (x, y) in zip(constant, found, strict=True):
            plane[0], plane[1] = np.array([x, y]) / self.step / self.spans_s.sum(axis=1).mean()
        return constant + self._flows([(light, bool(n % 2), place) for place in found for n, light in enumerate(some)])

    def _flows(self, ways: list[tuple[int, bool, tuple[float, float] | None]]) -> list[Floats]:
        def run(first: int, _: int) -> Floats:
            light, back, start_px = ways[first]
            one, other = self.codes[light]
            sign = -1.0 if back else 1.0
            start = None if start_px is None else (sign * start_px[0], sign * start_px[1])
            flow = flow_from(other, one, start) if back else flow_from(one, other, start)
            since_s, until_s = self.each_row_s[light].astype(np.float64)
            round_s = np.where(since_s + until_s > 0, since_s + until_s, np.inf)  # nothing is proposed of no time
            out = np.empty((2, *self.shape), np.float32)
            shares: Floats = ((until_s if back else since_s) / round_s).astype(np.float32)
            arriving_rows(flow, shares, (sign / round_s).astype(np.float32), 0, out.shape[1], out)
            return out

        return over_ranges(run, len(ways), each=1, threads=flow_threads())


def _shifted(values: Floats, way: Floats) -> Floats:
    x, y = pixel_places(*values.shape)
    x, y = x + way[0], y + way[1]
    return np.asarray(cv2.remap(values, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE), np.float32)
