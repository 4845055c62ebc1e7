"""How everything moves at an instant, found from all lights together: one velocity for every pixel.

What moves is the same under every light. Flow between the plates of single lights (before and after the instant)
proposes velocities, and so does what the picture's change as a whole correlates with, where flow does not reach;
standing still is always proposed. Taken is what makes the plates of all lights alike, in small windows, and rest where
nothing explains much more than rest does: flow that fits shadows and shading of one light says nothing of the others.
"""

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.compute.threads import over_ranges
from psvideo.plates.align.velocity.between_lights import BetweenLights
from psvideo.plates.align.velocity.correlation import displacements
from psvideo.plates.align.velocity.flow import (
    FINE_PIXELS,
    Codes,
    Flags,
    Sketch,
    Vectors,
    comparable,
    flow_from,
    pixel_places,
)
from psvideo.plates.align.velocity.moving_kernel import arriving_rows, unlike_rows

MOST_FLOWS = 4
"""Flow is computed between the plates of at most this many lights, evenly spread: more give the same proposals."""
WINDOW_PX, FINE_PX = 9, 3
"""A velocity is tested over the first window; over the second, a smaller one, rest must not explain the plates
better."""
EXPLAINED, MARGIN, GAIN = 0.65, 0.05, 0.25
"""A velocity is accepted where what it leaves unexplained is below the first (a share of what rest leaves) less the
second, or below what rest leaves by the third; the second and third count once for every light."""
FINE_EXPLAINED = 0.7
"""... and, over the smaller window, below this share: otherwise outlines carry along what lies beside them."""
GROWN, GROWN_PX = 2, 27
"""This often, pixels beside moving parts join them where both motion and rest explain them, within this window."""
UNEXPLAINED, MOST = 0.3, 0.1
"""Where plates differ by more than the first per light, neither motion nor rest explains them: a pixel then joins only
if the moving share of its window exceeds the resting share by the second."""
STILL_CODES, STILL_LIGHTS, STILL_SHARE = 3.0, 2, 0.7
"""Pixels that change by fewer codes than the first, under at least two lights and this share of all, are at rest: what
changes under the other lights is a shadow, or something that passes."""
FINEST_PX, SHADING_PX, SHADING = 1.0, 13, 0.7
"""Before they are compared, sketches are smoothed by the first, and most of what is wider than the second is removed:
as surfaces turn, their shading changes, their detail does not."""
CONTRAST = 10.0
"""The most contrast of detail, in codes, over such a window; more is scaled down to it: as surfaces turn, the edges
between them stay in place, but the light on either side changes."""
PUZZLING, PUZZLED = 0.5, 0.004
"""Where more of the picture than the second differs by more than the first per light, things move faster than flow can
follow."""
FAR = 2
"""Then this many displacements of all changing parts together are tried."""
COARSE = 2
"""Sketches of FINE_PIXELS and more get a velocity in every second row and column: flow is no finer there."""
REFUTED_PX, AGREED, WORSE = 27, 0.35, 0.1
"""Where lights disagree by less than the second at rest, over the first, and by the third more along a motion, it is
not the true one: what repeats itself fits the next of its kind from round to round, but not from flash to flash. A
window holds some 80 details 3 px wide: a correlation of 0.65 between two lights is known to 0.065, the mean of two
pairs to 0.045, the difference of two such means to 0.065, so that chance makes it 0.1 more in one of fifteen."""
BAND_PIXELS = 1 << 16
LEAST = np.float32(1e-6)


@dataclass(frozen=True, kw_only=True)
class Pair:
    """The sketches of a light before and after an instant, in the same brightness."""

    before: Sketch
    after: Sketch


@dataclass(frozen=True, kw_only=True)
class Followed:
    """``velocity`` (2, row, col) is x right, y down, in its own pixels per second, 0 where not ``moves``. ``rests``
    (row, col) is what clearly stands beside that; the rest looks alike either way. Each of these pixels is ``step`` by
    ``step`` of the sketches'."""

    time_s: float
    velocity: Vectors
    moves: Flags
    rests: Flags
    step: int = 1

    @functools.cached_property
    def nearby(self) -> Vectors:
        """The velocity of what moves nearest to every pixel, (2, row, col)."""
        if not self.moves.any():
            return self.velocity
        still = (~self.moves).astype(np.uint8)
        labels = cv2.distanceTransformWithLabels(still, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)[1]
        of_label = np.zeros((2, int(labels.max()) + 1), np.float32)
        of_label[:, labels[self.moves]] = self.velocity[:, self.moves]
        return of_label[:, labels]

    def way(self, span_s: float) -> Vectors:
        """Return how far every pixel goes in a time, shape (2, row, col)."""
        return np.float32(span_s) * self.velocity


