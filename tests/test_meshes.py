"""Meshes of depth: triangles cover what is valid once, and stop at holes and cuts."""

import numpy as np
import pytest
from true_depth import flat, surface

from psvideo.solve.depth import (
    Depth,
    mesh_of,
)


def area(depth: Depth) -> tuple[int, float]:
    """Triangles, and their area in squares of pixels; every one must face the camera."""
    normals = np.broadcast_to(np.array([0.0, 0, 1]), (*depth.valid.shape, 3))
    mesh = mesh_of(surface(normals, depth.valid), depth)
    a, b, c = (mesh.points[mesh.triangles[:, n]] * 10 for n in range(3))
    cross = np.cross(b - a, c - a)
    assert (cross[:, 2] > 0).all()
    return len(mesh.triangles), float(cross[:, 2].sum() / 2)


def test_triangles_cover_what_is_valid_once_and_leave_holes() -> None:
    valid = np.ones((6, 8), np.bool_)
    assert area(flat(valid)) == pytest.approx((2 * 35, 35))
    valid[3, 4] = False  # four squares lose a corner: half of each remains
    assert area(flat(valid)) == pytest.approx((2 * 31 + 4, 33))
    assert area(flat(np.zeros((4, 4), np.bool_))) == (0, 0)


def test_triangles_stop_at_cuts() -> None:
    valid = np.ones((6, 8), np.bool_)
    east = np.zeros_like(valid)
    east[:, 3] = True
    assert area(flat(valid, cut_east=east)) == pytest.approx((2 * 30, 30))
    one = np.zeros_like(valid)
    one[2, 3] = True  # a single cut side takes the triangles that it bounds, and no more
    assert area(flat(valid, cut_east=one)) == pytest.approx((2 * 33 + 2, 34))
    assert area(flat(valid, cut_south=one)) == pytest.approx((2 * 33 + 2, 34))
