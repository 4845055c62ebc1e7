"""Planes, balls and masks whose depth is known."""

import numpy as np
from numpy.typing import NDArray

from psvideo.model.surface import Surface
from psvideo.solve.depth import (
    Depth,
    View,
)

ROWS, COLS = 72, 90
PINHOLE = View(focal_px=(150.0, 140.0), principal_px=(40.0, 38.0))
EVERYWHERE = np.ones((ROWS, COLS), np.bool_)
Floats = NDArray[np.float64]


def disc(radius: float = 30.0) -> NDArray[np.bool_]:
    r, c = np.mgrid[:ROWS, :COLS]
    inside: NDArray[np.bool_] = (r - 36.2) ** 2 + (c - 44.7) ** 2 < radius**2
    return inside


def tilted_plane(view: View, normal: tuple[float, float, float]) -> tuple[Floats, Floats]:
    """Normals and true depth of a tilted plane through (0, 0, -1)."""
    n = np.array(normal) / np.linalg.norm(normal)
    x, y = view.rays(ROWS, COLS)
    if view.perspective:
        depth = n[2] / (n[2] - n[0] * x - n[1] * y)
    else:
        c, r = np.arange(COLS) - (COLS - 1) / 2, np.arange(ROWS)[:, None] - (ROWS - 1) / 2
        depth = 1 + (n[0] * c - n[1] * r) / n[2] / COLS
    return np.broadcast_to(n, (ROWS, COLS, 3)), depth + np.zeros((ROWS, COLS))


def sphere(view: View) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Normals, true depth and mask of a ball of radius 0.2 at (0.01, 0, -1) seen through a pinhole."""
    x, y = view.rays(ROWS, COLS)
    ray = np.dstack([x + 0 * y, y + 0 * x, -np.ones((ROWS, COLS))])
    centre = np.array([0.01, 0.0, -1.0])
    a, b, c = (ray**2).sum(2), ray @ centre, centre @ centre - 0.2**2
    inside = b**2 - a * c
    depth = (b - np.sqrt(np.maximum(inside, 0))) / a
    normals = (ray * depth[..., None] - centre) / 0.2
    facing = -(normals * ray).sum(2) / np.sqrt(a)
    return normals, depth, (inside > 0) & (facing > 0.3)


def two_plates() -> NDArray[np.bool_]:
    mask = np.zeros((ROWS, COLS), np.bool_)
    mask[10:60, 5:40] = True
    mask[20:50, 50:85] = True
    mask[2, 2] = True  # a speckle
    return mask


def surface(normals: Floats, valid: NDArray[np.bool_]) -> Surface:
    shown = np.where(valid[..., None], normals, 0).astype(np.float32)
    return Surface(normals=shown, albedo=np.where(valid, 0.5, 0).astype(np.float32), valid=valid)


def flat(valid: NDArray[np.bool_], **cuts: NDArray[np.bool_]) -> Depth:
    none = np.zeros_like(valid)
    return Depth(
        depth=valid.astype(np.float32),
        parts=1,
        metric=True,
        view=View(focal_px=(10, 10)),
        cut_east=cuts.get("cut_east", none),
        cut_south=cuts.get("cut_south", none),
    )
