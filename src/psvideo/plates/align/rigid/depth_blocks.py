"""The depth of a body's points on blocks: by how much each departs from what normals tell, evenly."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csc_array

from psvideo.model.arrays import Doubles, Flags, Floats
from psvideo.plates.align.rigid.rigid_motion import Pixels
from psvideo.plates.align.rigid.seen_depth import beside

MOST_BLOCKS = 1500
"""Depth of larger parts is sought on so many blocks."""
SLOPE_OFF, STEEPEST = 1.0, 3.0
"""By how much slopes of normals that face the camera are off where plates do not lie on each other, from block to
block; steeper ones are off by more, as normals turn less there: up to the second."""


@dataclass(frozen=True, kw_only=True)
class DepthBlocks:
    """Blocks of ``step`` by ``step`` pixels, the ``number`` (row, col) of each, below 0 where nothing is sought; how
    firmly neighbours depart alike, ``even``; and by how much each departs so far, ``off_px`` (block,)."""

    step: int
    number: NDArray[np.intp]
    even: csc_array
    off_px: Doubles

    @classmethod
    def of(cls, there: Flags, near: Floats) -> "DepthBlocks":
        """Return blocks over what is ``there``, as ``near`` the camera as normals tell, in pixels; both (row, col)."""
        step = max(int(np.ceil(np.sqrt(np.count_nonzero(there) / MOST_BLOCKS))), 1)
        rows, cols = np.nonzero(there)
        number = np.full([-(-length // step) for length in there.shape], -1, np.intp)
        number[rows // step, cols // step] = 0
        inside = number >= 0
        count = int(np.count_nonzero(inside))
        number[inside] = np.arange(count)
        one, other = (np.concatenate(ends) for ends in zip(_neighbours(number), _neighbours(number.T), strict=True))
        off = _off_per_block(near, number, step)[inside]
        held = 1 / np.square((off[one] + off[other]) / 2)
        values = np.concatenate([held, held, -held, -held])
        places = np.concatenate([one, other, one, other]), np.concatenate([one, other, other, one])
        even = coo_array((values, places), (count, count)).tocsc()  # type: ignore[no-untyped-call]
        return cls(step=step, number=number, even=even, off_px=np.zeros(count))

    def at(self, pixels: Pixels) -> NDArray[np.intp]:
        """Return the numbers of the blocks in which pixels lie."""
        return self.number[pixels[0] // self.step, pixels[1] // self.step]

    def spread(self, by_px: Doubles, shape: tuple[int, ...]) -> Floats:
        """Return what blocks change by at every pixel, (row, col)."""
        full = beside(by_px, self.number >= 0).astype(np.float32)
        size = self.number.shape[1] * self.step, self.number.shape[0] * self.step
        return np.asarray(cv2.resize(full, size, interpolation=cv2.INTER_LINEAR)[: shape[0], : shape[1]], np.float32)


def _off_per_block(near: Floats, number: NDArray[np.intp], step: int) -> Doubles:
    """Return by how much the step from block to block is off, in pixels, (row, col)."""
    of_blocks = cv2.resize(near, number.shape[::-1], interpolation=cv2.INTER_AREA).astype(np.float64)
    steep = sum(np.square(slope) for slope in np.gradient(of_blocks, step))
    return np.asarray(SLOPE_OFF * step * (1 + np.minimum(steep, STEEPEST**2)))


def _neighbours(number: NDArray[np.intp]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the numbers of blocks beside each other along rows."""
    both = (number[:, :-1] >= 0) & (number[:, 1:] >= 0)
    return number[:, :-1][both], number[:, 1:][both]
