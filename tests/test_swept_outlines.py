"""Beside an edge a pixel stands on the surface that its own light tells, or on that which no edge parts it from."""

from dataclasses import replace

import numpy as np
import pytest
from near_room import FAR_M, SIZE, Array, filmed, rays, ring_rig
from numpy.typing import NDArray

from psvideo.model.irradiance.ground import Ground, ground_of
from psvideo.model.rig import Rig
from psvideo.solve.near_surface import NearSurface, _held_by_parts, near_surface_of
from psvideo.solve.sweeping import swept
from psvideo.solve.swept_outlines import outlined

RIG = ring_rig(5, 2)
WALL_M, NOISE = 1.4 * FAR_M, 0.001
COLUMN = np.arange(SIZE)
LEFT, STRIP = slice(0, 40), slice(40, 56)
Plane = NDArray[np.float32]


def a_ground(rig: Rig = RIG) -> Ground:
    return ground_of(rig, height_px=SIZE, width_px=SIZE)


def light_of(depth_m: float) -> Array:
    """What a wall at one depth sends to the camera under every lamp, (row, col, light)."""
    v, u = np.mgrid[:SIZE, :SIZE].astype(float)
    points = depth_m * rays(u, v)
    return np.stack(filmed(RIG, points, np.broadcast_to([0.0, 0.0, 1.0], points.shape)), axis=-1).astype(np.float64)


def drawn(light: Array, known: NDArray[np.bool_], unsure: float = 0.02) -> tuple[Plane, Plane, Plane]:
    """A subject on the left and a wall on the right, and a strip between them where either may be."""
    near_m = np.where(COLUMN < 56, FAR_M, WALL_M).astype(np.float32)
    far_m = np.where(COLUMN < 40, FAR_M, WALL_M).astype(np.float32)
    sides = tuple(np.broadcast_to(side, (SIZE, SIZE)).copy() for side in (near_m, far_m))
    unsure_of = np.full((SIZE, SIZE), unsure, np.float32)
    return outlined(
        a_ground(), RIG.lights, light, (sides[0], sides[1]), step=1, noise=NOISE, known=known, unsure=unsure_of
    )


def columns(known: slice | None = None, *others: slice) -> NDArray[np.bool_]:
    where = np.zeros((SIZE, SIZE), np.bool_)
    for one in (known, *others):
        if one is not None:
            where[:, one] = True
    return where


def test_what_few_lights_reach_stands_on_the_only_surface_that_no_edge_parts_it_from() -> None:
    """Three lamps, or four of five: however well the light of four would fit the wall."""
    for dark in ([3, 4], [4]):
        light = light_of(WALL_M)
        light[..., dark] = 0
        depth_m, _, torn = drawn(light, columns(LEFT, STRIP))
        np.testing.assert_array_equal(depth_m[:, STRIP], np.float32(FAR_M))
        assert torn[:, STRIP].max() < 0.1


def test_what_a_pixel_shows_itself_counts_against_the_nearest_surface() -> None:
    depth_m, *_ = drawn(light_of(WALL_M), columns(LEFT, slice(56, SIZE)))
    assert np.mean(depth_m[:, STRIP] == np.float32(WALL_M)) > 0.7, "a half, by ways alone"


@pytest.mark.parametrize("plane_m", [FAR_M, WALL_M])
def test_where_light_tells_nothing_it_is_the_side_that_is_nearer_to_the_plane(plane_m: float) -> None:
    ground, none = a_ground(ring_rig(5, 2, plane_m=plane_m)), columns()
    sides = tuple(np.full((SIZE, SIZE), side, np.float32) for side in (FAR_M, WALL_M))
    unsure = np.full((SIZE, SIZE), 0.02, np.float32)
    dark = np.zeros((SIZE, SIZE, 5))
    depth_m, _, torn = outlined(
        ground, RIG.lights, dark, (sides[0], sides[1]), step=1, noise=NOISE, known=none, unsure=unsure
    )
    np.testing.assert_array_equal(depth_m, np.float32(plane_m))
    np.testing.assert_allclose(torn, np.log(WALL_M / FAR_M) / 2, rtol=1e-5, err_msg="and that makes nothing surer")


def test_what_is_reached_across_strong_edges_only_keeps_its_doubt() -> None:
    light = light_of(FAR_M)
    light[:, 20:, 3:] = 0
    light[:, 30:, :3] *= (4.0, 0.2, 3.0)
    _, _, torn = drawn(light, columns(slice(0, 24)), unsure=0.4)
    assert torn[:, 24:29].max() < 0.1
    assert torn[:, 30:40].min() > 0.2


def test_distances_are_as_unsure_as_those_of_their_part_and_as_a_pixel_that_may_belong_to_another() -> None:
    unsure, torn = np.full((SIZE, SIZE), 0.02, np.float32), np.zeros((SIZE, SIZE), np.float32)
    unsure[:10], torn[:5] = 0.3, 0.1
    depth_m = np.full((SIZE, SIZE), FAR_M, np.float32)
    depth_m[:, :10] = 0
    near = near_surface_of(RIG, RIG.lights, height_px=SIZE, width_px=SIZE)
    assert near is not None
    held = _held_by_parts(replace(near.ground, unsure=unsure), depth_m, replace(near, torn=torn)).unsure
    assert held is not None
    np.testing.assert_array_equal(held[10:], np.float32(0.02))
    np.testing.assert_allclose(held[5:10, 10:], 0.03, rtol=1e-5)
    np.testing.assert_allclose(held[:5, 10:], 0.1, rtol=1e-5)
    np.testing.assert_allclose(held[:5, :10], 0.3, rtol=1e-5, err_msg="where no depth was integrated")


def test_a_distance_is_never_surer_than_to_which_surface_it_belongs() -> None:
    v, u = np.mgrid[:SIZE, :SIZE].astype(float)
    deep = np.where(np.hypot(u - SIZE / 2, v - SIZE / 2) < 20, FAR_M, WALL_M)
    points = deep[..., None] * rays(u, v)
    rng = np.random.default_rng(3)
    plates = filmed(RIG, points, np.broadcast_to([0.0, 0.0, 1.0], points.shape))
    plates = [plate + rng.normal(0, 0.001, plate.shape).astype(np.float32) for plate in plates]
    near = near_surface_of(RIG, RIG.lights, height_px=SIZE, width_px=SIZE)
    assert near is not None
    found: NearSurface = swept(near, RIG.lights, plates)
    assert found.torn is not None
    assert found.ground.unsure is not None
    assert found.torn.max() > 0.05
    assert np.all(found.ground.unsure >= found.torn)
    assert np.any(found.torn > 1.01 * np.median(found.ground.unsure))
