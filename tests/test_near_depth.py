"""Under near lights depth has every surface at its own distance, as far as the lights' falloff tells it."""

from dataclasses import replace

import numpy as np
import pytest
from near_room import FAR_M, SIZE, Array, filmed, rays, relief, ring_rig, surface
from numpy.typing import NDArray

import psvideo as ps
from psvideo.model.rig import Rig
from psvideo.model.surface import Distances, Surface
from psvideo.solve.depth import Depth, Shaping, View, begun, depth_of, mesh_of, reservations, scale_note, view_of
from psvideo.solve.depth.cao2022 import BILATERAL, integrate, laid_together
from psvideo.solve.depth.falloff_evidence import SHIFTS, DistanceEvidence, evidence_of
from psvideo.solve.depth.placing import placed_by, stays
from psvideo.solve.depth.torn_surfaces import pieces_of, surfaces_of

WALL_M, RADIUS_M = 1.5 * FAR_M, 0.11


def ball_before_wall(nearer_m: float = 0.0, aside_m: float = 0.0) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Points, normals, and where the ball is, whose nearest point stands on the plane, or nearer, or aside."""
    middle = np.array([aside_m, 0.0, nearer_m - FAR_M - RADIUS_M])

    def depth(u: Array, v: Array) -> Array:
        ways = rays(u, v)
        along, size = ways @ middle, (ways**2).sum(axis=-1)
        inside = along**2 - size * (middle @ middle - RADIUS_M**2)
        return np.where(inside > 0, (along - np.sqrt(np.maximum(inside, 0))) / size, WALL_M)

    points, normals = surface(depth)
    return points, normals, -points[..., 2] < WALL_M - 0.1


def solved(rig: Rig, points: Array, normals: Array, seed: int = 0, thought: Rig | None = None) -> Surface:
    rng = np.random.default_rng(seed)
    plates = [plate + rng.normal(0, 0.0003, plate.shape).astype(np.float32) for plate in filmed(rig, points, normals)]
    return ps.solve_images(np.stack(plates), thought or rig)


def off_by(depth: Depth, points: Array, where: NDArray[np.bool_]) -> float:
    """The median error of depth, as a share."""
    some = where & depth.valid
    assert some.sum() > 0.9 * where.sum()
    return float(np.median(depth.depth[some] / -points[..., 2][some] - 1))


@pytest.mark.parametrize("lights", [5, 8])
def test_a_subject_and_the_wall_behind_it_come_at_their_own_distances(lights: int) -> None:
    points, normals, ball = ball_before_wall()
    rig = ring_rig(lights, 2)
    found = solved(rig, points, normals)
    depth = ps.find_depth(found, rig)
    assert abs(off_by(depth, points, ball)) < 0.02
    assert abs(off_by(depth, points, ~ball)) < 0.03, "a third, on the plane"
    mesh = mesh_of(found, depth)
    spans = np.ptp(-mesh.points[mesh.triangles][..., 2], axis=1)
    assert spans.max() < 0.5 * (WALL_M - FAR_M), "no wall of triangles from one to the other"
    said = sorted((part for part in depth.placed if part.share > 0.1), key=lambda part: part.distance_m)
    true_m = [np.median(-points[where, 2]) for where in (ball, ~ball)]
    np.testing.assert_allclose([part.distance_m for part in said], true_m, rtol=0.05)
    assert all(abs(part.distance_m / m - 1) < part.unsure < 0.3 for part, m in zip(said, true_m, strict=True))


def test_what_stands_on_the_plane_has_the_depth_that_it_had_to_the_bit() -> None:
    points, normals = surface(relief)
    for rig in (ring_rig(4, 2), ring_rig(8, 2)):
        found = solved(rig, points, normals)
        assert found.distances is None
        assert not ps.find_depth(found, rig).placed


def test_depth_that_is_given_comes_before_falloff() -> None:
    points, normals, _ = ball_before_wall()
    rig = ring_rig(8, 2)
    found = solved(rig, points, normals)
    given = np.full((SIZE, SIZE), 3.0, np.float32)
    shaping = Shaping(view=view_of(rig), plane=rig.plane, known_m=given)
    np.testing.assert_array_equal(
        depth_of(shaping, found).depth, depth_of(shaping, replace(found, distances=None)).depth
    )


def a_little_off(rig: Rig, seed: int) -> Rig:
    """Lamps that are 2 % weaker or stronger, and 3 mm beside."""
    rng = np.random.default_rng(seed)
    lights = (
        replace(
            light,
            position_m=tuple(np.array(light.position_m) + rng.normal(0, 0.003 / np.sqrt(3), 3)),
            intensity=(light.intensity[0] * (1 + 0.02 * rng.standard_normal()),),
        )
        for light in rig.lights
    )
    return replace(rig, lights=tuple(lights))


@pytest.mark.parametrize("seed", range(3))
def test_lamps_that_are_off_leave_a_subject_where_it_stands_and_a_wall_in_doubt(seed: int) -> None:
    """Lamps are 2 % weaker or stronger, and 3 mm beside where they are thought to be."""
    points, normals, ball = ball_before_wall()
    rig = ring_rig(8, 2)
    found = solved(a_little_off(rig, seed), points, normals, thought=rig)
    depth, on_plane = ps.find_depth(found, rig), ps.find_depth(replace(found, distances=None), rig)
    assert abs(off_by(depth, points, ball)) < abs(off_by(on_plane, points, ball)) + 0.04
    largest = max(depth.placed, key=lambda part: part.share)
    assert abs(np.log1p(off_by(depth, points, ~ball))) < 2 * largest.unsure


@pytest.mark.parametrize("seed", range(2))
def test_what_lamps_that_are_off_put_elsewhere_is_not_trusted(seed: int) -> None:
    """A ball was 11 degrees off, and half to three quarters of what was trusted by more than 10."""
    points, normals, ball = ball_before_wall()
    rig = ring_rig(8, 2)
    found = solved(a_little_off(rig, seed), points, normals, thought=rig)
    apart = np.degrees(np.linalg.norm(found.normals - normals, axis=-1))
    assert apart[ball].mean() < 4
    assert found.valid[ball].mean() > 0.15
    assert np.mean(apart[found.valid] > 10) < 0.03
    assert found.error_deg is not None
    assert np.mean(apart[ball] < 2 * found.error_deg[ball]) > 0.9


def test_depth_rests_with_its_subject_and_follows_it() -> None:
    rig = ring_rig(8, 2)
    shaping = Shaping(view=view_of(rig), plane=rig.plane)
    points, normals, ball = ball_before_wall()
    shaping = begun(shaping, solved(rig, points, normals))
    assert shaping.first is not None
    rests = depth_of(shaping, solved(rig, points, normals, seed=1))
    both = rests.valid & shaping.first.valid & ball
    assert np.median(np.abs(rests.depth / shaping.first.depth - 1)[both]) < 1e-3
    for nearer_m in (0.06, 0.12):
        points, normals, ball = ball_before_wall(nearer_m)
        comes = depth_of(shaping, solved(rig, points, normals))
        assert abs(off_by(comes, points, ball)) < 0.02, "by as much as it came nearer, 4 and 8 %, where it stays"
        assert abs(off_by(comes, points, ~ball)) < 0.03
    points, normals, ball = ball_before_wall(aside_m=0.09)
    aside = depth_of(shaping, solved(rig, points, normals))
    assert abs(off_by(aside, points, ball)) < 0.02, "and not at the wall, which most of it covers now"


def quadratic(best: Array, sharp: float) -> Distances:
    """Costs (ratio, row, col) with their least at the logarithm ``best`` of the distance over a plane at 1 m."""
    logs = np.log(np.geomspace(0.5, 2.5, 25))
    costs = 0.05 + sharp * (logs[:, None, None] - best) ** 2
    ones = np.ones(best.shape, np.float32)
    return Distances(
        depth_m=np.exp(best).astype(np.float32), step=1, costs=costs.astype(np.float32), weight=ones, plane_m=ones,
        logs=logs, each=1,
    )  # fmt: skip


def test_a_part_stands_where_all_of_its_points_are_explained_and_on_the_plane_where_none_says_more() -> None:
    shape, noise = (12, 15), np.random.default_rng(1).normal(0, 0.3, (12, 15))
    flat, every = np.zeros(shape), np.ones(shape, np.bool_)
    told = evidence_of(quadratic(0.5 + noise, 8.0), flat, every)
    assert told.shift == pytest.approx(0.5, abs=0.05), "points are off by a third each, together they are not"
    assert told.unsure < 0.1
    tilted = np.linspace(-0.2, 0.2, 15) * np.ones((12, 1))
    assert evidence_of(quadratic(0.5 + tilted, 8.0), tilted, every).shift == pytest.approx(0.5, abs=0.02)
    nothing = evidence_of(quadratic(0.5 + flat, 0.01), flat, every)
    assert abs(nothing.shift) < 0.05
    assert nothing.unsure > 0.3
    few = DistanceEvidence(cost=told.cost[: len(SHIFTS)] / 1e3, weight=told.weight / 1e3)
    assert not few.told
    assert few.shift == pytest.approx(0, abs=1e-6)


def test_a_wall_that_shadows_tear_is_one_and_a_ball_before_it_another() -> None:
    """Three regions of distances: the ball's, the wall's, and a shadow's that is 30 % off and says little."""
    row, col = np.mgrid[:48, :64]
    ball, shadow = np.hypot(row - 24, col - 22) < 12, np.hypot(row - 24, col - 50) < 9
    best = np.where(ball, 0.0, 0.5)
    told = quadratic(best, 8.0)
    weak = (0.4 + 0.1 * (told.logs[:, None, None] - 0.2) ** 2).astype(np.float32)
    drawn = np.where(shadow, np.float32(np.exp(0.2)), told.depth_m)
    found = replace(told, depth_m=drawn, costs=np.where(shadow, weak, told.costs))
    pieces = pieces_of(found)
    assert pieces.max() == 2
    surfaces = surfaces_of(pieces, np.ones_like(ball), found, np.zeros(ball.shape))
    np.testing.assert_array_equal(surfaces == surfaces[24, 22], ball)
    assert surfaces.max() == 1


