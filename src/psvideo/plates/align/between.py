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

from psvideo.compute.eight_lanes import EIGHT
from psvideo.compute.threads import over_ranges
from psvideo.model.arrays import Codes8, Flags, Floats, Image
from psvideo.model.channels import brightest_channel
from psvideo.plates.align.blend_kernel import ROOM, blend_rows
from psvideo.plates.align.packed import BAND_ROWS, Packing, PutBy
from psvideo.plates.align.side_kernel import BESIDE, CLIPPED, SideArrays
from psvideo.plates.align.velocity.followed import Followed
from psvideo.plates.align.velocity.moving_kernel import AT_REST
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import Reader

HALF = np.float32(0.5)
MARGIN_ROWS = 5
"""Rows beside those that places lie in which count too: for cubic interpolation, and around what is clipped."""
BESIDE_CLIPPED = 5
"""Cubic interpolation mixes samples of a square this wide: clipped ones are kept out of it."""


@dataclass(frozen=True, kw_only=True)
class Ends:
    """The two plates that an instant is made from; one of them may be gone. ``shifts`` is how far to the right and down
    the whole picture is in either, as a share of its width and its height: the camera shook."""

    before: LightPlate | None
    after: LightPlate | None
    share: float
    shifts: tuple[tuple[float, float], tuple[float, float]] = ((0.0, 0.0), (0.0, 0.0))

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
    source: Codes8,
    motion: Followed,
    *,
    number: int,
    guess: Codes8 | None = None,
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
        None if plate is None else _Side.of(plate, motion, max(counts, 1e-6), shift)
        for plate, counts, shift in zip((ends.before, ends.after), (1 - share, share), ends.shifts, strict=True)
    ]
    packing, seen = Packing.of(own.shape), np.empty((rows, cols), np.bool_)
    sources, columns = (source, source if guess is None else guess), columns_in(cols, source.shape[1])

    def fill(top: int, bottom: int) -> None:
        packing.put(top, _filled(range(top, bottom), seen, own, sides, sources, *columns))

    over_ranges(fill, rows, each=BAND_ROWS)
    return LightPlate(
        light=own.light,
        number=number,
        time_s=motion.time_s,
        picture=packing.picture(own.saturation, put_by),
        seen=seen,
        saturation=own.saturation,
        brightest_share=own.brightest_share,
        shown_s=own.flashed_s,
        sideways=own.sideways,
    )


@dataclass(frozen=True, kw_only=True)
class _Side:
    """A plate, of whose picture only those rows are made that move into a band; the mean ``velocity`` from it to the
    instant, or back; what it counts where both plates are taken, and what lies well within what was seen, by rows,
    (row, 1) or (1, col), or by pixels; (1, 1) where that is everywhere. The whole picture is ``right`` and ``down`` of
    where it is to be, in pixels."""

    plate: LightPlate
    read: Reader
    span_s: float
    velocity: Floats
    counts: np.float32
    within: Flags
    right: float
    down: float

    @classmethod
    def of(cls, plate: LightPlate, motion: Followed, counts: float, shift: tuple[float, float]) -> "_Side":
        own = plate.own.astype(np.uint8)
        within = cv2.erode(own, np.ones((5, min(5, own.shape[1])), np.uint8)).reshape(own.shape) > 0
        span_s = motion.time_s - plate.time_s
        return cls(
            plate=plate,
            read=plate.picture.reader(),
            span_s=span_s,
            velocity=motion.mean_velocity(span_s),
            counts=np.float32(counts),
            within=np.ones((1, 1), np.bool_) if within.all() else within,
            right=shift[0] * plate.shape[1],
            down=shift[1] * plate.shape[0],
        )

    def around(self, band: range) -> "_Rows":
        """Return the plate's rows of a band, and those that move into it."""
        rows, high = self.plate.shape[0], self.plate.shape[0] / self.velocity.shape[1]
        some = self.velocity[1, max(int(band.start / high) - 1, 0) : int(band.stop / high) + 2]
        ways = self.span_s * high * np.array([some.min(), some.max(), 0], np.float64) - self.down
        first = max(math.floor(band.start - ways.max()) - MARGIN_ROWS, 0)
        last = min(math.ceil(band.stop - ways.min()) + MARGIN_ROWS, rows)
        first, last = min(first, band.start), max(last, band.stop)
        return _Rows(side=self, first=first, light=self.read(first, last))


