"""A light's plate at an instant between two of its flashes: both plates moved along the motion, and blended.

What was hidden in one of the plates is taken from the other. Blending by time also carries shading over, which changes
where a surface turns. Where nothing moves, or motion explains nothing better, the nearer plate is taken as it is.
"""

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.compute.threads import over_ranges
from psvideo.model.coded import Image
from psvideo.plates.align.brightness import light_of
from psvideo.plates.align.flow import Codes, Flags, Vectors, comparable, noise_between, places
from psvideo.plates.align.lone_edges import InstantSketch
from psvideo.plates.align.moving import SHADING_PX, Followed, Pair, window_of
from psvideo.plates.align.moving_kernel import AFTER, AT_REST, BEFORE, BOTH, NOWHERE, blend_rows, ways_rows
from psvideo.plates.align.packed import packed
from psvideo.plates.align.unsure import unsure_of
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixture import made

UNLIKE = 10.0
"""Plates whose detail differs by more codes along the motion do not show the same thing."""
ALIKE_PX = 5
EVENLY, BARE = 24.0, 3.0
"""Where they differ by more than the first as a whole, only what is bare does: its detail differs by no more than the
second. It turns, and its shading with it; detail and shading that both change are two things."""
DARK = 0.003
"""Light that is no shadow's edge, as a share of a sketch's white: noise makes as much."""
SHADED = 0.25
"""... nor do those of which one is darker, as a whole, than this share of the other: a shadow passed."""
TURNED = 40.0
"""What turns is shaded in its detail too, which differs by no more codes: both plates show it all the same."""
BLENDED, BLENDED_UNLIKE = np.float32(0.25), np.float32(0.8)
"""Shading turns evenly: by what it differs between two plates, their blend is off so much less than the nearer one
would be; by what their detail differs, by a shadow, or by more than is even, only a little less."""
REST = 3.0
"""What stands still while its shading changes by more codes is blended by time."""
ENOUGH = 4
"""Where so many lights are sure, what others show is left out unless it is sure as well."""
MANY = 4
"""Of so many lights one must be sure, of more half."""
APART_PX = 1.0
"""What moves by so much more or less from plate to plate moves by itself, and may hide other things."""
HALF = np.float32(0.5)
BAND_ROWS = 64
MARGIN_ROWS = 5
"""Rows beside those that places lie in which count too: for cubic interpolation, and around what is clipped."""


@dataclass(frozen=True, kw_only=True)
class Taken:
    """Of one light (row, col): where its plates ``alike`` show the same along the motion, ``source``, what a pixel is
    to be taken from, and where that is ``sure``; by how much it may be off, in units of the plates' light,
    ``unsure``; and what it ``shows`` at the instant."""

    alike: Flags
    sure: Flags
    source: Codes
    unsure: Vectors
    shows: InstantSketch


def taken_of(pair: Pair, motion: Followed) -> Taken:
    """Return what every pixel of a light's plate is taken from, on the velocities' grid."""
    one, other = comparable(pair.before, pair.after)
    spans_s = motion.time_s - pair.before.time_s, pair.after.time_s - motion.time_s
    ways = motion.way(spans_s[0]), motion.way(-spans_s[1])
    before, after = (_along(codes, way) for codes, way in zip((one, other), ways, strict=True))
    apart = np.asarray(cv2.subtract(after, before, dtype=cv2.CV_32F), np.float32)
    wide, narrow = ((window_of(size_px, motion.step),) * 2 for size_px in (SHADING_PX, ALIKE_PX))
    shading = np.asarray(cv2.blur(apart, wide), np.float32)
    unlike = np.asarray(cv2.blur((apart - shading) ** 2, narrow), np.float32)
    alike = unlike < np.where(np.abs(shading) < EVENLY, np.float32(UNLIKE**2), np.float32(BARE**2))
    shaded = _shaded(before, after, wide)
    alike &= ~shaded
    nearer = BEFORE if spans_s[0] <= spans_s[1] else AFTER
    turns = alike | (unlike < np.float32(TURNED**2))
    source = np.where(motion.moves, np.where(turns, BOTH, nearer), AT_REST).astype(np.uint8)
    source[~motion.moves & alike & (np.abs(shading) > REST)] = BOTH
    gone = [_outside(way) for way in ways]
    for hidden, span_s in zip(gone, (spans_s[0], -spans_s[1]), strict=True):
        _add_hidden(hidden, motion, alike, span_s, sum(spans_s))
    source[gone[0] & ~gone[1]] = AFTER
    source[gone[1] & ~gone[0]] = BEFORE
    hidden = gone[0] != gone[1]
    noise = noise_between(pair.before, pair.after)
    unsure = unsure_of(pair, before, after, motion, noise) * ~hidden
    unsure *= np.where(source == BOTH, _off_of_blend(alike, shading, unlike, shaded), 1)
    return Taken(
        alike=alike,
        sure=alike | hidden,
        source=source,
        unsure=unsure,
        shows=InstantSketch(codes=_shown(before, after, source, spans_s), white=pair.before.white, noise=noise),
    )