def test_layers_that_are_laid_together_are_cut_between_and_keep_their_heights() -> None:
    shape = (20, 30)
    normals = np.zeros((*shape, 3), np.float32)
    normals[...] = np.sqrt(0.5) * np.array([1, 0, 1])
    left = np.arange(30) < np.full((20, 1), 13)
    view = ps.find_depth(Surface(normals=normals, albedo=np.ones(shape, np.float32), valid=np.ones(shape, bool))).view
    one, other = (integrate(normals, layer, view, how=BILATERAL) for layer in (left, ~left))
    expected = np.where(left, one.height, other.height)
    both = laid_together([one, other])
    np.testing.assert_array_equal(both.height, expected)
    assert both.valid.all()
    assert both.cut_east[:, 12].all()
    assert both.cut_east.sum() == 20
    assert not both.cut_south.any()


def test_what_is_said_of_distances_is_how_sure_they_are() -> None:
    points, normals, _ = ball_before_wall()
    rig = ring_rig(8, 2)
    assert "before or behind" in scale_note(Shaping(view=view_of(rig), plane=rig.plane))
    shaping = begun(Shaping(view=view_of(rig), plane=rig.plane), solved(rig, points, normals))
    assert shaping.first is not None
    sure = tuple(replace(part, unsure=0.02) for part in shaping.first.placed)
    unsure = tuple(replace(part, unsure=0.25) for part in sure)
    known, doubted = (replace(shaping, first=replace(shaping.first, placed=placed)) for placed in (sure, unsure))
    assert "near lights fall off" in scale_note(known)
    for part in sure:
        assert f"{part.distance_m:.3g} m away, to about 2 %" in scale_note(known)
    assert not reservations(known)
    assert "hardly tells" in reservations(doubted)[0]
    assert "25 %" in scale_note(doubted)
    guessed = tuple(replace(part, unsure=0.5) for part in unsure)
    assert "where the rig's plane is" in scale_note(replace(shaping, first=replace(shaping.first, placed=guessed)))


