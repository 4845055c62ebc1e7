"""Heights that give a surface its scale: known depth, what was seen before, or the rig's plane."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.errors import PsvideoError
from psvideo.model.arrays import Doubles, Mask
from psvideo.model.irradiance.ground import FARTHEST_SHARE
from psvideo.solve.depth.view import Box, View

Plane = tuple[float, float, float, float]


@dataclass(frozen=True, kw_only=True)
class Anchor:
    """Heights that parts are put onto: ``heights`` of a rectangle, and ``seen``, where in it they are known (None:
    everywhere); the ``plane`` that they are read from, if any. Whole planes of heights, in 64 bits, would be as large
    as all that integrating takes."""

    heights: Callable[[Box], Doubles]
    seen: Callable[[Box], Mask] | None = None
    plane: NDArray[np.float32] | None = None

    def common(self, box: Box, part: Mask) -> Mask:
        """Return where a part of a rectangle is known."""
        return part if self.seen is None else part & self.seen(box)


def anchors_of(
    view: View,
    shape: tuple[int, ...],
    plane: Plane | None,
    reference: NDArray[np.float32] | None,
    known_m: NDArray[np.float32] | None,
) -> list[Anchor]:
    """Return what gives how far away things are, the most certain first; the last one in every pixel, if any.

    ``plane`` is n . X + d = 0 in camera coordinates, metres; ``reference`` (row, col) the depth of an instant before,
    ``known_m`` (row, col) depth that is known from elsewhere, both along the axis and 0 where there is none.
    """
    anchors = []
    if known_m is not None and view.perspective:
        anchors.append(_known(known_m, view))
    if reference is not None:
        anchors.append(_known(reference, view))
    if plane is not None and view.perspective:
        anchors.append(_plane(plane, view, shape))
    elif known_m is not None and view.perspective:
        there = known_m[known_m > 0]
        usual = float(np.median(height_from_depth(there, view, shape[1]))) if there.size else 0.0
        anchors.append(Anchor(heights=lambda box: np.full((len(known_m[box]), 1), usual)))
    return anchors


def depth_from_height(height: Doubles, view: View, width_px: int) -> Doubles:
    """Depth from height: metres or relative, or orthographic in widths of the picture about a median of 1."""
    depth: Doubles = 1.0 + height / width_px if view.focal_px is None else np.exp(height / view.focal_px[0])
    return depth


def _known(depth: NDArray[np.float32], view: View) -> Anchor:
    """Return heights that are known as depth: where that is above 0, and orthographic where it is not 0."""
    width_px = depth.shape[1]

    def seen(box: Box) -> Mask:
        return np.asarray(depth[box] > 0 if view.perspective else depth[box] != 0)

    return Anchor(heights=lambda box: height_from_depth(depth[box], view, width_px), seen=seen, plane=depth)


def height_from_depth(depth: NDArray[np.float32], view: View, width_px: int) -> Doubles:
    """The inverse of ``depth_from_height``; anything where no depth is known."""
    if view.focal_px is None:
        return (depth.astype(np.float64) - 1.0) * width_px
    there = np.where(depth > 0, depth, 1).astype(np.float64)
    height: Doubles = np.log(there) * view.focal_px[0]
    return height


def _plane(plane: Plane, view: View, shape: tuple[int, ...]) -> Anchor:
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
    return Anchor(
        heights=lambda box: -np.log(np.maximum(inverse(x[box[1]], y[box[0]]), FARTHEST_SHARE * nearest)) * focal
    )
