"""How a light's own plates lead into each other, layer by layer: for eyes, where all lights have no motion in common.

Shadows on what turns go their own ways, another one under every light, and behind what stands before them (a guard, a
fence, a twig) no window of a picture shows one motion alone. So what stands is taken out: it changes less, over all
lights, than what lies around it. The gaps are filled with what changes, and flow is looked for in that layer.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np

from psvideo.compute.threads import over_ranges
from psvideo.model.arrays import Codes8, Flags, Floats
from psvideo.plates.align.velocity.flow import changed, comparable, flow_from, pixel_places
from psvideo.plates.align.velocity.followed import Pair, mean_over
from psvideo.plates.align.velocity.moving_kernel import UNLIKE_SQUARE, arriving_rows

AROUND_PX, SMOOTH_PX, EDGE_PX = 5, 0.6, 1.0
"""Change is smoothed by the second, and held against the most of it within the first, smoothed by the third."""
WHOLLY = 1.2
"""What changes by this part less than the most around it lies wholly behind nothing: change is uneven by itself."""
LEAST_CODES = 5.0
"""Where nothing around changes by more codes nothing is taken out."""
FILL_PX = 1.0
"""Gaps are filled by means with such a spread."""
CONNECTED_PX, BY_CHANCE, SURELY = 9, np.float32(0.2), np.float32(0.4)
"""Flow finds a way even for snow, whose pixels change each by itself. Over a window of so many pixels the change of one
correlates with its neighbour's, in the direction where it does so the most, by 0.1 then, and less than the second 4
times of 5; edges and thin shadows that go by come to 0.7, and to more than the third 3 times of 4."""
LEAST = np.float32(1e-6)


@dataclass(frozen=True, kw_only=True)
class OwnFlow:
    """Of one light: which share of every pixel lies ``behind`` what stands (row, col); its plates' codes in that layer,
    ``before`` and ``after``; the flows ``there`` and ``back`` between them, (row, col, 2) in pixels; where anything
    ``changes`` between the two, and how far what changes is ``connected``, from 0, pixels by themselves, to 1."""

    pair: Pair
    behind: Floats
    before: Floats
    after: Floats
    there: Floats
    back: Floats
    changes: Flags
    connected: Floats

    def ways(self, time_s: float) -> list[Floats]:
        """Return the velocities at an instant by either flow, each (2, row, col) in pixels per second."""
        since_s, until_s = time_s - self.pair.before.time_s, self.pair.after.time_s - time_s
        round_s = since_s + until_s
        ways = []
        for flow, share, sign in ((self.there, since_s / round_s, 1.0), (self.back, until_s / round_s, -1.0)):
            way = np.empty((2, *self.behind.shape), np.float32)
            shares, per_s = (np.full(way.shape[1], value, np.float32) for value in (share, sign / round_s))
            arriving_rows(flow, shares, per_s, 0, way.shape[1], way)
            ways.append(way)
        return ways

    def shares(self, ways: Sequence[Floats], time_s: float) -> list[Floats]:
        """Return what every way counts beside rest at an instant, (row, col), by how alike it makes the plates: nothing
        where nothing changes at either end of it."""
        likely = [self._likely(way, time_s) for way in ways]
        total = sum(likely, self._alike(np.zeros_like(ways[0]), time_s))
        return [np.asarray(self.behind * one / total, np.float32) for one in likely]

    def _likely(self, way: Floats, time_s: float) -> Floats:
        changes = self.changes.astype(np.float32)
        ends = [_at(changes, way, time_s - shot.time_s) for shot in (self.pair.before, self.pair.after)]
        return np.asarray((np.maximum(*ends) > 0) * self.connected * self._alike(way, time_s), np.float32)

    def _alike(self, way: Floats, time_s: float) -> Floats:
        one = _at(self.before, way, time_s - self.pair.before.time_s)
        other = _at(self.after, way, time_s - self.pair.after.time_s)
        return np.asarray(1 / np.sqrt((other - one) ** 2 + UNLIKE_SQUARE), np.float32)


@dataclass(kw_only=True)
class OwnFlows:
    """Those of the last pairs that were asked for: several instants lie between the same plates."""

    pairs: tuple[tuple[str, int, int], ...] = ()
    found: dict[str, OwnFlow] = field(default_factory=dict)

    def of(self, pairs: Mapping[str, Pair]) -> dict[str, OwnFlow]:
        """Return how every light's own plates lead into each other."""
        asked = tuple((light, pair.before.number, pair.after.number) for light, pair in pairs.items())
        if asked != self.pairs:
            self.pairs, self.found = asked, own_flows(pairs)
        return self.found


