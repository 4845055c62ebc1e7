"""A light's plate at an instant between two of its flashes: both plates moved along the flow, and blended.

What was hidden in one of the plates is taken from the other; what is unknown counts as not seen. Blending by time also
carries shading over, which changes where a surface turns.
"""

import functools
from dataclasses import dataclass

import cv2
import numpy as np

from psvideo.model.coded import Image
from psvideo.plates.align.flow import Codes, Flags, Flow, Sketch, Vectors, comparable, places
from psvideo.plates.align.packed import packed
from psvideo.plates.mixture import made
from psvideo.plates.sequence import LightPlate

AT_REST, BEFORE, AFTER, BOTH, NOWHERE = range(5)
"""What a pixel is taken from: the nearer plate as it is, one plate moved along the flow, both, none."""

EXPLAINED = 0.5
"""Flow is used where it leaves less than this share of the squared change unexplained, ..."""
LEAST_SQUARE = 1.0
"""... and where that change is more than this, in squared codes; elsewhere moving shows nothing."""
UNLIKE = 12.0
"""Plates that differ by more codes than this, after blurring, do not show the same thing."""
REST = 3.0
"""Where the flow finds nothing, plates that differ by fewer codes are taken as they are."""
BLUR_PX, WINDOW_PX, DETAIL_PX = 1.5, 9, 6.0
REACH_PX = 17
"""Around what moved, flow is used as well: bare parts of a subject move with it."""
SLIVER_PX = 5
"""What is known in narrower strips between what is not lies on outlines, where flow mixes what is before and behind."""
SETTLED_PX = 0.5
"""How far the place that a pixel comes from may still wander when it is looked for step by step."""
STEPS = 6
BAND_ROWS = 64
MARGIN_ROWS = 5
"""Rows beside those that places lie in which count too: for cubic interpolation, and around what is clipped."""


@dataclass(frozen=True, kw_only=True)
class Track:
    """Where every pixel of an instant comes from, on the sketches' grid: the way to it from either plate (row, col, 2),
    and ``source`` (row, col), one of AT_REST to NOWHERE."""

    from_before: Vectors
    from_after: Vectors
    source: Codes


def track(before: Sketch, after: Sketch, flow: Flow, time_s: float) -> Track:
    """Follow the flow to an instant, which may lie before or after both plates too."""
    share = (time_s - before.time_s) / (after.time_s - before.time_s)
    from_before, settled_before = _way_to(flow.forward, share)
    from_after, settled_after = _way_to(flow.backward, 1 - share)
    compared = np.broadcast_to((before.seen & after.seen)[:, None], before.codes.shape)
    shows_before = settled_before & _all_around(flow.steady_before & compared, from_before)
    shows_after = settled_after & _all_around(flow.steady_after & compared, from_after)
    one, other = (_blurred(codes.astype(np.float32), BLUR_PX) for codes in comparable(before, after))
    at_rest = other - one
    along = _fetched(other, from_after) - _fetched(one, from_before)
    square_at_rest = _mean_square(at_rest)
    moves = (_mean_square(along) < EXPLAINED * square_at_rest) & (square_at_rest > LEAST_SQUARE)
    moves = cv2.dilate(moves.astype(np.uint8), np.ones((REACH_PX, REACH_PX), np.uint8)) > 0
    detail = along - _blurred(along, DETAIL_PX)  # shading may change as a surface turns, detail not
    alike = _mean_square(detail) < UNLIKE**2
    source = np.where(square_at_rest < UNLIKE**2, AT_REST, NOWHERE)
    flowing = np.select(
        [shows_before & shows_after & alike, shows_before & ~shows_after, shows_after & ~shows_before],
        [BOTH, BEFORE, AFTER],
        np.where((square_at_rest < REST**2) & compared, AT_REST, NOWHERE),
    )
    source = np.where(moves, flowing, source).astype(np.uint8)
    known = cv2.morphologyEx((source != NOWHERE).astype(np.uint8), cv2.MORPH_OPEN, np.ones((SLIVER_PX, SLIVER_PX)))
    source[(known == 0) & moves] = NOWHERE
    return Track(from_before=from_before, from_after=from_after, source=source)


def _way_to(flow: Vectors, share: float) -> tuple[Vectors, Flags]:
    """Return the way that leads to every pixel when each has gone a share of its flow, and where one was found.

    Flow is known where things start, and asked for where they arrive: the start is looked for step by step.
    """
    way = np.float32(share) * flow
    missed_px = np.zeros(flow.shape[:2], np.float32)
    for _ in range(STEPS):
        further = np.float32(share) * _fetched(flow, way)
        missed_px = np.hypot(further[..., 0] - way[..., 0], further[..., 1] - way[..., 1])
        way = further
    return way, missed_px < SETTLED_PX