@dataclass(frozen=True, kw_only=True)
class _Rows:
    """Some rows of a side's plate, from the first on."""

    side: _Side
    first: int
    light: Image

    def of(self, band: range) -> Image:
        return self.light[band.start - self.first : band.stop - self.first]

    def arrays(self, total: np.float32) -> SideArrays:
        """Return what a compiled loop takes of them, where both plates together count ``total``."""
        side, full = self.side, np.float32(self.side.plate.saturation)
        span_s, share = np.float32(side.span_s), side.counts / total
        beside = np.float32(side.right), np.float32(side.down)
        return SideArrays(_flat(self.light), self.first, self._marks(), side.within, span_s, share, full, *beside)

    def _marks(self) -> Codes8:
        """Return what is clipped and what lies beside that, (row, col), or one 0 where nothing is."""
        light, full = self.light, self.side.plate.saturation
        if light.max() < full:
            return np.zeros((1, 1), np.uint8)
        clipped = (brightest_channel(light) >= full).astype(np.uint8)
        wider = cv2.dilate(clipped, np.ones((BESIDE_CLIPPED, BESIDE_CLIPPED), np.uint8))
        return np.where(clipped, np.uint8(CLIPPED), np.uint8(BESIDE) * wider)


def _filled(
    band: range,
    seen: Flags,
    own: LightPlate,
    sides: Sequence[_Side | None],
    sources: tuple[Codes8, Codes8],
    columns: NDArray[np.uintp],
    shares: Floats,
) -> Image:
    """Make one band of rows of the plate at an instant: of its source, and of a guess where that is nowhere."""
    some, part = slice(band.start, band.stop), _part(sources, band, own.shape)
    seen[some] = own.pixels_seen[some]
    if not part:
        return own.picture.rows(band)
    rows = [None if side is None else side.around(band) for side in sides]
    known = [side.velocity for side in sides if side is not None]
    stays = next(one for one in rows if one is not None and one.side.plate is own).of(band)
    image = np.empty(stays.shape, np.float32)
    for beside in (slice(0, part.start), slice(part.stop, None)):
        image[:, beside] = stays[:, beside]
    total = np.float32(sum(side.counts for side in sides if side is not None))
    before, after = [_absent(image) if one is None else one.arrays(total) for one in rows]
    room = np.zeros((ROOM, max(own.shape[1], 3 * EIGHT)), np.float32)
    blend_rows(
        sources[0], sources[1], known[0], known[-1], (own.shape[0], own.shape[1]), band.start, part.start, part.stop,
        columns, shares, room, before, after, np.float32(own.saturation), np.ascontiguousarray(own.rows_seen[some]),
        _flat(stays), _flat(image), seen[some],
    )  # fmt: skip
    return image


def _absent(image: Image) -> SideArrays:
    """Return the arrays of a plate that is gone: nothing of it was seen."""
    light = np.zeros((1, 1, _channels(image)), np.float32)
    nothing, none = np.zeros((1, 1), np.uint8), np.float32(0)
    return SideArrays(light, 0, nothing, nothing > 0, none, none, np.float32(np.inf))


def columns_in(cols: int, coarse: int) -> tuple[NDArray[np.uintp], Floats]:
    """Return for every column of a picture the coarse ones before it and in which it lies, (2, col), and how far it
    lies beyond the middle of the former."""
    place = (np.arange(cols, dtype=np.float32) + HALF) * np.float32(coarse / cols)
    at = np.clip(place - HALF, 0, coarse - 1)
    before = np.floor(at)
    return np.stack([before, np.minimum(place, coarse - 1)]).astype(np.uintp), at - before


def _channels(image: Image) -> int:
    channels = 1 if image.ndim == 2 else image.shape[2]
    if channels not in (1, 3):
        raise ValueError(f"plates have one channel or three, and not {channels}")
    return channels


def _flat(image: Image) -> Image:
    """Return a picture with an axis of channels."""
    return image.reshape(*image.shape[:2], _channels(image))


def _part(sources: tuple[Codes8, Codes8], band: range, shape: tuple[int, ...]) -> range:
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
