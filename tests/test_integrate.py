"""Integration: depth from normals is the surface that they came from, whatever the mask, the view and the steps."""

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from picture_file import read_picture
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import lsqr
from true_depth import COLS, EVERYWHERE, PINHOLE, ROWS, Floats, disc, sphere, surface, tilted_plane, two_plates

from psvideo.errors import PsvideoError
from psvideo.solve.depth import (
    Depth,
    Shaping,
    View,
    begun,
    depth_of,
    depth_of_height,
    integrate,
    mesh_of,
)
from psvideo.solve.depth.cao2022 import SMOOTH, Integration
from psvideo.solve.depth.multigrid import empty_grids, set_up_levels, solve, weighed
from psvideo.solve.depth.reweighting import write_board
from psvideo.solve.depth.simchony1990 import poisson_height
from psvideo.solve.depth.view import slopes_of


def with_holes() -> NDArray[np.bool_]:
    mask = disc()
    mask[30:34, 40:52] = False
    mask[::7, ::5] = False
    return mask


def normals_of_points(points: Floats) -> Floats:
    """Normals by brute force: the cross product of central differences of the points themselves."""
    n = np.cross(np.gradient(points, axis=1), -np.gradient(points, axis=0))
    normals: Floats = n / np.linalg.norm(n, axis=2, keepdims=True)
    return normals


def error(found: Depth, true: Floats) -> float:
    """Largest relative error of a depth after the best single scale."""
    ratio = (true / np.where(found.valid, found.depth, 1))[found.valid]
    return float(np.abs(ratio / np.median(ratio) - 1).max())


@pytest.mark.parametrize("mask", [EVERYWHERE, disc(), with_holes()], ids=["rectangle", "disc", "holes"])
@pytest.mark.parametrize("normal", [(0, 0, 1), (0.4, 0.1, 1), (-0.3, 1.2, 1)])
def test_a_pinhole_sees_a_tilted_plane_as_a_plane(mask: NDArray[np.bool_], normal: tuple[float, float, float]) -> None:
    normals, depth = tilted_plane(PINHOLE, normal)
    # a step between pixels is the mean of two slopes, which for a plane is wrong by (step / f)^3 / 12 only
    assert error(depth_of_height(integrate(normals, mask, PINHOLE), PINHOLE), depth) < 1e-4


@pytest.mark.parametrize("mask", [EVERYWHERE, disc(), with_holes()], ids=["rectangle", "disc", "holes"])
def test_an_orthographic_ramp_is_exact(mask: NDArray[np.bool_]) -> None:
    normals, depth = tilted_plane(View(), (-0.7, 0.5, 1.0))
    exact = Integration(tolerance=1e-9)
    found = depth_of_height(integrate(normals, mask, View(), how=exact), View())
    assert np.ptp((found.depth - depth)[mask]) < 1e-6


@pytest.mark.parametrize("how", [SMOOTH, Integration()], ids=["smooth", "bilateral"])
def test_a_ball_comes_out_as_a_ball(how: Integration) -> None:
    normals, depth, mask = sphere(PINHOLE)
    found = depth_of_height(integrate(normals, mask, PINHOLE, how=how), PINHOLE)
    ratio = (depth / np.where(mask, found.depth, 1))[mask]
    assert np.abs(ratio / np.median(ratio) - 1).mean() < 4e-3  # the ball is 0.2 deep, at 1.0; a pixel is 0.007


def test_finer_pixels_bring_the_ball_nearer_to_the_truth() -> None:
    def mean_error(size: int) -> float:
        r, c = np.mgrid[:size, :size]
        x, y = (c - size / 2) / size * 2, -(r - size / 2) / size * 2
        mask = x**2 + y**2 < 0.7**2
        z = np.sqrt(np.maximum(1 - x**2 - y**2, 0))
        height = integrate(np.dstack([x, y, z]), mask, View(), how=SMOOTH).height
        wrong = (height * 2 / size + z)[mask]
        return float(np.abs(wrong - wrong.mean()).mean())

    assert mean_error(128) < mean_error(64) / 3  # second order: a quarter, but for the border's stairs