def test_what_differs_by_little_is_at_rest_and_what_is_hardly_known_stays_on_the_plane() -> None:
    shape, focal_px = (12, 15), 100.0
    height, view = np.zeros(shape), View(focal_px=(focal_px, focal_px), principal_px=(7.0, 5.5))
    told = quadratic(np.full(shape, 0.5), 8.0)

    def placed(distances: Distances, before: float | None) -> float:
        before_m = None if before is None else np.full(shape, np.exp(before), np.float32)
        shift, _ = placed_by(distances, height, lambda box: np.ones(shape, np.bool_)[box], view, before_m)
        return shift / focal_px

    assert placed(told, None) == pytest.approx(0.5, abs=0.01)
    assert placed(told, placed(told, None) + 0.003) == pytest.approx(placed(told, None) + 0.003, abs=1e-4)
    assert placed(told, 0.57) == pytest.approx(0.5, abs=0.01), "7 % is more than the sweep is off from round to round"
    either = 0.05 + 8 * np.minimum((told.logs - 0.5) ** 2, (told.logs + 0.5) ** 2)
    costs = np.broadcast_to(either[:, None, None], told.costs.shape).astype(np.float32)
    assert placed(replace(told, costs=costs), None) == pytest.approx(0.0, abs=1e-6)
    assert stays(told, np.full(shape, np.exp(0.503), np.float32)).all()
    assert not stays(told, np.full(shape, np.exp(0.7), np.float32)).any()