def _fetched(values: Vectors, way: Vectors) -> Vectors:
    """Return what every pixel of a picture (row, col) or of vectors finds at the start of its way."""
    x, y = places(*way.shape[:2])
    found = cv2.remap(values, x - way[..., 0], y - way[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(found, np.float32)


def _all_around(flags: Flags, way: Vectors) -> Flags:
    return np.asarray(_fetched(flags.astype(np.float32), way) > 0.9)


def _blurred(values: Vectors, sigma_px: float) -> Vectors:
    return np.asarray(cv2.GaussianBlur(values, (0, 0), sigma_px), np.float32)


def _mean_square(values: Vectors) -> Vectors:
    return np.asarray(cv2.blur(values * values, (WINDOW_PX, WINDOW_PX)), np.float32)


@dataclass(frozen=True, kw_only=True)
class Ends:
    """The two plates that an instant is made from; one of them may be gone."""

    before: LightPlate | None
    after: LightPlate | None
    share: float

    @property
    def nearer(self) -> LightPlate:
        """The plate that is nearer in time, of those that are there."""
        first, second = (self.before, self.after) if self.share <= 0.5 else (self.after, self.before)
        nearer = first or second
        if nearer is None:
            raise ValueError("an instant needs at least one of its two plates")
        return nearer


def plate_at(ends: Ends, way: Track, *, time_s: float, number: int) -> LightPlate:
    """Return a light's plate at an instant; ``seen`` (row, col) is False where what it showed is not known."""
    own = ends.nearer
    rows, cols = own.shape[:2]
    sides = [_Side.of(ends.before), _Side.of(ends.after)]
    image = np.array(own.image)
    seen = np.empty((rows, cols), np.bool_)
    for top in range(0, rows, BAND_ROWS):
        band = slice(top, min(top + BAND_ROWS, rows))
        _fill(band, image, seen, ends, sides, way)
    return LightPlate(
        light=own.light,
        number=number,
        time_s=time_s,
        picture=packed(made(image), own.saturation),
        seen=seen,
        saturation=own.saturation,
        shown_s=own.flashed_s,
    )


@dataclass(frozen=True, kw_only=True)
class _Side:
    """A plate, of whose picture only those rows are made that move into a band, and what lies well within what was
    seen, by rows, (row, 1), or by pixels."""

    plate: LightPlate
    within: Flags

    @classmethod
    def of(cls, plate: LightPlate | None) -> "_Side | None":
        if plate is None:
            return None
        own = plate.own.astype(np.uint8)
        within = cv2.erode(own, np.ones((5, min(5, own.shape[1])), np.uint8)) > 0
        return cls(plate=plate, within=within)

    def moved(self, x: Vectors, y: Vectors, wanted: Flags) -> tuple[Image, Flags]:
        """Return the plate at places of its own, and where it was seen there; clipped light stays clipped.

        ``wanted`` says which places count; elsewhere anything may stand.
        """
        rows = self.plate.shape[0]
        first, last = (int(np.clip(edge, 0, rows - 1)) for edge in (y[wanted].min(), y[wanted].max()))
        first, last = max(first - MARGIN_ROWS, 0), min(last + 1 + MARGIN_ROWS, rows)
        shown, y_shown = self.plate.picture.rows(range(first, last)), y - np.float32(first)
        image = cv2.remap(shown, x, y_shown, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
        clipped = (_brightest(shown) >= self.plate.saturation).astype(np.uint8)
        if clipped.any():
            wider = cv2.dilate(clipped, np.ones((5, 5), np.uint8))
            touched = cv2.remap(wider, x, y_shown, cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE) > 0
            image[touched] = self.plate.saturation
        known = zip((y, x), self.within.shape, strict=True)
        row, col = (np.clip(np.rint(at).astype(np.intp), 0, most - 1) for at, most in known)
        return np.asarray(image, np.float32), self.within[row, col]


def _brightest(image: Image) -> Image:
    # channel by channel: numpy is slow along a short last axis
    return image if image.ndim == 2 else functools.reduce(np.maximum, np.moveaxis(image, -1, 0))


def _fill(band: slice, image: Image, seen: Flags, ends: Ends, sides: list[_Side | None], way: Track) -> None:
    """Make one band of rows of the plate at an instant."""
    own = ends.nearer
    rows, cols = seen.shape
    small_rows, small_cols = way.source.shape
    x, y = places(band.stop - band.start, cols)
    y += np.float32(band.start)
    scale_x, scale_y = np.float32(cols / small_cols), np.float32(rows / small_rows)
    at = (x + 0.5) / scale_x - np.float32(0.5), (y + 0.5) / scale_y - np.float32(0.5)
    source = cv2.remap(way.source, *at, cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE)
    seen[band] = (source != NOWHERE) & own.pixels_seen[band]
    flowing = (source != AT_REST) & (source != NOWHERE)
    if not flowing.any():
        return
    shares = [1 - np.clip(ends.share, 0, 1), np.clip(ends.share, 0, 1)]
    total = np.zeros_like(image[band])
    weight = np.zeros(source.shape, np.float32)
    clipped = np.zeros(source.shape, np.bool_)
    for side, share, flow, alone in zip(sides, shares, (way.from_before, way.from_after), (BEFORE, AFTER), strict=True):
        wanted = (source == BOTH) | (source == alone)
        if side is None or not wanted.any():
            continue
        go = cv2.remap(flow, *at, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        found, there = side.moved(x - go[..., 0] * scale_x, y - go[..., 1] * scale_y, wanted)
        counts = (np.where(source == BOTH, np.float32(max(share, 1e-6)), (source == alone)) * there).astype(np.float32)
        total += found * (counts if found.ndim == 2 else counts[..., None])
        weight += counts
        clipped |= (counts > 0) & (_brightest(found) >= side.plate.saturation)
    known = flowing & (weight > 0)
    blended = total / np.maximum(weight, 1e-6).reshape(*weight.shape, *[1] * (total.ndim - 2))
    blended[clipped] = own.saturation
    image[band][known] = blended[known]
    seen[band] = np.where(flowing, known, seen[band])
    image[band][~seen[band]] = 0
