"""How near the camera the points of a body are, from its normals: the depth whose slopes are nearest to theirs.

It is rough and fast: it serves to tell how a body turns, by the middle of a few thousand pixels.
"""

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.linalg import spsolve

from psvideo.model.arrays import Doubles, Flags, Floats

MOST_PIXELS = 2500
"""Depth of larger parts is found on so many blocks."""
STEEPEST = np.float32(3)
"""Steeper slopes, of which a pixel or two are seen, count as this."""
FIRM = 1e-4
"""How firmly depth is held to 0: a part may be in pieces, whose distance nobody knows."""
HALF, LEAST = 0.5, np.float32(1e-6)

Edges = tuple[NDArray[np.intp], NDArray[np.intp], Doubles]
"""Numbers of neighbours, the one and the other, and the step from the one to the other."""


def depth_of(normals: Floats, there: Flags) -> Floats:
    """Return how near the camera every pixel of what is ``there`` (row, col) is, in pixels, 0 on average; elsewhere 0.

    ``normals`` (row, col, 3) point right, up and to the camera, and have any length; what faces away has no slope.
    """
    step = max(int(np.ceil(np.sqrt(np.count_nonzero(there) / MOST_PIXELS))), 1)
    size = -(-there.shape[1] // step), -(-there.shape[0] // step)
    faces = there & (normals[..., 2] > LEAST)
    facing, share = np.maximum(normals[..., 2], LEAST), _shrunk(faces.astype(np.float32), size)
    sideways = -normals[..., 0], normals[..., 1]
    slopes = [np.where(faces, np.clip(plane / facing, -STEEPEST, STEEPEST), np.float32(0)) for plane in sideways]
    right, down = (
        np.divide(step * _shrunk(slope, size), np.maximum(share, LEAST), dtype=np.float32) for slope in slopes
    )
    inside = _shrunk(there.astype(np.float32), size) > HALF
    if not inside.any():
        return np.zeros(there.shape, np.float32)
    near = beside(_integrated(right, down, inside), inside)
    full = cv2.resize(near.astype(np.float32), there.shape[::-1], interpolation=cv2.INTER_LINEAR)
    return np.asarray(np.where(there, full, 0), np.float32)


def _shrunk(values: Floats, size: tuple[int, int]) -> Floats:
    return np.asarray(cv2.resize(values, size, interpolation=cv2.INTER_AREA), np.float32)


def _integrated(right: Floats, down: Floats, inside: Flags) -> Doubles:
    """Return the depth of the pixels that are ``inside``, (pixel,), whose steps from pixel to pixel are nearest to
    slopes (row, col): by least squares, whose normal equations are Poisson's."""
    count = int(np.count_nonzero(inside))
    number = np.full(inside.shape, -1, np.intp)
    number[inside] = np.arange(count)
    parts = [_edges(number, right), _edges(number.T, down.T)]
    one, other, step = (np.concatenate(each) for each in zip(*parts, strict=True))
    ends, held = np.ones(len(one)), np.arange(count)
    values = np.concatenate([ends, ends, -ends, -ends, np.full(count, FIRM)])
    rows, cols = np.concatenate([one, other, one, other, held]), np.concatenate([one, other, other, one, held])
    wanted = np.bincount(other, step, count) - np.bincount(one, step, count)
    matrix = coo_array((values, (rows, cols)), (count, count)).tocsc()  # type: ignore[no-untyped-call]
    depth = spsolve(matrix, wanted)  # type: ignore[no-untyped-call]
    return np.asarray(depth - depth.mean(), np.float64)


def _edges(number: NDArray[np.intp], slope: Floats) -> Edges:
    """Return the steps along rows between pixels that have a ``number`` (row, col), below 0 where they have none."""
    both = (number[:, :-1] >= 0) & (number[:, 1:] >= 0)
    step = ((slope[:, :-1] + slope[:, 1:]) / 2)[both]
    return number[:, :-1][both], number[:, 1:][both], step.astype(np.float64)


def beside(depth: Doubles, inside: Flags) -> Doubles:
    """Return the depth of pixels ``inside`` and, beside them, of the nearest one, (row, col)."""
    outside = (~inside).astype(np.uint8)
    labels = cv2.distanceTransformWithLabels(outside, cv2.DIST_L2, 3, labelType=cv2.DIST_LABEL_PIXEL)[1]
    of_label = np.zeros(int(labels.max()) + 1)
    of_label[labels[inside]] = depth
    return np.asarray(of_label[labels], np.float64)
