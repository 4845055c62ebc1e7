"""Depth in metres, or relative: the scale that normals alone cannot give, the same over a clip.

Normals give a surface's shape, in perspective up to one factor, and for every part of it that hangs together a factor
of its own. The rig's [surface] plane gives it: each part's median depth is put onto the plane. Without a plane the
median depth is 1. Depth that is known from elsewhere (a scan, a depth camera) comes before both. From a clip's second
instant on, what is seen in the first instant too keeps the first one's scale, so that a flickering mask does not make
the surface breathe; a subject that comes nearer keeps its distance as well, for normals see no difference to one that
stays.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.compute.spilled import bands, kept_in, let_go
from psvideo.model.arrays import Doubles, Mask
from psvideo.model.surface import Distances
from psvideo.solve.depth.anchors import Anchor, Plane, anchors_of, depth_from_height
from psvideo.solve.depth.cao2022 import Height
from psvideo.solve.depth.placing import Placed, placed_by
from psvideo.solve.depth.view import Box, View

LEAST_PART_PX = 64
"""Parts with fewer pixels get no depth: speckles, of which neither shape nor place is known."""
LEAST_COMMON_SHARE = 0.2
"""A part takes the first instant's scale when at least this share of it was seen then."""


@dataclass(frozen=True, kw_only=True)
class Depth:
    """Depth along the optical axis at one instant, and where the surface breaks.

    Attributes
    ----------
    depth
        Shape (row, col), float32, in metres where ``metric``, else relative; 0 where not valid.
    cut_east, cut_south
        Shape (row, col), True where the surface jumps to the right or lower neighbour.
    parts
        How many pieces the mask falls into; each has a scale of its own.
    metric
        Whether depth is in metres.
    view
        The lens; ``view.points(depth)`` gives the points (row, col, 3) in the camera's frame.
    placed
        How far away near lights' falloff put each part; empty where it did not.
    """

    depth: NDArray[np.float32]
    cut_east: Mask
    cut_south: Mask
    parts: int
    metric: bool
    view: View
    placed: tuple[Placed, ...] = ()

    @property
    def valid(self) -> Mask:
        """Where there is depth."""
        valid: Mask = self.depth != 0
        return valid

    def kept_in(self, spare: Path | None) -> "Depth":
        """Return the same, of which what is large lies in files in a folder, if there is one."""
        return replace(
            self,
            depth=kept_in(self.depth, spare),
            cut_east=kept_in(self.cut_east, spare),
            cut_south=kept_in(self.cut_south, spare),
        )


def depth_of_height(
    height: Height,
    view: View,
    *,
    plane: Plane | None = None,
    reference: Depth | None = None,
    known_m: NDArray[np.float32] | None = None,
    distances: Distances | None = None,
) -> Depth:
    """Return the depth of a height: its parts where they are known to be, or where near lights' ``distances`` put them,
    or as in ``reference``, or on the ``plane``.

    ``plane`` is n . X + d = 0 in camera coordinates, metres; ``known_m`` (row, col) is depth along the axis, 0 where it
    is not known. All mean something in a perspective view only.
    """
    before = None if reference is None else reference.depth
    anchors = anchors_of(view, height.valid.shape, plane, before, known_m)
    depth = np.zeros(height.valid.shape, np.float32)
    parts = 0
    placed: list[Placed] = []
    for part in _parts(height.layers or (height.valid,)):
        parts += 1
        if distances is None or known_m is not None:
            shift = _shift(height.height, part, anchors)
        else:
            shift, place = placed_by(distances, height.height, part.mask, view, before)
            placed.append(place)
        _put(depth, height.height, part, shift, view)
    return Depth(
        depth=depth,
        cut_east=height.cut_east,
        cut_south=height.cut_south,
        parts=parts,
        metric=view.perspective and not (plane is None and known_m is None),
        view=view,
        placed=tuple(placed),
    )


@dataclass(frozen=True, kw_only=True)
class _Part:
    """A piece of what is valid: the rectangle it lies in, and its number among the labels (row, col)."""

    rows: slice
    cols: slice
    labels: NDArray[Any]
    number: int

    def mask(self, box: Box) -> Mask:
        """What of a rectangle is the part's."""
        return np.asarray(self.labels[box] == self.number)

    def bands(self) -> Iterator[tuple[Box, Mask]]:
        """Yield the rectangles of a few rows each, and what of them is the part's."""
        for first, last in bands(self.rows.stop - self.rows.start):
            box = slice(self.rows.start + first, self.rows.start + last), self.cols
            yield box, self.labels[box] == self.number


def _parts(layers: Sequence[Mask]) -> Iterator[_Part]:
    """Give the pieces that layers fall into, but for speckles."""
    for layer in layers:
        count, labels, facts, _ = cv2.connectedComponentsWithStats(layer.astype(np.uint8), connectivity=4)
        for number in range(1, count):  # 0 is what is not valid
            left, top, width, high, size = facts[number]
            if size >= LEAST_PART_PX:
                yield _Part(rows=slice(top, top + high), cols=slice(left, left + width), labels=labels, number=number)


def _shift(height: Doubles, part: _Part, anchors: list[Anchor]) -> float:
    """By how much a part's height is to be raised."""
    size = sum(int(np.count_nonzero(mine)) for _, mine in part.bands())
    for anchor in anchors:
        common = sum(int(np.count_nonzero(anchor.common(box, mine))) for box, mine in part.bands())
        if common >= LEAST_COMMON_SHARE * size:
            return _median(height, part, common, anchor)
    return -_median(height, part, size, None)


def _median(height: Doubles, part: _Part, count: int, anchor: Anchor | None) -> float:
    """Return the median, over the ``count`` pixels of a part that an anchor knows, of what it lies above the height;
    without an anchor, of the part's height."""
    values = np.empty(count)
    filled = 0
    for box, mine in part.bands():
        own = height[box]
        if anchor is None:
            some = own[mine]
        else:
            common = anchor.common(box, mine)
            some = np.broadcast_to(anchor.heights(box), own.shape)[common] - own[common]
        values[filled : filled + some.size] = some
        filled += some.size
        let_go(height[box[0]])
        if anchor is not None and anchor.plane is not None:
            let_go(anchor.plane[box[0]])
    return float(np.median(values, overwrite_input=True))


def _put(depth: NDArray[np.float32], height: Doubles, part: _Part, shift: float, view: View) -> None:
    """Put a part's depth into its place."""
    for box, mine in part.bands():
        depth[box][mine] = depth_from_height(height[box][mine] + shift, view, depth.shape[1])
        let_go(height[box[0]])
