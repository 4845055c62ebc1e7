"""Depth in metres, or relative: the scale that normals alone cannot give, the same over a clip.

Normals give a surface's shape, in perspective up to one factor, and for every part of it that hangs together a factor
of its own. The rig's [surface] plane gives it: each part's median depth is put onto the plane. Without a plane the
median depth is 1. Depth that is known from elsewhere (a scan, a depth camera) comes before both. From a clip's second
instant on, what is seen in the first instant too keeps the first one's scale, so that a flickering mask does not make
the surface breathe; a subject that comes nearer keeps its distance as well, for normals see no difference to one that
stays.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.errors import PsvideoError
from psvideo.model.camera import FloatArray
from psvideo.solve.depth.cao2022 import Height, Mask
from psvideo.solve.depth.view import View

LEAST_PART_PX = 64
"""Parts with fewer pixels get no depth: speckles, of which neither shape nor place is known."""
LEAST_COMMON_SHARE = 0.2
"""A part takes the first instant's scale when at least this share of it was seen then."""
FARTHEST_SHARE = 1e-3
"""A plane that runs past the horizon is followed to a thousand times its nearest depth."""

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
    shifted = np.zeros(height.height.shape)
    kept = np.zeros_like(height.valid)
    parts = 0
    for number in range(1, count):  # 0 is what is not valid
        left, top, width, high, size = facts[number]
        if size < LEAST_PART_PX:
            continue
        box = slice(top, top + high), slice(left, left + width)
        part = labels[box] == number
        parts += 1
        shifted[box][part] = height.height[box][part] + _shift(height.height, box, part, anchors)
        kept[box] |= part
    return Depth(
        depth=np.where(kept, _depth_of(shifted, view), 0).astype(np.float32),
        cut_east=height.cut_east,
        cut_south=height.cut_south,
        parts=parts,
        metric=view.perspective and not (plane is None and known_m is None),
        view=view,
    )


Anchor = tuple[FloatArray, Mask]
"""Heights that parts are put onto, and where they are known."""


def _anchors(
    view: View,
    shape: tuple[int, ...],
    plane: Plane | None,
    reference: Depth | None,
    known_m: NDArray[np.float32] | None,
) -> list[Anchor]:
    """What gives how far away things are, the most certain first; the last one in every pixel, if any."""
    anchors = []
    everywhere = np.ones(shape, np.bool_)
    if known_m is not None and view.perspective:
        anchors.append(_height_of(known_m, view))
    if reference is not None:
        anchors.append(_height_of(reference.depth, view))
    if plane is not None and view.perspective:
        anchors.append((_plane_height(plane, view, shape), everywhere))
    elif known_m is not None and view.perspective:
        height, seen = anchors[0]
        anchors.append((np.full(shape, np.median(height[seen]) if seen.any() else 0.0), everywhere))
    return anchors


def _shift(height: FloatArray, box: tuple[slice, slice], part: Mask, anchors: list[Anchor]) -> float:
    """By how much a part's height is to be raised."""
    for goal, seen in anchors:
        common = part & seen[box]
        if common.sum() >= LEAST_COMMON_SHARE * part.sum():
            return float(np.median((goal[box] - height[box])[common]))
    return -float(np.median(height[box][part]))


def _depth_of(height: FloatArray, view: View) -> FloatArray:
    """Depth from height: metres or relative, or orthographic in widths of the picture about a median of 1."""
    depth: FloatArray = 1.0 + height / height.shape[1] if view.focal_px is None else np.exp(height / view.focal_px[0])
    return depth


def _height_of(known: NDArray[np.float32], view: View) -> Anchor:
    """The inverse of ``_depth_of``, where the depth is above 0."""
    valid = known > 0
    depth = np.where(valid, known, 1).astype(np.float64)
    if view.focal_px is None:
        return (depth - 1.0) * depth.shape[1], valid
    height: FloatArray = np.log(depth) * view.focal_px[0]
    return height, valid


def _plane_height(plane: Plane, view: View, shape: tuple[int, ...]) -> FloatArray:
    """The height of a plane in every pixel; beyond its horizon that of the farthest."""
    x, y = view.rays(shape[0], shape[1])
    toward = plane[2] - plane[0] * x - plane[1] * y
    inverse = toward / plane[3] if plane[3] else np.zeros_like(toward)  # 1 / depth along the ray (x, y, -1)
    if inverse.max() <= 0:
        raise PsvideoError(
            f"The rig's [surface] plane {list(plane)} lies nowhere before the camera, so depth cannot be put on it. "
            "Expected a, b, c, d of a x + b y + c z + d = 0 with the scene at negative z, in metres: [0, 0, 1, 1.2] is "
            "a wall at 1.2 m."
        )
    inverse = np.maximum(inverse, FARTHEST_SHARE * inverse.max())
    focal = 1.0 if view.focal_px is None else view.focal_px[0]
    height: FloatArray = np.broadcast_to(-np.log(inverse) * focal, shape).astype(np.float64)
    return height
