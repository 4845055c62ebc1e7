"""A light's plate at an instant between two of its flashes: both plates moved along the motion, and blended.

What was hidden in one of the plates is taken from the other. Blending by time also carries shading over, which changes
where a surface turns. Where nothing moves, or motion explains nothing better, the nearer plate is taken as it is.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.compute.threads import over_ranges
from psvideo.model.channels import brightest_channel
from psvideo.model.coded import Image
from psvideo.plates.align.packed import PutBy, packed
from psvideo.plates.align.velocity.flow import Codes, Flags, Vectors
from psvideo.plates.align.velocity.followed import Followed
from psvideo.plates.align.velocity.moving_kernel import AT_REST, NOWHERE, blend_rows, ways_rows
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import Reader, made

HALF = np.float32(0.5)
BAND_ROWS = 64
MARGIN_ROWS = 5
"""Rows beside those that places lie in which count too: for cubic interpolation, and around what is clipped."""
BESIDE_CLIPPED, OVERSHOOT, JUST_BELOW = 5, 1.45, 1 - 1e-4
"""Cubic interpolation mixes samples of a square this wide; its result may reach this many times the brightest of them
(the sum of its positive weights). Clipped samples are kept out of it, and its result is kept below the level that
counts as clipped, also after rounding to 16 bits."""


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


def plate_at(
    ends: Ends,
    source: Codes,
    motion: Followed,
    *,
    number: int,
    guess: Codes | None = None,
    put_by: PutBy | None = None,
) -> LightPlate:
    """Return a light's plate at an instant; ``seen`` (row, col) is False where what it showed is not known.

    ``guess`` says what to show where the ``source`` is NOWHERE, for eyes; left out, the plate that is nearer in time.
    ``put_by`` takes its codes.
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
        picture=packed(made(image), own.saturation, put_by),
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
            clipped = (brightest_channel(light) >= full).astype(np.uint8)
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