def test_depth_to_normals_to_depth_is_the_identity() -> None:
    rng = np.random.default_rng(5)
    bumps: NDArray[Any] = cv2.GaussianBlur(rng.normal(size=(ROWS, COLS)), (0, 0), 7)
    depth: Floats = 1.5 + 0.8 * bumps
    normals = normals_of_points(PINHOLE.points(depth))
    found = depth_of_height(integrate(normals, EVERYWHERE, PINHOLE), PINHOLE)
    assert error(found, depth) < 2e-3
    assert np.ptp(depth) > 0.1


@pytest.mark.parametrize("turns", [1, 2, 3])
def test_turning_the_picture_turns_the_result(turns: int) -> None:
    normals, _, mask = sphere(PINHOLE)
    mask &= with_holes()
    turned = np.rot90(normals, turns).copy()
    for _ in range(turns):  # a turn to the left takes x to y and y to -x
        turned = np.stack([-turned[..., 1], turned[..., 0], turned[..., 2]], axis=-1)
    exact = Integration(tolerance=1e-8, settled=1e-6)
    straight = integrate(normals, mask, View(), how=exact).height
    found = np.rot90(
        integrate(turned, np.rot90(mask, turns).copy(), View(), how=exact).height,
        -turns,
    )
    assert np.ptp((found - straight)[mask]) < 1e-3


def test_a_far_camera_with_a_long_lens_sees_as_an_orthographic_one() -> None:
    r, c = np.mgrid[:ROWS, :COLS]
    hill = 12 * np.exp(-((r - 36) ** 2 + (c - 45) ** 2) / 300)  # pixels towards the camera
    dr, dc = np.gradient(hill)
    normals = np.dstack([-dc, dr, np.ones_like(hill)])
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    flat = integrate(normals, EVERYWHERE, View()).height
    far = View(focal_px=(1e6, 1e6))
    deep = integrate(normals, EVERYWHERE, far).height  # f log(depth / median) = pixels, for depth about f pixels
    assert np.ptp(flat - deep) < 2e-3
    assert np.ptp(flat) > 11


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000))
def test_the_solver_is_a_sparse_least_squares_solver(seed: int) -> None:
    """Against scipy's lsqr on the same equations, written out one by one, on random masks in random pieces."""
    rng = np.random.default_rng(seed)
    shape = (int(rng.integers(3, 14)), int(rng.integers(3, 14)))
    mask = rng.random(shape) < 0.8
    normals = rng.normal(size=(*shape, 3)) * [0.4, 0.4, 0.1] + [0, 0, 1]
    slopes = slopes_of(normals, mask, View())
    number = np.cumsum(mask.ravel()).reshape(shape) - 1
    rows: list[list[tuple[int, float]]] = []
    right = []
    for r, c in np.argwhere(mask):
        for dr, dc, slope in (
            (0, 1, slopes.across),
            (0, -1, -slopes.across),
            (1, 0, slopes.down),
            (-1, 0, -slopes.down),
        ):
            q = r + dr, c + dc
            if 0 <= q[0] < shape[0] and 0 <= q[1] < shape[1] and mask[q]:
                a = slopes.facing[r, c]
                rows.append([(number[q], a), (number[r, c], -a)])
                right.append(slope[r, c])
    height = integrate(normals, mask, View(), how=Integration(sharpness=0.0, tolerance=1e-11)).height
    if not rows or mask.all():  # a whole rectangle takes the other path
        return
    at = [(n, col, value) for n, row in enumerate(rows) for col, value in row]
    n, col, value = zip(*at, strict=True)
    matrix: Any = coo_matrix((value, (n, col)), shape=(len(rows), int(mask.sum()))).tocsr()  # type: ignore[no-untyped-call]
    best = lsqr(matrix, right, atol=1e-13, btol=1e-13, iter_lim=5000)[0]  # type: ignore[no-untyped-call]
    mine = matrix @ height[mask] - right
    assert np.linalg.norm(mine) <= np.linalg.norm(matrix @ best - right) * (1 + 1e-6) + 1e-9