def followed_at(pairs: Sequence[Pair], time_s: float) -> Followed:
    """Return how everything moves at an instant, which may lie before or after some lights' plates too."""
    lights = _Lights.of(pairs, time_s)
    between = BetweenLights.of(lights.codes, lights.spans_s, lights.shape)
    none = np.zeros((2, *lights.shape), np.float32)
    rest = lights.unlike(none)
    wide_rest = lights.mean(rest, WINDOW_PX)
    best = np.full(lights.shape, np.inf, np.float32)
    velocity = none.copy()
    for proposed in lights.proposed():
        _take_better(lights, proposed, velocity, best)
    puzzling = np.minimum(best, wide_rest) > PUZZLING * lights.count
    if np.mean(puzzling & lights.stays(velocity)) > PUZZLED:
        for proposed in lights.proposed_far():
            _take_better(lights, proposed, velocity, best)
    fine_rest = lights.mean(rest, FINE_PX)
    fine = lights.mean(lights.unlike(velocity), FINE_PX)
    stirs = lights.still() < max(STILL_LIGHTS, STILL_SHARE * lights.count)
    moves = _clearly(best, wide_rest, lights.count) & (fine < np.float32(FINE_EXPLAINED) * fine_rest) & stirs
    rested = between.disagree(none, REFUTED_PX)
    moves &= ~_refuted(rested, between.disagree(velocity, REFUTED_PX))
    rests = np.zeros_like(moves)
    for _ in range(GROWN):
        moves, rests = _grown(lights, moves, velocity, (wide_rest, fine_rest), stirs)
    moves &= ~_refuted(rested, between.disagree(velocity, REFUTED_PX))
    velocity *= moves
    return Followed(time_s=time_s, velocity=velocity, moves=moves, rests=rests & ~moves, step=lights.step)


def _refuted(rested: Vectors, moved: Vectors) -> Flags:
    """Return where lights agree at rest, and not along a motion."""
    return np.asarray((rested < np.float32(AGREED)) & (moved > rested + np.float32(WORSE)))


def _clearly(unlike: Vectors, other: Vectors, count: int) -> Flags:
    """Return where one motion explains clearly more than another."""
    return np.asarray(unlike < np.maximum(EXPLAINED * other - MARGIN * count, other - GAIN * count))


def _grown(
    lights: "_Lights", moves: Flags, velocity: Vectors, rest: tuple[Vectors, Vectors], stirs: Flags
) -> tuple[Flags, Flags]:
    """Return ``moves`` with those beside it that move along as well as they rest, and what beside it clearly rests; put
    the ``velocity`` of the former in: what is bare shows no motion of its own, and follows the most of what is around.

    What neither explains may be hidden by what moves: it joins where there is more of that before and behind it.
    """
    size = odd_width(GROWN_PX, lights.step)
    around = _mean(moves.astype(np.float32), size)
    near = np.empty_like(velocity)
    for plane, own in zip(near, velocity, strict=True):
        plane[:] = _mean(own * moves, size) / np.maximum(around, LEAST)
    unlike = lights.unlike(near)
    wide, fine = lights.mean(unlike, WINDOW_PX), lights.mean(unlike, FINE_PX)
    rests = _clearly(rest[0], wide, lights.count)
    most = around - _mean(rests.astype(np.float32), size)
    half = np.float32(lights.spans_s.sum(axis=1).mean() / 2) * near
    ends = np.minimum(_shifted(most, half), _shifted(most, -half))
    joins = (most > 0) & (fine < rest[1] + np.float32(MARGIN * lights.count)) & stirs & ~moves & ~rests
    joins &= (wide <= np.float32(UNEXPLAINED * lights.count)) | (ends > MOST)
    np.copyto(velocity, near, where=joins)
    return moves | joins, rests


def _shifted(values: Vectors, way: Vectors) -> Vectors:
    x, y = pixel_places(*values.shape)
    x, y = x + way[0], y + way[1]
    return np.asarray(cv2.remap(values, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE), np.float32)


def _take_better(lights: "_Lights", proposed: Vectors, velocity: Vectors, best: Vectors) -> None:
    unlike = lights.mean(lights.unlike(proposed), WINDOW_PX)
    better = unlike < best
    np.copyto(best, unlike, where=better)
    np.copyto(velocity, proposed, where=better)


