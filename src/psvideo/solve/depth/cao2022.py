"""The height of a surface from its normals, with jumps where the surface jumps.

X. Cao, H. Santo, B. Shi, F. Okura and Y. Matsushita, Bilateral Normal Integration, ECCV 2022. The surface is taken to
be smooth on at least one side of every pixel in each direction, and the two one-sided differences are weighed against
each other by how far they step. The weights depend on the height, so weighted least squares are repeated with the
weights of the height before, beginning with equal ones. Each round is solved by multigrid, in two to ten cycles.

A later instant of a clip begins with the weights of the first one wherever it looks the same, which saves most of the
rounds, and is held there to the first one's height by so weak a force that only what nothing else decides follows it:
how far away a piece is around which the surface is cut.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.compute.spilled import bands, kept_in, let_go, lie_in_files, room_for
from psvideo.model.arrays import Doubles, Floats, Mask
from psvideo.solve.depth.integration import BILATERAL, SMOOTH, Integration, TakenOver, find_height
from psvideo.solve.depth.view import Box, Slopes, View, slopes_of

__all__ = ["BILATERAL", "SMOOTH", "Before", "Height", "Integration", "integrate", "laid_together"]

CUT_SHARE = 0.1
"""Neighbours count as cut apart when less than this share of the weight between them is left; half is left where a
surface is smooth, and with the paper's sharpness never less than 0.12 where steps are those of the normals."""


SAME_COSINE = 0.996
"""Normals less than 5 degrees apart look the same as in the instant before."""
AROUND_PX, SAME_SHARE = 7, 0.7
"""A pixel is the same where this many of those around it look the same: along outlines normals are noisy."""


