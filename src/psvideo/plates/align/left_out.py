"""Whether a normal is better without the lights of which nothing is sure.

Few lights that lie close together turn what is a little unsure of each into many degrees: then all of them, as they
are, are nearer to the truth than those few. So they are where few seem sure by chance, as folds go by: other ones in
every pixel, whose normals belong to no surface.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Flags, Floats
from psvideo.plates.align.as_they_are import MATTE
from psvideo.plates.align.as_they_are_kernel import FLAT
from psvideo.plates.align.doubt.lone_edges import InstantSketch
from psvideo.plates.align.plate_lamps import Lamps
from psvideo.plates.align.velocity.brightness import light_of

LEAST_SHARE = 1e-3
NO_NORMAL = np.float32(2e4)
"""How much errors move a normal where lights lie in a plane."""
AROUND_PX, UNEVEN = 9, np.float32(0.05)
"""Normals of few lights may vary over the first as those of all do, and by the second beyond that, in radians: noise
makes more of it under few."""
AT_ONCE = 1 << 14


@dataclass(frozen=True, kw_only=True)
class AtInstant:
    """What a light ``shows`` at an instant, by how much that may be off in units of its light, ``unsure`` (row, col),
    and how far away its nearer plate is in time, as a ``share`` of what lies between its two."""

    shows: InstantSketch
    unsure: Floats
    share: float

    def squares(self, rows: NDArray[np.intp], cols: NDArray[np.intp], used: Flags) -> Floats:
        """Return the squares of its errors at some pixels. What is unsure of a plate is the share of what changed; of
        what changed at once, as an edge passed, all is wrong in that share of cases. Surfaces are not quite matte."""
        square = np.square(self.unsure[rows, cols])
        at_once = np.where(used, square, square / np.float32(max(self.share, LEAST_SHARE)))
        return np.asarray(at_once + np.square(np.float32(MATTE) * self.light(rows, cols)), np.float32)

    def light(self, rows: NDArray[np.intp], cols: NDArray[np.intp]) -> Floats:
        """Return what it shows at some pixels, as light."""
        return np.float32(self.shows.white) * light_of(self.shows.codes[rows, cols].astype(np.float32))


def better_without(lamps: Lamps, lights: Sequence[AtInstant], used: Flags) -> Flags:
    """Return where a normal of the lights that are ``used`` (light, row, col) is expected to be less off than one of
    all of them, (row, col); ``lights`` come in the order of the lamps. Nowhere where all are used."""
    better = np.zeros(used.shape[1:], np.bool_)
    rows, cols = np.nonzero(~used.all(axis=0))
    if not len(rows):
        return better
    some = used[:, rows, cols]
    evening = lamps.evenings(better.shape)
    evening = evening[:, np.minimum(rows, evening.shape[1] - 1), np.minimum(cols, evening.shape[2] - 1)]
    squares = np.stack([light.squares(rows, cols, own) for light, own in zip(lights, some, strict=True)])
    squares *= np.square(evening)
    _, firsts, which = np.unique(np.packbits(some, axis=0), axis=1, return_index=True, return_inverse=True)
    sets, every = some[:, firsts], np.ones((len(used), 1), np.bool_)
    few_pulls, pulls = _pulls(lamps, sets), _pulls(lamps, every)
    few = (_spread(few_pulls)[:, which.ravel()] * squares).sum(axis=0)
    better[rows, cols] = few < (_spread(pulls) * squares).sum(axis=0)
    shown = np.stack([light.light(rows, cols) for light in lights]) * evening
    uneven = []
    for each, of_set in ((few_pulls, which.ravel()), (pulls, np.zeros_like(rows))):
        normals = np.zeros((*better.shape, 3), np.float32)
        normals[rows, cols] = _normals(each, of_set, shown)
        uneven.append(_uneven(normals))
    return better & (uneven[0] < uneven[1] + UNEVEN**2)


def _pulls(lamps: Lamps, sets: Flags) -> Floats:
    """Return by how much each light moves the normal, times its albedo, of a set of lights, (set, 3, light); ``sets``
    is (light, set). A normal of lights in a plane is moved by more than any angle."""
    squares = np.einsum("ls,li,lj->sij", sets, lamps.matrix, lamps.matrix)
    flat = np.linalg.det(squares) <= FLAT * (np.trace(squares, axis1=1, axis2=2) / 3) ** 3
    squares[flat] = np.eye(3)
    pulls = np.linalg.inv(squares) @ lamps.matrix.T * sets.T[:, None]
    return np.asarray(np.where(flat[:, None, None], NO_NORMAL, pulls), np.float32)


def _spread(pulls: Floats) -> Floats:
    """Return by how much the square of each light's error counts in that of a normal of a set, (light, set)."""
    return np.asarray(np.square(pulls).sum(axis=1).T, np.float32)


def _normals(pulls: Floats, which: NDArray[np.intp], light: Floats) -> Floats:
    """Return the unit normals (pixel, 3) that sets of lights make of ``light`` (light, pixel), ``which`` in each."""
    normals = np.empty((len(which), 3), np.float32)
    for first in range(0, len(which), AT_ONCE):
        some = slice(first, first + AT_ONCE)
        normals[some] = np.einsum("pil,lp->pi", pulls[which[some]], light[:, some])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.asarray(normals / np.maximum(lengths, np.float32(1e-6)), np.float32)


def _uneven(normals: Floats) -> Floats:
    """Return the variance of unit normals (row, col, 3) around each, (row, col), in square radians; where there is
    none they are 0 and do not count."""
    window = (AROUND_PX, AROUND_PX)
    there = np.asarray(normals.any(axis=-1), np.float32)
    share = cv2.blur(there, window)
    mean = cv2.blur(normals, window) / np.maximum(share, np.float32(1e-6))[..., None]
    return np.asarray(np.maximum(1 - np.square(mean).sum(axis=-1), 0), np.float32)