@settings(max_examples=20, deadline=None)
@given(st.integers(1, 40), st.integers(1, 40), st.integers(0, 1000))
def test_the_fast_path_undoes_differences_exactly(rows: int, cols: int, seed: int) -> None:
    """A surface whose steps are the means of its slopes: linear ramps, of any size and steepness."""
    rng = np.random.default_rng(seed)
    a, b = rng.normal(size=2)
    normals = np.broadcast_to(np.array([a, b, 1.0]) / np.linalg.norm([a, b, 1.0]), (rows, cols, 3))
    slopes = slopes_of(normals, np.ones((rows, cols), np.bool_), View())
    height = poisson_height(slopes)
    assert np.allclose(np.diff(height, axis=1), a, atol=1e-9)
    assert np.allclose(np.diff(height, axis=0), -b, atol=1e-9)


def test_one_multigrid_cycle_is_worth_many_plain_steps() -> None:
    rng = np.random.default_rng(1)
    shape = (129, 200)
    grids = empty_grids(shape)
    east, south, right = rng.uniform(0.01, 1, shape), rng.uniform(0.01, 1, shape), rng.normal(size=shape)
    east[:, -1], south[-1] = 0, 0
    finest = grids.levels[0]
    for plane, board in ((east, finest.ties[0]), (south, finest.ties[1]), (right - right.mean(), finest.right)):
        write_board(plane.astype(np.float32), board, 0)
    set_up_levels(grids)
    wanted = weighed(grids)
    assert solve(grids, stop=1e-8 * wanted, most=100)[1] < 30
    assert weighed(grids) <= 1e-8 * wanted


def torn() -> tuple[Floats, Floats]:
    """A wall of which the lower right quarter leans forward, torn off along its left: normals, depth in pixels."""
    right = np.arange(COLS) + np.zeros((ROWS, 1)) >= COLS // 2
    slope = 0.6
    normals = np.zeros((ROWS, COLS, 3))
    normals[..., 2] = 1
    lean = np.arange(ROWS)[:, None] - 24.5
    normals[right & (lean > 0)] = np.array([0, slope, 1]) / np.hypot(slope, 1)
    return normals, np.where(right, -slope * np.maximum(lean, 0), 0.0)