def _shown(before: Codes, after: Codes, source: Codes, spans_s: tuple[float, float]) -> Codes:
    """Return the sketch of what is taken of two plates, moved to the instant."""
    share = float(np.clip(spans_s[0] / (spans_s[0] + spans_s[1]), 0, 1))
    nearer = before if spans_s[0] <= spans_s[1] else after
    shown = np.where(source == BOTH, cv2.addWeighted(before, 1 - share, after, share, 0), nearer)
    shown = np.where(source == BEFORE, before, shown)
    return np.asarray(np.where(source == AFTER, after, shown), np.uint8)


def _off_of_blend(alike: Flags, shading: Vectors, unlike: Vectors, shaded: Flags) -> Vectors:
    """Return by which share of what two plates differ their blend may be off. ``shading`` is by how much they differ as
    a whole, and ``unlike`` the square of what their detail does."""
    level, unlike = shading * shading, np.maximum(unlike, np.float32(0))  # sums that run along rows round
    squares = (BLENDED**2 * level + BLENDED_UNLIKE**2 * unlike) / np.maximum(level + unlike, np.float32(1e-6))
    share = np.where(shaded | (np.abs(shading) > EVENLY), BLENDED_UNLIKE, np.sqrt(squares))
    return np.asarray(np.where(alike, BLENDED, share), np.float32)


