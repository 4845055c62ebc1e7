"""Depth in metres, or relative: the scale that normals alone cannot give, the same over a clip.

Normals give a surface's shape, in perspective up to one factor, and for every part of it that hangs together a factor
of its own. The rig's [surface] plane gives it: each part's median depth is put onto the plane. Without a plane the
median depth is 1. Depth that is known from elsewhere (a scan, a depth camera) comes before both. From a clip's second
instant on, what is seen in the first instant too keeps the first one's scale, so that a flickering mask does not make
the surface breathe; a subject that comes nearer keeps its distance as well, for normals see no difference to one that
stays.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.compute.spilled import bands, kept_in, let_go
from psvideo.errors import PsvideoError
from psvideo.model.arrays import Doubles, Mask
from psvideo.model.irradiance.ground import FARTHEST_SHARE
from psvideo.solve.depth.cao2022 import Height
from psvideo.solve.depth.view import Box, View

LEAST_PART_PX = 64
"""Parts with fewer pixels get no depth: speckles, of which neither shape nor place is known."""
LEAST_COMMON_SHARE = 0.2
"""A part takes the first instant's scale when at least this share of it was seen then."""

Plane = tuple[float, float, float, float]


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
    """

    depth: NDArray[np.float32]
    cut_east: Mask
    cut_south: Mask
    parts: int
    metric: bool
    view: View

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
) -> Depth:
    """Return the depth of a height: its parts where they are known to be, or as in ``reference``, or on the ``plane``.

    ``plane`` is n . X + d = 0 in camera coordinates, metres; ``known_m`` (row, col) is depth along the axis, 0 where it
    is not known. Both mean something in a perspective view only.
    """
    anchors = _anchors(view, height.valid.shape, plane, reference, known_m)
    count, labels, facts, _ = cv2.connectedComponentsWithStats(height.valid.astype(np.uint8), connectivity=4)
    depth = np.zeros(height.valid.shape, np.float32)
    parts = 0
    for number in range(1, count):  # 0 is what is not valid
        left, top, width, high, size = facts[number]
        if size < LEAST_PART_PX:
            continue
        parts += 1
        part = _Part(rows=slice(top, top + high), cols=slice(left, left + width), labels=labels, number=number)
        _put(depth, height.height, part, _shift(height.height, part, anchors), view)
    return Depth(
        depth=depth,
        cut_east=height.cut_east,
        cut_south=height.cut_south,
        parts=parts,
        metric=view.perspective and not (plane is None and known_m is None),
        view=view,
    )


@dataclass(frozen=True, kw_only=True)
class _Part:
    """A piece of what is valid: the rectangle it lies in, and its number among the labels (row, col)."""

    rows: slice
    cols: slice
    labels: NDArray[Any]
    number: int

    def bands(self) -> Iterator[tuple[Box, Mask]]:
        """Yield the rectangles of a few rows each, and what of them is the part's."""
        for first, last in bands(self.rows.stop - self.rows.start):
            box = slice(self.rows.start + first, self.rows.start + last), self.cols
            yield box, self.labels[box] == self.number


@dataclass(frozen=True, kw_only=True)
class _Anchor:
    """Heights that parts are put onto: ``heights`` of a rectangle, and ``seen``, where in it they are known (None:
    everywhere); the ``plane`` that they are read from, if any. Whole planes of heights, in 64 bits, would be as large
    as all that integrating takes."""

    heights: Callable[[Box], Doubles]
    seen: Callable[[Box], Mask] | None = None
    plane: NDArray[np.float32] | None = None

    def common(self, box: Box, part: Mask) -> Mask:
        """Return where a part of a rectangle is known."""
        return part if self.seen is None else part & self.seen(box)


def _anchors(
    view: View,
    shape: tuple[int, ...],
    plane: Plane | None,
    reference: Depth | None,
    known_m: NDArray[np.float32] | None,
) -> list[_Anchor]:
    """What gives how far away things are, the most certain first; the last one in every pixel, if any."""
    anchors = []
    if known_m is not None and view.perspective:
        anchors.append(_known(known_m, view))
    if reference is not None:
        anchors.append(_known(reference.depth, view))
    if plane is not None and view.perspective:
        anchors.append(_plane(plane, view, shape))
    elif known_m is not None and view.perspective:
        there = known_m[known_m > 0]
        usual = float(np.median(_height_of(there, view, shape[1]))) if there.size else 0.0
        anchors.append(_Anchor(heights=lambda box: np.full((len(known_m[box]), 1), usual)))
    return anchors


def _shift(height: Doubles, part: _Part, anchors: list[_Anchor]) -> float:
    """By how much a part's height is to be raised."""
    size = sum(int(np.count_nonzero(mine)) for _, mine in part.bands())
    for anchor in anchors:
        common = sum(int(np.count_nonzero(anchor.common(box, mine))) for box, mine in part.bands())
        if common >= LEAST_COMMON_SHARE * size:
            return _median(height, part, common, anchor)
    return -_median(height, part, size, None)


def _median(height: Doubles, part: _Part, count: int, anchor: _Anchor | None) -> float:
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
        depth[box][mine] = _depth_of(height[box][mine] + shift, view, depth.shape[1])
        let_go(height[box[0]])


def _depth_of(height: Doubles, view: View, width_px: int) -> Doubles:
    """Depth from height: metres or relative, or orthographic in widths of the picture about a median of 1."""
    depth: Doubles = 1.0 + height / width_px if view.focal_px is None else np.exp(height / view.focal_px[0])
    return depth


def _known(depth: NDArray[np.float32], view: View) -> _Anchor:
    """Return heights that are known as depth: where that is above 0, and orthographic where it is not 0."""
    width_px = depth.shape[1]

    def seen(box: Box) -> Mask:
        return np.asarray(depth[box] > 0 if view.perspective else depth[box] != 0)

    return _Anchor(heights=lambda box: _height_of(depth[box], view, width_px), seen=seen, plane=depth)


def _height_of(depth: NDArray[np.float32], view: View, width_px: int) -> Doubles:
    """The inverse of ``_depth_of``; anything where no depth is known."""
    if view.focal_px is None:
        return (depth.astype(np.float64) - 1.0) * width_px
    there = np.where(depth > 0, depth, 1).astype(np.float64)
    height: Doubles = np.log(there) * view.focal_px[0]
    return height


def _plane(plane: Plane, view: View, shape: tuple[int, ...]) -> _Anchor:
    """Return the heights of a plane in every pixel; beyond its horizon that of the farthest."""
    x, y = view.rays(shape[0], shape[1])

    def inverse(x: Doubles, y: Doubles) -> Doubles:
        toward = plane[2] - plane[0] * x - plane[1] * y
        return toward / plane[3] if plane[3] else np.zeros_like(toward)  # 1 / depth along the ray (x, y, -1)

    nearest = inverse(x[[0, -1]], y[[0, -1]]).max()  # it grows one way along rows and one way along columns
    if nearest <= 0:
        raise PsvideoError(
            f"The rig's [surface] plane {list(plane)} lies nowhere before the camera, so depth cannot be put on it. "
            "Expected a, b, c, d of a x + b y + c z + d = 0 with the scene at negative z, in metres: [0, 0, 1, 1.2] is "
            "a wall at 1.2 m."
        )
    focal = 1.0 if view.focal_px is None else view.focal_px[0]
    return _Anchor(
        heights=lambda box: -np.log(np.maximum(inverse(x[box[1]], y[box[0]]), FARTHEST_SHARE * nearest)) * focal
    )
