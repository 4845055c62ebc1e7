"""A picture as a recipe bound to what it is made of: made where and as far as somebody wants it, and held by nobody.

    picture[row] = sum_n coefficients[n, row] * frames[n][row]  -  sum_m taken[m, row] * levels[m][row]

Frames stay in the codes in which they were read, which several pictures share: a picture that is not made costs nothing
beside them. Levels are what is known of the ambient light.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.threads import over_ranges
from psvideo.model.arrays import Doubles, Image
from psvideo.model.coded import IDENTITY, Coded
from psvideo.model.rows.clipping import SATURATED
from psvideo.plates.ambient.ambient_level import AmbientLevel
from psvideo.plates.mixing.mixing_kernel import COUNTS, mix_rows
from psvideo.plates.mixing.mixture_arrays import MixtureArrays
from psvideo.plates.mixing.ready_mixture import ReadyMixture
from psvideo.plates.mixing.thinning_kernel import mix_halved, mix_thinned

BAND_SAMPLES = 1 << 20
"""Samples of one band of rows, which a thread makes at a time."""
THINNED_SAMPLES = 1 << 24
"""The same where few of the rows are made: frames that stay in their files are read so far at a time."""


class Reader(Protocol):
    """Makes rows of a picture, from the first up to the last; see ``Mixture.reader``."""

    def __call__(self, first: int, last: int, into: Image | None = None) -> Image:
        """Return the rows."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Mixture:
    """A picture, (row, col) or (row, col, channel), in linear light.

    frames: pictures in codes, all of one shape and type. coefficients: (frame, row). levels: ambient light of the
    same shape; taken: (level, row). A sample becomes ``ceiling`` where any that counts was
    ``clips_from`` or more. Rows without coefficients are 0.
    """

    frames: tuple[Coded, ...]
    coefficients: Doubles
    levels: tuple[AmbientLevel, ...] = ()
    taken: Doubles | None = None
    ceiling: float = 1.0
    clips_from: float = SATURATED

    @property
    def shape(self) -> tuple[int, ...]:
        """The picture's shape."""
        return self.frames[0].shape

    @property
    def is_made(self) -> bool:
        """Whether the picture lies in memory as it is."""
        first = self.frames[0]
        plain = not self.levels and len(self.frames) == 1 and first.tone is IDENTITY and first.codes.dtype == np.float32
        return plain and bool((self.coefficients == 1).all()) and self.clips_from == np.inf

    def image(self) -> Image:
        """Return the picture."""
        if self.is_made:
            return np.asarray(self.frames[0].codes, np.float32)
        image = np.empty(self.shape, np.float32)
        self._into(image, range(self.shape[0]))
        return image

    def reader(self) -> Reader:
        """Return what makes rows of the picture in the thread that calls it: from the first up to the last, into an
        array, if one is given, else into a new one."""
        if self.is_made:
            return _copying(self.image())
        bound = self.bound()

        def read(first: int, last: int, into: Image | None = None) -> Image:
            band = np.empty((last - first, *self.shape[1:]), np.float32) if into is None else into
            bound.run(mix_rows, range(first, last), np.arange(first, last), band.reshape(last - first, -1))
            return band

        return read

    def rows(self, rows: range | NDArray[np.intp]) -> Image:
        """Return some rows of the picture, shape (row, col[, channel])."""
        if self.is_made:
            return np.asarray(self.image()[np.array(rows, np.intp)])
        image = np.empty((len(rows), *self.shape[1:]), np.float32)
        self._into(image, rows)
        return image

    def thinned(self, stride: int) -> Image:
        """Return every nth row and column of the picture; of each row one channel lies after the other."""
        if self.is_made:
            return self.image()[::stride, ::stride]
        channels = int(np.prod(self.shape[2:]))
        image = self._some(range(0, self.shape[0], stride), (0, channels), stride * channels)
        rows, cols = (-(-size // stride) for size in self.shape[:2])
        return np.moveaxis(image.reshape(rows, *self.shape[2:], cols), -1, 1)

    def channel(self, number: int, rows: range) -> Image:
        """Return one channel of the top row and of others at even distances, shape (row, col)."""
        if self.is_made or len(self.shape) == 2:
            some = self.rows(rows)
            return np.ascontiguousarray(some if some.ndim == 2 else some[..., number])
        return self._some(rows, (number, number + 1), self.shape[2])

    def _some(self, rows: range, channels: tuple[int, int], stride: int) -> Image:
        """Return of rows, the first of which is the top one, every nth sample of some channels, (row, sample)."""
        bound = self.bound()
        count = -(-bound.mix.samples // stride) * (channels[1] - channels[0])
        image = np.empty((len(rows), count), np.float32)
        each = max(THINNED_SAMPLES // bound.mix.samples // rows.step, 1)
        for first in range(0, len(rows), each):
            last = min(first + each, len(rows))
            bound.run(mix_thinned, rows[first:last], first, last, rows.step, channels, stride, image)
        return image

    def halved(self) -> Image:
        """Return the picture's mean over two by two pixels and over channels, shape (row // 2, col // 2)."""
        rows, cols = self.shape[0] // 2, self.shape[1] // 2
        grey = np.empty((rows, cols), np.float32)
        bound = self.bound()
        channels = 1 if len(self.shape) == 2 else self.shape[2]

        def band(first: int, last: int) -> None:
            bound.run(mix_halved, range(2 * first, 2 * last), first, last, channels, grey)

        _in_bands(band, rows, 2 * bound.mix.samples)
        return grey

    def without(self, levels: tuple[AmbientLevel, ...], taken: Doubles) -> "Mixture":
        """Return the picture with levels taken off, each row with its own share; ``taken`` is (level, row)."""
        return replace(self, levels=(*self.levels, *levels), taken=_joined(self.taken, taken))

    def within(self, rows: NDArray[np.bool_]) -> "Mixture":
        """Return the picture with 0 in all but some rows."""
        return self if rows.all() else replace(self, coefficients=self.coefficients * rows)

    def clipped(self) -> NDArray[np.bool_]:
        """Return where any sample that counts was clipped, of the picture's shape."""
        clipped = np.zeros(self.shape, np.bool_)
        counts_from = COUNTS * np.abs(self.coefficients).max(axis=0)  # (row,)
        for frame, share in zip(self.frames, self.coefficients, strict=True):
            counts = np.abs(share) > counts_from
            clipped[counts] |= frame.light()[counts] >= np.float32(self.clips_from)
        return clipped

    def bound(self) -> "ReadyMixture":
        """Return what a compiled loop needs."""
        tables = {id(frame.tone.table): frame.tone.table for frame in self.frames if frame.tone.table.size}
        if len(tables) > 1 or (tables and any(not frame.tone.table.size for frame in self.frames)):
            return replace(self, frames=tuple(Coded(codes=frame.light()) for frame in self.frames)).bound()
        return self._ready

    @cached_property
    def _ready(self) -> "ReadyMixture":
        """Frames as they are, made ready once: a plate is looked at five times."""
        frames = self.frames
        first = frames[0]
        taken = np.zeros((0, self.shape[0])) if self.taken is None else self.taken
        lies = [frame.codes for frame in frames if isinstance(frame.codes, np.ndarray)]
        mix = MixtureArrays(
            frames=np.array([codes.ctypes.data for codes in lies], np.intp),
            like=np.empty(0, first.codes.dtype),
            samples=int(np.prod(self.shape[1:])),
            coefficients=np.ascontiguousarray(self.coefficients, np.float32),
            table=first.tone.table,
            halves=all(frame.tone.halves for frame in frames),
            zero=_patterns([frame.tone.zero for frame in frames]),
            gain=_patterns([frame.tone.gain for frame in frames]),
            most=np.float32(min(frame.tone.most for frame in frames)),
            levels=np.array([level.codes.ctypes.data for level in self.levels], np.intp),
            least=_rows_of([level.least for level in self.levels], self.shape[0]),
            step=_rows_of([level.step for level in self.levels], self.shape[0]),
            narrow=np.array([level.narrow.ctypes.data for level in self.levels], np.intp),
            taken=np.ascontiguousarray(taken, np.float32),
            ceiling=np.float32(self.ceiling),
            clips_from=np.float32(self.clips_from),
        )
        return ReadyMixture(mix=mix, frames=frames, levels=self.levels, counts=self.coefficients != 0)

    def _into(self, image: Image, rows: range | NDArray[np.intp]) -> None:
        if not len(rows):
            return
        bound, places = self.bound(), np.array(rows, np.intp)
        flat = image.reshape(len(rows), -1)

        def band(first: int, last: int) -> None:
            some = places[first:last]
            bound.run(mix_rows, np.sort(some), some, flat[first:last])

        _in_bands(band, len(rows), bound.mix.samples)


def _copying(image: Image) -> Reader:
    def read(first: int, last: int, into: Image | None = None) -> Image:
        if into is None:
            return image[first:last]
        into[:] = image[first:last]
        return into

    return read


def mixture_of(image: Image) -> Mixture:
    """Return a picture that lies in memory already."""
    coded = Coded(codes=np.ascontiguousarray(image, np.float32))
    return Mixture(frames=(coded,), coefficients=np.ones((1, len(image))), clips_from=np.inf)


def shown_level(level: AmbientLevel) -> Mixture:
    """Return ambient light as a picture."""
    return Mixture(frames=(level.coded,), coefficients=np.ones((1, len(level.codes))), clips_from=np.inf)


def _patterns(planes: Sequence[Doubles]) -> Image:
    """Return patterns that repeat, each (row, col), as (frame, row, col), so large that all of them repeat in it."""
    if len({plane.shape for plane in planes}) == 1:
        return np.asarray(np.stack(planes), np.float32)
    high, wide = (math.lcm(*(plane.shape[axis] for plane in planes)) for axis in range(2))
    whole = [np.tile(plane, (high // plane.shape[0], wide // plane.shape[1])) for plane in planes]
    return np.asarray(np.stack(whole), np.float32)


def _rows_of(levels: Sequence[Image], rows: int) -> Image:
    return np.stack(levels) if levels else np.zeros((0, rows), np.float32)


def _joined(before: Doubles | None, more: Doubles) -> Doubles:
    return more if before is None else np.concatenate([before, more])


def _in_bands(run: Callable[[int, int], None], rows: int, samples: int) -> None:
    over_ranges(run, rows, each=max(BAND_SAMPLES // samples, 1))
