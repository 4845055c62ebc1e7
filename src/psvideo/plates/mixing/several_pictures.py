"""Several pictures at once: their sum as one picture, and rows of all of them made in one loop.

What they share, frames in their codes and levels of ambient light, is taken once.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles, Image
from psvideo.model.coded import Coded
from psvideo.plates.ambient.ambient_level import AmbientLevel
from psvideo.plates.mixing.mixing_kernel import mix_pictures
from psvideo.plates.mixing.mixture import Mixture


def combined(pictures: Sequence[Mixture], shares: Sequence[float], *, ceiling: float) -> Mixture:
    """Return the sum of pictures, each times its share; ``ceiling`` where any of them is clipped in a sample that
    counts. A plate that lies in memory is clipped from 1.0 on."""
    parts = _Parts.of(pictures)
    taken = [part.any(axis=0) for part in parts.shares]
    each = np.array(shares)
    return Mixture(
        frames=parts.frames,
        coefficients=np.tensordot(each, parts.shares, 1),
        levels=parts.levels,
        taken=np.tensordot(each, parts.taken * np.array(taken)[:, None], 1),
        ceiling=ceiling,
        clips_from=min(1.0, *(one.clips_from for one in pictures)),
    )


@dataclass(frozen=True, kw_only=True)
class _Parts:
    """What several pictures are made of, each once: their frames and levels, and what every one takes of them,
    ``shares`` (picture, frame, row) and ``taken`` (picture, level, row)."""

    frames: tuple[Coded, ...]
    levels: tuple[AmbientLevel, ...]
    shares: Doubles
    taken: Doubles

    @classmethod
    def of(cls, pictures: Sequence[Mixture]) -> "_Parts":
        frames = {id(frame): frame for one in pictures for frame in one.frames}
        levels = {id(level): level for one in pictures for level in one.levels}
        places = {key: place for parts in (frames, levels) for place, key in enumerate(parts)}
        rows = pictures[0].shape[0]
        shares, taken = (np.zeros((len(pictures), len(parts), rows)) for parts in (frames, levels))
        for number, one in enumerate(pictures):
            for frame, takes in zip(one.frames, one.coefficients, strict=True):
                shares[number, places[id(frame)]] += takes
            for level, takes in zip(one.levels, () if one.taken is None else one.taken, strict=True):
                taken[number, places[id(level)]] += takes
        return cls(frames=tuple(frames.values()), levels=tuple(levels.values()), shares=shares, taken=taken)


class MakeRows(Protocol):
    """Makes rows of several pictures, again and again in one thread: ``rows`` in rising order, into an array (picture,
    row, col[, channel]) that begins with the row ``first``."""

    def __call__(self, rows: NDArray[np.intp], first: int, into: Image) -> None:
        """Make the rows."""


def rows_maker(pictures: Sequence[Mixture]) -> Callable[[], MakeRows]:
    """Return what gives a thread what makes rows of several pictures."""
    alike = {(one.ceiling, one.clips_from, one.shape, one.frames[0].codes.dtype, one.is_made) for one in pictures}
    if len(alike) > 1 or pictures[0].is_made:
        readers = [one.reader() for one in pictures]

        def make_each(rows: NDArray[np.intp], first: int, into: Image) -> None:
            whole = rows[-1] - rows[0] + 1 == len(rows)
            spans = [(rows[0], rows[-1] + 1)] if whole else [(row, row + 1) for row in rows]
            for read, made in zip(readers, into, strict=True):
                for begin, end in spans:
                    read(begin, end, made[begin - first : end - first])

        return lambda: make_each
    parts = _Parts.of(pictures)
    together = replace(pictures[0], frames=parts.frames, coefficients=parts.shares[0], levels=parts.levels, taken=None)
    counts: NDArray[np.bool_] = np.logical_or.reduce(parts.shares != 0)
    bound = replace(together.bound(), counts=counts)
    shares, taken = (np.ascontiguousarray(part, np.float32) for part in (parts.shares, parts.taken))

    def begin() -> MakeRows:
        reading = bound.reading()

        def make(rows: NDArray[np.intp], first: int, into: Image) -> None:
            flat = into.reshape(*into.shape[:2], -1)
            reading.run(mix_pictures, rows, shares, taken, rows, first, flat)

        return make

    return begin