def test_a_tear_is_found_and_bends_neither_side() -> None:
    normals, depth = torn()
    smooth = integrate(normals, EVERYWHERE, View(), how=SMOOTH).height
    found = integrate(normals, EVERYWHERE, View())
    # the first pixels of the gap, less than two wide, are bridged: a tenth of the smooth answer's error remains
    assert np.std(found.height - depth) < 0.1 * np.std(smooth - depth)
    assert found.cut_east[36:, COLS // 2 - 1].mean() > 0.9  # where it gapes by more than 7 pixels
    assert not found.cut_south.any()
    assert np.argwhere(found.cut_east)[:, 1].tolist() == [COLS // 2 - 1] * int(found.cut_east.sum())


def test_a_smooth_surface_is_cut_nowhere() -> None:
    normals, _, mask = sphere(PINHOLE)
    found = integrate(normals, mask, PINHOLE)
    assert not found.cut_east.any()
    assert not found.cut_south.any()


def test_what_is_not_valid_touches_nothing() -> None:
    normals, _, mask = sphere(PINHOLE)
    noisy = np.where(mask[..., None], normals, np.random.default_rng(0).normal(size=normals.shape))
    assert np.array_equal(integrate(noisy, mask, PINHOLE).height, integrate(normals, mask, PINHOLE).height)
    nothing = depth_of_height(integrate(normals, np.zeros_like(mask), PINHOLE), PINHOLE)
    assert not nothing.depth.any()
    assert nothing.parts == 0


def test_each_part_is_put_on_the_plane_by_itself_and_speckles_get_no_depth() -> None:
    normals, depth = tilted_plane(PINHOLE, (0.3, 0.0, 1.0))
    n = normals[0, 0]
    found = depth_of_height(
        integrate(normals, two_plates(), PINHOLE), PINHOLE, plane=(n[0] * 2, n[1] * 2, n[2] * 2, n[2] * 2 * 1.7)
    )
    assert found.metric
    assert found.parts == 2
    assert found.depth[2, 2] == 0
    assert np.abs(found.depth / (1.7 * depth) - 1)[found.valid].max() < 1e-4
    assert np.median(
        depth_of_height(integrate(normals, two_plates(), PINHOLE), PINHOLE).depth[20:50, 50:85]
    ) == pytest.approx(1)


@pytest.mark.parametrize("wrong", [(0.0, 0.0, 1.0, -1.2), (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 1.0, 0.0)])
def test_a_plane_behind_the_camera_is_refused(wrong: tuple[float, float, float, float]) -> None:
    normals, _ = tilted_plane(PINHOLE, (0, 0, 1))
    with pytest.raises(PsvideoError, match="nowhere before the camera"):
        depth_of_height(integrate(normals, EVERYWHERE, PINHOLE), PINHOLE, plane=wrong)


PUBLISHED_MM = {"cat": 0.074, "bear": 0.334, "pot2": 0.220}
"""Mean absolute depth errors that Cao et al. publish beside their program for these normals, after the best scale."""


@pytest.mark.parametrize("name", ["cat", "bear", "pot2"])
def test_real_shapes_come_out_as_near_as_published(name: str, shared_data: Path) -> None:
    folder = shared_data / "diligent_gt" / name
    codes = read_picture(folder / "normal_map.png", cv2.IMREAD_UNCHANGED)[..., ::-1]
    normals = codes.astype(np.float64) / 65535 * 2 - 1
    mask = read_picture(folder / "mask.png", cv2.IMREAD_GRAYSCALE) > 0
    k = np.loadtxt(folder / "K.txt")
    true = np.load(folder / "depth_gt.npz")["depth_gt"]
    view = View(focal_px=(k[0, 0], k[1, 1]), principal_px=(k[0, 2], k[1, 2]))
    found = depth_of_height(integrate(normals, mask, view), view)
    seen = found.valid & np.isfinite(true)
    scale = np.median((true / np.where(seen, found.depth, 1))[seen])
    wrong_mm = np.abs(scale * found.depth - true)[seen].mean()
    assert wrong_mm < 1.15 * PUBLISHED_MM[name]


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.0, 1.0), st.sampled_from([None, (0.0, 0.0, 1.0, 0.9)]))
def test_any_mask_gives_finite_depth_where_it_is_valid_and_none_elsewhere(
    seed: int, share: float, plane: tuple[float, float, float, float] | None
) -> None:
    """Dust, islands, single pixels, nothing, everything: also in the first instant of a clip, and after it."""
    rng = np.random.default_rng(seed)
    size = int(rng.integers(1, 40)), int(rng.integers(1, 40))
    masks = [rng.random(size) < share, cv2.blur(rng.random(size), (5, 5)) < 0.3 + 0.4 * share]
    normals = rng.normal(size=(*size, 3)) * [0.5, 0.5, 0.3] + [0, 0, 1]
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    shaping = Shaping(view=PINHOLE if plane else View(), plane=plane)
    first = begun(shaping, surface(normals, masks[seed % 2]))
    for depth in (first.first, depth_of(first, surface(normals, masks[1 - seed % 2]))):
        assert depth is not None
        valid = masks[seed % 2] if depth is first.first else masks[1 - seed % 2]
        assert np.isfinite(depth.depth).all()
        assert not depth.depth[~valid].any()
        parts, labels = cv2.connectedComponents(valid.astype(np.uint8), connectivity=4)
        large = [number for number in range(1, parts) if (labels == number).sum() >= 64]
        assert np.array_equal(depth.depth != 0, np.isin(labels, large))
        mesh = mesh_of(surface(normals, valid), depth)
        assert np.isfinite(mesh.points).all()
        assert len(mesh.points) == 0 or mesh.triangles.max() == len(mesh.points) - 1