def without_doubtful(shown: Sequence[Taken], motion: Followed, others: int) -> list[Codes]:
    """Return the sources of all lights under which something moves, without what is doubtful where enough is sure.

    Nor is anything known where more than half of many lights show that something moved, and no motion explains it.
    ``others`` is the number of lights under which nothing moves.
    """
    sure = np.sum([one.sure for one in shown], axis=0, dtype=np.int16)
    left_out = sure + others >= ENOUGH
    if len(shown) >= MANY:
        left_out |= ~motion.moves & (sure < min(len(shown) // 2, len(shown) - MANY + 1))
    return [np.where(left_out & ~one.sure, np.uint8(NOWHERE), one.source) for one in shown]


def _shaded(before: Codes, after: Codes, window: tuple[int, int]) -> Flags:
    """Return where one of two plates is in shadow as a whole."""
    one, other = (light_of(cv2.blur(codes, window).astype(np.float32)) for codes in (before, after))
    return np.asarray(np.minimum(one, other) < np.float32(SHADED) * np.maximum(one, other) - np.float32(DARK))


def _along(codes: Codes, way: Vectors) -> Codes:
    x, y = places(*way.shape[1:])
    high, wide = (np.float32(many / few) for many, few in zip(codes.shape, way.shape[1:], strict=True))
    x, y = (x - way[0] + HALF) * wide - HALF, (y - way[1] + HALF) * high - HALF
    return np.asarray(cv2.remap(codes, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE))


def _outside(way: Vectors) -> Flags:
    rows, cols = way.shape[1:]
    x, y = places(rows, cols)
    x, y = x - way[0], y - way[1]
    return np.asarray((x < -0.5) | (x > cols - 0.5) | (y < -0.5) | (y > rows - 0.5))


def _add_hidden(hidden: Flags, motion: Followed, alike: Flags, span_s: float, round_s: float) -> None:
    """Add to ``hidden`` what something else covers in a plate, a time before the instant: what its place there is
    better explained by, which moves otherwise."""
    rows, cols = np.nonzero(~alike)
    own = motion.velocity[:, rows, cols]
    there = _places_from(rows, cols, -np.float32(span_s) * own, hidden.shape)
    others = np.where(motion.moves[rows, cols], motion.velocity[:, there[0], there[1]], motion.nearby[:, rows, cols])
    back = _places_from(*there, np.float32(span_s) * others, hidden.shape)
    again = motion.velocity[:, back[0], back[1]]
    per = round_s * motion.step
    apart_px, missed_px = (np.hypot(*(pair[0] - pair[1])) * per for pair in ((others, own), (again, others)))
    hidden[rows, cols] |= (apart_px > APART_PX) & (missed_px <= APART_PX) & alike[back]


def _places_from(
    rows: NDArray[np.intp], cols: NDArray[np.intp], way: Vectors, shape: tuple[int, ...]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    row, col = np.rint(rows + way[1]).astype(np.intp), np.rint(cols + way[0]).astype(np.intp)
    return np.clip(row, 0, shape[0] - 1), np.clip(col, 0, shape[1] - 1)


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


def plate_at(ends: Ends, source: Codes, motion: Followed, *, number: int, guess: Codes | None = None) -> LightPlate:
    """Return a light's plate at an instant; ``seen`` (row, col) is False where what it showed is not known.

    ``guess`` says what to show where the ``source`` is NOWHERE, for eyes; left out, the plate that is nearer in time.
    """
    own = ends.nearer
    rows, cols = own.shape[:2]
    sides = [_Side.of(ends.before), _Side.of(ends.after)]
    image = np.empty(own.shape, np.float32)
    seen = np.empty((rows, cols), np.bool_)

    def fill(top: int, bottom: int) -> None:
        _fill(slice(top, bottom), image, seen, ends, sides, (source, source if guess is None else guess), motion)

    over_ranges(fill, rows, each=BAND_ROWS)
    return LightPlate(
        light=own.light,
        number=number,
        time_s=motion.time_s,
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
    everywhere: bool

    @classmethod
    def of(cls, plate: LightPlate | None) -> "_Side | None":
        if plate is None:
            return None
        own = plate.own.astype(np.uint8)
        within = cv2.erode(own, np.ones((5, min(5, own.shape[1])), np.uint8)) > 0
        return cls(plate=plate, within=within, everywhere=bool(within.all()))

    def moved(self, x: Vectors, y: Vectors, within: tuple[float, float]) -> tuple[Image, Flags | np.bool_]:
        """Return the plate at places of its own, and where it was seen there; clipped light stays clipped.

        ``within`` are the first and the last row that count; elsewhere anything may stand.
        """
        rows = self.plate.shape[0]
        first, last = (int(np.clip(edge, 0, rows - 1)) for edge in within)
        first, last = max(first - MARGIN_ROWS, 0), min(last + 1 + MARGIN_ROWS, rows)
        shown, y_shown = self.plate.picture.rows(range(first, last)), y - np.float32(first)
        image = cv2.remap(shown, x, y_shown, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
        if shown.max() >= self.plate.saturation:
            clipped = (_brightest(shown) >= self.plate.saturation).astype(np.uint8)
            wider = cv2.dilate(clipped, np.ones((5, 5), np.uint8))
            touched = cv2.remap(wider, x, y_shown, cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE) > 0
            image[touched] = self.plate.saturation
        if self.everywhere:
            return np.asarray(image, np.float32), np.True_
        known = zip((y, x), self.within.shape, strict=True)
        row, col = (np.clip(np.rint(at).astype(np.intp), 0, most - 1) for at, most in known)
        return np.asarray(image, np.float32), self.within[row, col]


def _brightest(image: Image) -> Image:
    # channel by channel: numpy is slow along a short last axis
    return image if image.ndim == 2 else functools.reduce(np.maximum, np.moveaxis(image, -1, 0))


def _fill(
    band: slice,
    image: Image,
    seen: Flags,
    ends: Ends,
    sides: list[_Side | None],
    sources: tuple[Codes, Codes],
    motion: Followed,
) -> None:
    """Make one band of rows of the plate at an instant: of its source, and of a guess where that is nowhere."""
    own = ends.nearer
    shape = band.stop - band.start, seen.shape[1]
    given, taken = np.empty((2, *shape), np.uint8)
    ways = np.empty((2, 2, *shape), np.float32)
    within = np.full((2, 2), len(seen), np.float32)
    spans_s = np.array([0 if side is None else motion.time_s - side.plate.time_s for side in sides], np.float32)
    ways_rows(*sources, motion.velocity, spans_s, band.start, given, taken, ways, within)
    known = given != NOWHERE
    seen[band] = known & own.pixels_seen[band]
    flowing = (taken != AT_REST) & (taken != NOWHERE)
    if not flowing.all():
        image[band] = own.picture.rows(range(band.start, band.stop))
    if not flowing.any():
        return
    cols = np.flatnonzero(flowing.any(axis=0))
    part = slice(int(cols[0]), int(cols[-1]) + 1)
    # elsewhere in the band everything is as it is
    taken, ways, flowing = np.ascontiguousarray(taken[:, part]), np.ascontiguousarray(ways[..., part]), flowing[:, part]
    own_part = np.ascontiguousarray(image[band, part])
    share = float(np.clip(ends.share, 0, 1))
    weights = np.zeros((2, *taken.shape), np.float32)
    moved: list[Image] = []
    for side, counts, way, rows, weight in zip(sides, (1 - share, share), ways, within, weights, strict=True):
        if side is None or rows[0] > rows[1]:
            moved.append(np.zeros_like(own_part))
            continue
        found, there = side.moved(way[0], way[1], (float(rows[0]), float(rows[1])))
        weight[:] = there * np.float32(max(counts, 1e-6))
        moved.append(found)
    full = np.array(
        [*(np.inf if side is None else side.plate.saturation for side in sides), own.saturation], np.float32
    )
    shown = np.where(flowing, own.rows_seen[band, None], seen[band, part])
    one, other, blended = (picture.reshape(*taken.shape, -1) for picture in (*moved, own_part))
    blend_rows(taken, weights, one, other, full, shown, blended)
    image[band, part] = own_part
    seen[band, part] = shown & known[:, part]
