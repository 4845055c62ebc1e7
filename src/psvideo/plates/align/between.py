"""A light's plate at an instant between two of its flashes: both plates moved along the motion, and blended.

What was hidden in one of the plates is taken from the other. Blending by time also carries shading over, which changes
where a surface turns. Where nothing moves, or motion explains nothing better, the nearer plate is taken as it is.
"""

import functools
import math
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
from psvideo.plates.mixture import Reader, made

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
BESIDE_CLIPPED, OVERSHOOT, JUST_BELOW = 5, 1.45, 1 - 1e-4
"""Cubic interpolation mixes samples of so wide a square, and makes up to so many times the brightest of them (the sum
of its positive weights): those that clip are kept out of it, and it stays below what clips, rounding to 16 bits too."""


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
    share = float(np.clip(ends.share, 0, 1))
    sides = [
        None if plate is None else _Side.of(plate, motion, max(counts, 1e-6))
        for plate, counts in ((ends.before, 1 - share), (ends.after, share))
    ]
    image = np.empty(own.shape, np.float32)
    seen = np.empty((rows, cols), np.bool_)

    def fill(top: int, bottom: int) -> None:
        _fill(range(top, bottom), image, seen, own, sides, (source, source if guess is None else guess), motion)

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
    """A plate, of whose picture only those rows are made that move into a band, what it counts where both plates are
    taken, and what lies well within what was seen, by rows, (row, 1), or by pixels; None where that is everywhere."""

    plate: LightPlate
    read: Reader
    span_s: float
    weight: np.float32
    within: Flags | None

    @classmethod
    def of(cls, plate: LightPlate, motion: Followed, weight: float) -> "_Side":
        own = plate.own.astype(np.uint8)
        within = cv2.erode(own, np.ones((5, min(5, own.shape[1])), np.uint8)).reshape(own.shape) > 0
        return cls(
            plate=plate,
            read=plate.picture.reader(),
            span_s=motion.time_s - plate.time_s,
            weight=np.float32(weight),
            within=None if within.all() else within,
        )

    def around(self, band: range, velocity: Vectors) -> "_Rows":
        """Return the plate's rows of a band, and those that move into it."""
        rows, high = self.plate.shape[0], self.plate.shape[0] / velocity.shape[1]
        some = velocity[1, max(int(band.start / high) - 1, 0) : int(band.stop / high) + 2]
        ways = self.span_s * high * np.array([some.min(), some.max(), 0], np.float64)
        first = max(math.floor(band.start - ways.max()) - MARGIN_ROWS, 0)
        last = min(math.ceil(band.stop - ways.min()) + MARGIN_ROWS, rows)
        first, last = min(first, band.start), max(last, band.stop)
        return _Rows(side=self, first=first, light=self.read(first, last))

    def weights(self, x: Vectors, y: Vectors) -> Vectors:
        """Return what the plate counts at places of its own, or, (1, 1), at all: 0 where it was not seen."""
        if self.within is None:
            return np.full((1, 1), self.weight)
        row, col = _nearest((y, x), self.within.shape)
        return self.within[row, col] * self.weight


@dataclass(frozen=True, kw_only=True)
class _Rows:
    """Some rows of a side's plate, from the first on."""

    side: _Side
    first: int
    light: Image

    def of(self, band: range) -> Image:
        return self.light[band.start - self.first : band.stop - self.first]

    def moved(self, x: Vectors, y: Vectors) -> Image:
        """Return the plate at places of its own. What clips is what does at the nearest sample: beside clipped ones
        that is taken as it is, for it cannot be told how bright they are, and what is between is not clipped for it."""
        light, full, y_shown = self.light, self.side.plate.saturation, y - np.float32(self.first)
        image = np.asarray(cv2.remap(light, x, y_shown, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE), np.float32)
        brightest = light.max()
        if brightest > full / OVERSHOOT:
            np.minimum(image, np.float32(full * JUST_BELOW), out=image)
        if brightest >= full:
            clipped = (_brightest(light) >= full).astype(np.uint8)
            wider = cv2.dilate(clipped, np.ones((BESIDE_CLIPPED, BESIDE_CLIPPED), np.uint8))
            row, col = _nearest((y_shown, x), clipped.shape)
            beside = wider[row, col] > 0
            row, col = row[beside], col[beside]
            samples = light[row, col]
            samples[clipped[row, col] > 0] = full
            image[beside] = samples
        return image


def _nearest(places: tuple[Vectors, Vectors], shape: tuple[int, ...]) -> list[NDArray[np.intp]]:
    """Return the row and the column of the nearest pixel within a picture."""
    each = zip(places, shape, strict=True)
    return [np.clip(np.rint(at).astype(np.intp), 0, most - 1) for at, most in each]


def _brightest(image: Image) -> Image:
    # channel by channel: numpy is slow along a short last axis
    return image if image.ndim == 2 else functools.reduce(np.maximum, np.moveaxis(image, -1, 0))


def _fill(
    band: range,
    image: Image,
    seen: Flags,
    own: LightPlate,
    sides: Sequence[_Side | None],
    sources: tuple[Codes, Codes],
    motion: Followed,
) -> None:
    """Make one band of rows of the plate at an instant: of its source, and of a guess where that is nowhere."""
    some, part = slice(band.start, band.stop), _part(sources, band, image.shape)
    seen[some] = own.pixels_seen[some]
    if not part:
        image[some] = own.picture.rows(band)
        return
    size = len(band), len(part)
    given, taken = np.empty((2, *size), np.uint8)
    ways = np.empty((2, 2, *size), np.float32)
    spans_s = np.array([0 if side is None else side.span_s for side in sides], np.float32)
    ways_rows(*sources, motion.velocity, spans_s, image.shape[:2], band.start, part.start, given, taken, ways)
    moved = [np.zeros((*size, *image.shape[2:]), np.float32)] * len(sides)
    weights = [np.zeros((1, 1), np.float32)] * len(sides)
    for number, (side, way) in enumerate(zip(sides, ways, strict=True)):
        if side is not None:
            rows = side.around(band, motion.velocity)
            if side.plate is own:
                image[some] = rows.of(band)
            moved[number], weights[number] = rows.moved(*way), side.weights(*way)
    flowing = (taken != AT_REST) & (taken != NOWHERE)
    known = seen[some, part.start : part.stop]
    known[:] = np.where(flowing, own.rows_seen[some, None], known) & (given != NOWHERE)
    full = [*(np.inf if side is None else side.plate.saturation for side in sides), own.saturation]
    one, other, blended = (picture.reshape(*picture.shape[:2], -1) for picture in (*moved, image[some]))
    blend_rows(
        taken, np.array(np.broadcast_arrays(*weights)), one, other, np.array(full, np.float32),
        np.ascontiguousarray(own.rows_seen[some]), part.start, blended, seen[some],
    )  # fmt: skip


def _part(sources: tuple[Codes, Codes], band: range, shape: tuple[int, ...]) -> range:
    """Return the columns of a band between which anything is not as the nearer plate has it."""
    small_rows, small_cols = sources[0].shape
    high = shape[0] / small_rows
    near = slice(max(int(band.start / high) - 1, 0), int(band.stop / high) + 2)
    changed = [np.any(source[near] != AT_REST, axis=0) for source in sources]
    cols = np.flatnonzero(changed[0] | changed[1])
    if not len(cols):
        return range(0)
    wide = shape[1] / small_cols
    return range(max(int(cols[0] * wide) - 1, 0), min(math.ceil((cols[-1] + 1) * wide) + 1, shape[1]))