def odd_width(window_px: int, step: int) -> int:
    """Return the width of a window of ``window_px`` in pixels of ``step`` of the sketches': an odd number, 3 or more (1
    stays 1)."""
    return max(window_px // step | 1, min(window_px, 3))


def _mean(values: Vectors, window_px: int) -> Vectors:
    return np.asarray(cv2.blur(values, (window_px, window_px)), np.float32)


@dataclass(frozen=True, kw_only=True)
class _Lights:
    """The lights' codes as flow sees them (before, after), their detail (light, row, col), and the times to them."""

    codes: tuple[tuple[Codes, Codes], ...]
    befores: Codes
    afters: Codes
    spans_s: Vectors

    @classmethod
    def of(cls, pairs: Sequence[Pair], time_s: float) -> "_Lights":
        codes = tuple(comparable(pair.before, pair.after) for pair in pairs)
        befores, afters = np.empty((2, len(pairs), *codes[0][0].shape), np.uint8)

        def sharpen(light: int, _: int) -> None:
            befores[light], afters[light] = (_detail(picture) for picture in codes[light])

        over_ranges(sharpen, len(pairs), each=1)
        spans_s = [(time_s - pair.before.time_s, pair.after.time_s - time_s) for pair in pairs]
        return cls(codes=codes, befores=befores, afters=afters, spans_s=np.array(spans_s, np.float32))

    @property
    def count(self) -> int:
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

    def mean(self, values: Vectors, window_px: int) -> Vectors:
        """Return means over windows of this many pixels of the sketches."""
        return _mean(values, odd_width(window_px, self.step))

    def unlike(self, velocity: Vectors) -> Vectors:
        """Return how unlike all lights' plates are along velocities, shape (row, col), 0 to the number of lights."""
        out = np.empty(self.shape, np.float32)

        def run(first: int, last: int) -> None:
            unlike_rows(self.befores, self.afters, self.spans_s, velocity, first, last, out)

        over_ranges(run, self.shape[0], each=max(BAND_PIXELS // self.shape[1], 1))
        return out

    def stays(self, velocity: Vectors) -> Flags:
        """Return what is within the picture at both ends of its way: the rest is hidden in one plate of every light."""
        before_s, after_s = (np.float32(span_s) for span_s in self.spans_s.mean(axis=0))
        within = np.ones(self.shape, np.bool_)
        for places, own, size in zip(pixel_places(*self.shape), velocity, self.shape[::-1], strict=True):
            for ends in (places - before_s * own, places + after_s * own):
                within &= (ends >= 0) & (ends <= size - 1)
        return within

    def still(self) -> NDArray[np.intp]:
        """Return under how many lights a pixel shows the same at rest, shape (row, col)."""
        count = np.zeros(self.shape, np.intp)
        for one, other in self.codes:
            change = cv2.GaussianBlur(cv2.subtract(other, one, dtype=cv2.CV_32F), (0, 0), FINEST_PX)
            still = _mean(np.asarray(change * change, np.float32), FINE_PX) < STILL_CODES**2
            count += still[: self.step * len(count) : self.step, : self.step * count.shape[1] : self.step]
        return count

    def proposed(self) -> list[Vectors]:
        """Return the velocities that flow proposes: both ways of few lights, one way of each of more."""
        chosen = _spread(self.count, MOST_FLOWS)
        ways = [(light, bool(n % 2)) for n, light in enumerate(chosen)]
        if len(chosen) <= MOST_FLOWS // 2:
            ways = [(light, back) for light in chosen for back in (False, True)]
        return self._flows([(light, back, None) for light, back in ways])

    def proposed_far(self) -> list[Vectors]:
        """Return velocities of what moved farther than flow reaches by itself."""
        found = displacements([tuple(map(_smoothed, pair)) for pair in self.codes], FAR)
        some = _spread(self.count, MOST_FLOWS // FAR)
        constant = [np.empty((2, *self.shape), np.float32) for _ in found]
        for plane, (x, y) in zip(constant, found, strict=True):
            plane[0], plane[1] = np.array([x, y]) / self.step / self.spans_s.sum(axis=1).mean()
        return constant + self._flows([(light, bool(n % 2), place) for place in found for n, light in enumerate(some)])

    def _flows(self, ways: list[tuple[int, bool, tuple[float, float] | None]]) -> list[Vectors]:
        def run(first: int, _: int) -> Vectors:
            light, back, start_px = ways[first]
            since_s, until_s = (float(span) for span in self.spans_s[light])
            one, other = self.codes[light]
            sign = -1.0 if back else 1.0
            start = None if start_px is None else (sign * start_px[0], sign * start_px[1])
            flow = flow_from(other, one, start) if back else flow_from(one, other, start)
            round_s = since_s + until_s
            out = np.empty((2, *self.shape), np.float32)
            share = np.float32((until_s if back else since_s) / round_s)
            arriving_rows(flow, share, np.float32(sign / round_s), 0, out.shape[1], out)
            return out

        return over_ranges(run, len(ways), each=1)


def _spread(count: int, most: int) -> list[int]:
    return sorted({round(float(place)) for place in np.linspace(0, count - 1, min(count, most))})


def _smoothed(codes: Codes) -> Vectors:
    return np.asarray(cv2.GaussianBlur(codes.astype(np.float32), (0, 0), FINEST_PX), np.float32)


def _detail(codes: Codes) -> Codes:
    smooth = _smoothed(codes)
    shading = _mean(smooth, SHADING_PX)
    detail = smooth - shading
    contrast = np.sqrt(np.maximum(_mean(detail * detail, SHADING_PX), 0))  # sums that run along rows round
    detail *= np.float32(CONTRAST) / np.maximum(contrast, np.float32(CONTRAST))
    detail += np.float32(1 - SHADING) * shading
    return np.asarray(np.clip(detail + np.float32(64.5), 0, 255), np.uint8)
