"""Whether a normal is better without the lights of which nothing is sure.

Few lights that lie close together turn what is a little unsure of each into many degrees: then all of them, as they
are, are nearer to the truth than those few.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Flags, Floats
from psvideo.plates.align.as_they_are import MATTE, Lamps
from psvideo.plates.align.as_they_are_kernel import FLAT
from psvideo.plates.align.doubt.lone_edges import InstantSketch
from psvideo.plates.align.velocity.brightness import light_of

LEAST_SHARE = 1e-3
NO_NORMAL = np.float32(1e9)
"""How much errors count where lights lie in a plane."""


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
        light = np.float32(self.shows.white) * light_of(self.shows.codes[rows, cols].astype(np.float32))
        at_once = np.where(used, square, square / np.float32(max(self.share, LEAST_SHARE)))
        return np.asarray(at_once + np.square(np.float32(MATTE) * light), np.float32)


def better_without(lamps: Lamps, lights: Sequence[AtInstant], used: Flags) -> Flags:
    """Return where a normal of the lights that are ``used`` (light, row, col) is expected to be less off than one of
    all of them, (row, col); ``lights`` come in the order of the lamps. Nowhere where all are used."""
    better = np.zeros(used.shape[1:], np.bool_)
    rows, cols = np.nonzero(~used.all(axis=0))
    if not len(rows):
        return better
    some = used[:, rows, cols]
    squares = np.stack([light.squares(rows, cols, own) for light, own in zip(lights, some, strict=True)])
    _, firsts, which = np.unique(np.packbits(some, axis=0), axis=1, return_index=True, return_inverse=True)
    few = (_spread(lamps, some[:, firsts])[:, which.ravel()] * squares).sum(axis=0)
    every = (_spread(lamps, np.ones((len(used), 1), np.bool_)) * squares).sum(axis=0)
    better[rows, cols] = few < every
    return better


def _spread(lamps: Lamps, sets: Flags) -> Floats:
    """Return by how much the square of each light's error counts in that of a normal of a set of lights; both are
    (light, set)."""
    squares = np.einsum("ls,li,lj->sij", sets, lamps.matrix, lamps.matrix)
    flat = np.linalg.det(squares) <= FLAT * (np.trace(squares, axis1=1, axis2=2) / 3) ** 3
    squares[flat] = np.eye(3)
    pulls = np.linalg.inv(squares) @ lamps.matrix.T
    spread = np.square(pulls).sum(axis=1).T * sets
    return np.asarray(np.where(flat, NO_NORMAL, spread), np.float32)