def own_flows(pairs: Mapping[str, Pair]) -> dict[str, OwnFlow]:
    """Return how every light's own plates lead into each other, by lights."""
    both = [comparable(pair.before, pair.after) for pair in pairs.values()]
    behind, given = _behind(both), list(pairs.values())
    found = over_ranges(lambda n, _: _own_flow(given[n], both[n], behind), len(given), each=1)
    return dict(zip(pairs, found, strict=True))


def _behind(codes: Sequence[tuple[Codes8, Codes8]]) -> Floats:
    """Return which share of every pixel lies behind what stands, by the lights' codes (before, after)."""
    total = np.zeros(codes[0][0].shape, np.float32)
    for one, other in codes:
        change = cv2.subtract(other, one, dtype=cv2.CV_32F)
        total += change * change
    size = cv2.GaussianBlur(np.sqrt(total / np.float32(len(codes))), (0, 0), SMOOTH_PX)
    most = cv2.GaussianBlur(cv2.dilate(size, np.ones((AROUND_PX,) * 2, np.uint8)), (0, 0), EDGE_PX)
    share = np.minimum(np.float32(WHOLLY) * size / np.maximum(most, LEAST), np.float32(1))
    return np.asarray(np.where(most < np.float32(LEAST_CODES), np.float32(1), share), np.float32)


def _own_flow(pair: Pair, codes: tuple[Codes8, Codes8], behind: Floats) -> OwnFlow:
    before, after = (filled(one.astype(np.float32), behind, FILL_PX) for one in codes)
    one, other = (np.rint(np.clip(layer, 0, 255)).astype(np.uint8) for layer in (before, after))
    blocks = changed(pair.before, pair.after).astype(np.uint8)
    return OwnFlow(
        pair=pair,
        behind=behind,
        before=before,
        after=after,
        there=flow_from(one, other),
        back=flow_from(other, one),
        changes=cv2.resize(blocks, behind.shape[::-1], interpolation=cv2.INTER_NEAREST) > 0,
        connected=_connected(codes),
    )


def _connected(codes: tuple[Codes8, Codes8]) -> Floats:
    """Return how far what changes between codes hangs together (row, col), along a line in any direction at least."""
    change = np.asarray(cv2.subtract(codes[1], codes[0], dtype=cv2.CV_32F), np.float32)
    rows, cols = change.shape
    wider = cv2.copyMakeBorder(change, 1, 1, 1, 1, cv2.BORDER_REPLICATE)
    most, own = np.zeros_like(change), mean_over(change * change, CONNECTED_PX)
    for down, across in ((0, 1), (1, 0), (1, 1), (1, -1)):
        beside = wider[1 + down : rows + 1 + down, 1 + across : cols + 1 + across]
        sizes = np.sqrt(np.maximum(own * mean_over(beside * beside, CONNECTED_PX), LEAST))
        most = np.maximum(most, mean_over(change * beside, CONNECTED_PX) / sizes)
    return np.asarray(np.clip((most - BY_CHANCE) / (SURELY - BY_CHANCE), 0, 1), np.float32)


def filled(picture: Floats, weight: Floats, spread_px: float) -> Floats:
    """Return a picture (row, col[, channel]) in which every pixel is itself as far as its ``weight`` (row, col) goes, 0
    to 1, and what has weight around it for the rest."""
    own = weight if picture.ndim == 2 else weight[..., None]
    total = cv2.GaussianBlur(picture * own, (0, 0), spread_px).reshape(picture.shape)
    around = cv2.GaussianBlur(weight, (0, 0), spread_px).reshape(own.shape)
    return np.asarray(own * picture + (1 - own) * total / np.maximum(around, LEAST), np.float32)


def _at(values: Floats, way: Floats, span_s: float) -> Floats:
    x, y = pixel_places(*values.shape)
    x, y = x - np.float32(span_s) * way[0], y - np.float32(span_s) * way[1]
    return np.asarray(cv2.remap(values, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE), np.float32)
