"""Motion vectors for compositing: the velocity of what moves, plain parts of it included.

Alignment moves what motion explains better than rest does, and that is what it needs: where plates look alike either
way, nothing is gained. A thing's plain inside shows nothing of its motion, nor does a textured one that goes by less
than a pixel. Here what is undecided and lies within what moves goes along; what clearly rests stands, and so does what
is undecided and lies around: a wall, whose border is mostly the picture's.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.compute.spilled import let_go
from psvideo.model.arrays import Flags, Floats
from psvideo.plates.align.velocity.followed import Followed, odd_width

GAPS_PX = 9
"""Gaps of this many pixels in what moves are closed: outlines along the motion show nothing of it."""
MOST_EDGE = 1 / 8
"""What touches more of the picture's edge than this share is what things move before."""
SMOOTH_PX = 27
"""Vectors of plain parts are means over such a window, as where alignment lets them grow."""


def fill_per_s(motion: Followed | None, planes: Floats) -> None:
    """Fill ``planes`` (2, row, col) with the velocity of every pixel of a picture of that shape, x right and y down."""
    rows, cols = planes.shape[1:]
    if motion is None:
        planes[:] = 0
        return
    small_rows, small_cols = motion.moves.shape
    scale = cols / small_cols, rows / small_rows
    along = motion.carried or (0.0, 0.0)
    for factor, way, carried, plane in zip(scale, _of_whole_things(motion), along, planes, strict=True):
        cv2.resize(way + np.float32(carried), (cols, rows), dst=plane, interpolation=cv2.INTER_LINEAR)
        plane *= np.float32(factor)
        let_go(plane)


def _of_whole_things(motion: Followed) -> Floats:
    """Return the velocity, (2, row, col), also of what lies undecided within what moves."""
    inside = _enclosed(motion)
    if not inside.any():
        return motion.velocity
    nearest = np.where(motion.moves, motion.velocity, motion.nearby)
    size = (odd_width(SMOOTH_PX, motion.step),) * 2
    known = (inside | motion.moves).astype(np.float32)
    there = np.maximum(cv2.blur(known, size), np.float32(1e-6))
    smooth = np.stack([cv2.blur(plane * known, size) / there for plane in nearest])
    return np.asarray(np.where(inside, smooth, motion.velocity), np.float32)


def _enclosed(motion: Followed) -> Flags:
    """Return what is undecided and borders more on what moves than on what rests and on the picture's edge."""
    gaps = np.ones((odd_width(GAPS_PX, motion.step),) * 2, np.uint8)
    closed = cv2.morphologyEx(motion.moves.view(np.uint8), cv2.MORPH_CLOSE, gaps) > 0
    moves = closed & ~motion.rests
    count, parts = cv2.connectedComponents((~moves & ~motion.rests).astype(np.uint8), connectivity=4)
    labels = np.asarray(parts, np.int32)
    on_edge = _on_edge(labels, count)
    inside = _beside(labels, moves, count) > _beside(labels, motion.rests, count) + on_edge
    inside &= on_edge <= MOST_EDGE * 2 * sum(labels.shape)
    inside[0] = False
    return np.asarray(inside[labels] | (moves & ~motion.moves))


def _beside(labels: NDArray[np.int32], where: Flags, count: int) -> NDArray[np.intp]:
    """Return of every part how many sides of its pixels border on something."""
    pairs = (
        (labels[:, :-1], where[:, 1:]),
        (labels[:, 1:], where[:, :-1]),
        (labels[:-1], where[1:]),
        (labels[1:], where[:-1]),
    )
    sides = [np.bincount(own[other], minlength=count) for own, other in pairs]
    return np.asarray(np.sum(sides, axis=0), np.intp)


def _on_edge(labels: NDArray[np.int32], count: int) -> NDArray[np.intp]:
    edges = np.concatenate([labels[0], labels[-1], labels[:, 0], labels[:, -1]])
    return np.bincount(edges, minlength=count)