@dataclass(frozen=True, kw_only=True)
class Height:
    """A surface's height, determined up to a shift in every part that hangs together.

    height: (row, col), see ``psvideo.solve.depth.view``: pixels of depth, or focal length times its logarithm; 0 where
        not valid.
    valid: (row, col).
    cut_east, cut_south: (row, col), True where the surface jumps between a pixel and its right or lower neighbour.
    rightward, downward: (row, col), how much a pixel's step to the right and down counts against the opposite one.
    layers: what is valid by layers (row, col) that were integrated one by one; empty where it was all at once.
    """

    height: Doubles
    valid: Mask
    cut_east: Mask
    cut_south: Mask
    rightward: Floats
    downward: Floats
    layers: tuple[Mask, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Before:
    """An instant that was integrated before, in the same view: its height and normals (row, col, 3)."""

    height: Height
    normals: NDArray[np.floating]

    def kept_in(self, spare: Path | None) -> "Before":
        """Return the same, of which what is large lies in files in a folder, if there is one."""
        height = replace(
            self.height,
            height=kept_in(self.height.height, spare),
            rightward=kept_in(self.height.rightward, spare),
            downward=kept_in(self.height.downward, spare),
        )
        return Before(height=height, normals=kept_in(self.normals, spare))

    def where(self, stays: Mask) -> "Before":
        """Return the same, known in some of its pixels only."""
        return replace(self, height=replace(self.height, valid=self.height.valid & stays))

    def let_go(self) -> None:
        """Let go what lies in files until it is looked at again."""
        let_go(self.height.height, self.height.rightward, self.height.downward, self.normals)


def integrate(
    normals: NDArray[np.floating],
    valid: Mask,
    view: View,
    *,
    how: Integration = BILATERAL,
    before: Before | None = None,
    spare: Path | None = None,
) -> Height:
    """Return the height of a surface from its normals (row, col, 3), camera frame, over a mask of any shape.

    What looks the same as ``before`` keeps its jumps, where they still hold, and its place. ``spare`` is a folder in
    whose files large pictures lie in part.
    """
    box = _box(valid)
    held = None if before is None else _held(before, normals, valid, box)
    slopes = slopes_of(normals, valid, view, box)
    slopes = Slopes(
        facing=kept_in(slopes.facing, spare),
        across=kept_in(slopes.across, spare),
        down=kept_in(slopes.down, spare),
        aspect=slopes.aspect,
    )
    if before is not None:
        before.let_go()
    height, rightward, downward = find_height(slopes, how, held=held, spare=spare)
    if before is not None:
        before.let_go()
    planes = (height, *_cuts(slopes, rightward, downward), rightward, downward)
    height, cut_east, cut_south, rightward, downward = (_whole(plane, valid.shape, box, spare) for plane in planes)
    return Height(
        height=height, valid=valid, cut_east=cut_east, cut_south=cut_south, rightward=rightward, downward=downward
    )


def laid_together(heights: Sequence[Height]) -> Height:
    """Return the heights of layers of a picture, none of whose pixels are valid in two, as one that is cut between
    them; takes the first one's memory."""
    first = heights[0]
    if len(heights) == 1:
        return first
    valid, layer = first.valid.copy(), np.zeros(first.valid.shape, np.uint8)
    for number, one in enumerate(heights[1:], 1):
        layer[one.valid] = number
        for name in ("height", "cut_east", "cut_south", "rightward", "downward"):
            into, plane = getattr(first, name), getattr(one, name)
            for top, end in bands(len(plane)):
                np.copyto(into[top:end], plane[top:end], where=one.valid[top:end])
                let_go(into[top:end], plane[top:end])
        valid |= one.valid
    first.cut_east[:, :-1] |= (layer[:, :-1] != layer[:, 1:]) & valid[:, :-1] & valid[:, 1:]
    first.cut_south[:-1] |= (layer[:-1] != layer[1:]) & valid[:-1] & valid[1:]
    return replace(first, valid=valid, layers=tuple(one.valid for one in heights))


def _whole(plane: NDArray[Any], shape: tuple[int, ...], box: Box, spare: Path | None) -> NDArray[Any]:
    """Put a plane into its place in the picture, in a file where it lies in one."""
    if plane.shape == shape:
        return plane
    whole = room_for(shape, plane.dtype, spare) if lie_in_files(plane) else np.zeros(shape, plane.dtype)
    place = whole[box]
    for first, last in bands(len(plane)):
        place[first:last] = plane[first:last]
        let_go(plane[first:last], whole[box[0]][first:last])
    return whole


def _box(valid: Mask) -> Box:
    """The smallest rectangle that holds all that is valid; the first pixel where nothing is."""
    rows, cols = np.flatnonzero(valid.any(axis=1)), np.flatnonzero(valid.any(axis=0))
    if not rows.size:
        return slice(0, 1), slice(0, 1)
    return slice(int(rows[0]), int(rows[-1]) + 1), slice(int(cols[0]), int(cols[-1]) + 1)


def _held(before: Before, normals: NDArray[np.floating], valid: Mask, box: Box) -> TakenOver:
    both = valid[box] & before.height.valid[box]
    cosine = np.zeros(both.shape, np.float32)
    for axis in range(3):
        along = normals[box][..., axis].astype(np.float32)
        cosine += np.multiply(along, before.normals[box][..., axis], out=along, dtype=np.float32)
    alike = cv2.blur((both & (cosine > SAME_COSINE)).astype(np.float32), (AROUND_PX, AROUND_PX))
    there = cv2.blur(both.astype(np.float32), (AROUND_PX, AROUND_PX))
    return TakenOver(
        same=both & (alike > SAME_SHARE * there),
        rightward=before.height.rightward[box],
        downward=before.height.downward[box],
        height=before.height.height[box],
    )


def _cuts(slopes: Slopes, rightward: Floats, downward: Floats) -> tuple[Mask, Mask]:
    """Where hardly any weight is left between neighbours that are both valid."""
    shape = slopes.facing.shape
    cut_east, cut_south = np.zeros(shape, np.bool_), np.zeros(shape, np.bool_)
    for first, last in bands(shape[0]):
        squared = slopes.facing[first : last + 1] ** 2  # of the row below the band too
        one, share = squared[: last - first], rightward[first:last]
        cut_east[first:last, :-1] = _cut(one[:, :-1], one[:, 1:], share[:, :-1], share[:, 1:])
        share = downward[first : last + 1]
        cut_south[first : first + len(squared) - 1] = _cut(squared[:-1], squared[1:], share[:-1], share[1:])
        let_go(slopes.facing[first:last], rightward[first:last], downward[first:last])
    return cut_east, cut_south


def _cut(one: Floats, other: Floats, share: Floats, next_share: Floats) -> Mask:
    """Where neighbours, of which the squared facing and the shares are given, are cut apart."""
    cut: Mask = (one > 0) & (other > 0) & (share * one + (1 - next_share) * other < CUT_SHARE * (one + other))
    return cut
