"""How far a surface lies from near lights is found by how light falls off, and doubted where it does not tell."""

from dataclasses import replace

import numpy as np
import pytest
from near_room import FAR_M, MIDDLE, SIZE, Array, filmed, rays, relief, ring_rig, surface
from numpy.typing import NDArray

import psvideo as ps
from psvideo.model.irradiance.ground import ground_of
from psvideo.model.rig import Light, Rig
from psvideo.model.surface import Misfit, Surface
from psvideo.solve import near_surface
from psvideo.solve.falloff_costs import falloff_costs
from psvideo.solve.normals.illumination import illumination
from psvideo.solve.normals.lit_plates import LitPlates
from psvideo.solve.normals.plate_noise import PlateNoise
from psvideo.solve.normals.robust import huber1981
from psvideo.solve.normals.trust.near_spread import NearSpread, near_spread
from psvideo.solve.normals.trust.thin_surface import ThinSurface
from psvideo.solve.normals.trust.usual_errors import UsualErrors
from psvideo.solve.sweeping import _costs as swept_costs
from psvideo.solve.sweeping import swept
from psvideo.solve.swept_odds import RATIOS, averaged
from psvideo.solve.swept_odds import unsure_of as doubted


def room(u: Array, v: Array) -> Array:
    """A relief before a wall that leans."""
    return np.where(np.abs(u - MIDDLE) < 0.25 * SIZE, relief(u, v), 1.5 * FAR_M + 0.3 * (v - MIDDLE) / SIZE)


def test_an_outline_is_drawn_by_the_light_of_single_pixels() -> None:
    points, normals = surface(room)
    rig = ring_rig(8, 2)
    rng = np.random.default_rng(4)
    plates = [plate + rng.normal(0, 0.0003, plate.shape).astype(np.float32) for plate in filmed(rig, points, normals)]
    found = ps.solve_images(np.stack(plates), rig)
    apart = np.degrees(np.linalg.norm(found.normals - normals, axis=-1))
    from_edge = np.abs(np.abs(np.arange(SIZE) - MIDDLE) - 0.25 * SIZE)
    beside = np.broadcast_to((from_edge > 1) & (from_edge < 0.12 * SIZE), (SIZE, SIZE))
    assert np.mean(apart[beside] > 5) < 0.01, "a third, where distances are those of squares of pixels"


def ball_before_wall(u: Array, v: Array) -> Array:
    """A ball of 0.3 m before a wall."""
    ways, radius_m = rays(u, v), 0.15
    along, size = FAR_M + radius_m, (ways**2).sum(axis=-1)
    inside = along**2 - size * (along**2 - radius_m**2)
    return np.where(inside > 0, (along - np.sqrt(np.maximum(inside, 0))) / size, 1.4 * FAR_M)


@pytest.mark.parametrize("seed", range(3))
def test_the_rim_of_a_ball_that_few_lights_reach_stands_on_the_ball(seed: int) -> None:
    """Two lights or three say nothing of the rim's distance: it goes with the surface that no edge parts it from."""
    points, normals = surface(ball_before_wall)
    rig = ring_rig(5, 2)
    plates = filmed(rig, points, normals)
    reach = np.sum([plate > 0.003 for plate in plates], axis=0)
    rim = (points[..., 2] > -1.2 * FAR_M) & (reach == 3) & (normals[..., 2] > 0.25)
    rng = np.random.default_rng(seed)
    noisy = [plate + rng.normal(0, 0.001, plate.shape).astype(np.float32) for plate in plates]
    found = ps.solve_images(np.stack(noisy), rig)
    apart = np.degrees(np.linalg.norm(found.normals - normals, axis=-1))
    assert np.mean(apart[rim] > 5) < 0.05, "a quarter, where what nothing tells is as far as the wall"
    assert found.valid[rim].mean() > 0.4, "a tenth, where it is in doubt as far as that"


def test_noise_turns_normals_by_the_light_that_their_place_gets() -> None:
    rig = ring_rig(8, 2)
    depth_m = np.full((SIZE, SIZE), FAR_M, np.float32)
    depth_m[:, : SIZE // 4] = 1.6 * FAR_M
    ground = ground_of(rig, height_px=SIZE, width_px=SIZE).with_depth(depth_m)
    found = near_spread(illumination(rig.lights, channels=1, ground=ground), (SIZE, SIZE))
    rng = np.random.default_rng(6)

    def turned(row: int, col: int) -> float:
        """The typical angle that noise makes of a normal that faces the camera, tried a thousand times."""
        point = depth_m[row, col] * rays(np.array(float(col)), np.array(float(row)))
        shown = [filmed(rig, point[None], np.array([axis]), 1.0) for axis in (*np.eye(3), *-np.eye(3))]
        vectors = np.array([[float(plate[0]) for plate in plates] for plates in shown])
        lamps = (vectors[:3] - vectors[3:]).T  # what each axis is lit by from either side
        noisy = lamps[:, 2] + rng.normal(0, 1e-4, (1000, len(lamps)))
        g = noisy @ np.linalg.pinv(lamps).T
        return float(np.sqrt(np.mean((g[:, 0] ** 2 + g[:, 1] ** 2) / g[:, 2] ** 2)))

    middle, wall = (SIZE // 2, SIZE // 2), (SIZE // 2, SIZE // 10)
    predicted = np.sqrt(found.wider[wall]) / found.dim[wall] / (np.sqrt(found.wider[middle]) / found.dim[middle])
    assert predicted > 2
    assert predicted == pytest.approx(turned(*wall) / turned(*middle), rel=0.1)


@pytest.mark.parametrize("noise", [0.001, 0.003, 0.006])
def test_what_is_far_and_dim_is_in_doubt_and_never_a_confident_wrong_answer(noise: float) -> None:
    """At the most noise nothing says how far the wall is, and normals are off by nine degrees."""
    points, normals = surface(room)
    rig = ring_rig(8, 2)
    rng = np.random.default_rng(5)
    plates = [plate + rng.normal(0, noise, plate.shape).astype(np.float32) for plate in filmed(rig, points, normals)]
    found = ps.solve_images(np.stack(plates), rig)
    wall = np.broadcast_to(np.abs(np.arange(SIZE) - MIDDLE) > 0.32 * SIZE, (SIZE, SIZE))
    apart = np.degrees(np.linalg.norm(found.normals - normals, axis=-1))
    assert found.error_deg is not None
    assert np.mean(apart[wall] < found.error_deg[wall]) > 0.68
    assert np.mean(apart[found.valid] > 10) < 0.03


def test_a_distance_may_be_off_by_how_far_others_lie_that_explain_the_light_too() -> None:
    logs, shape = np.log(RATIOS)[:, None, None], (6, 8)
    wall = np.broadcast_to(np.arange(shape[1]) < shape[1] // 2, shape)
    far, reached = float(np.log(2.2)), np.ones(shape, np.bool_)
    found, nothing_told = np.where(wall, far, 0.0), np.zeros((len(RATIOS), *shape))
    either = doubted(nothing_told, 5, found, reached)
    np.testing.assert_allclose(either, np.sqrt(0.5) * far, rtol=0.25)  # half of the picture is where this is not
    assert doubted(nothing_told, 5, np.zeros(shape), reached).max() < 0.4 * either.min()
    told = (
        16 * (logs - far) ** 2 * np.ones(shape)
    )  # by a standard error of a twentieth, were five points of five lights
    doubt = doubted(told, 5, found, reached)
    np.testing.assert_allclose(doubt[wall], 0.05, rtol=0.3)
    np.testing.assert_allclose(
        doubt[~wall], far, rtol=0.05, err_msg="what was taken is wrong, however sure the light is"
    )


def test_where_a_rig_is_off_the_rest_of_the_picture_vouches_for_less_and_light_for_as_much() -> None:
    logs, shape = np.log(RATIOS)[:, None, None], (6, 8)
    found, reached, nothing_told = np.zeros(shape), np.ones(shape, np.bool_), np.zeros((len(RATIOS), *shape))
    right, off = (doubted(nothing_told, 5, found, reached, rig_is_off=is_off) for is_off in (False, True))
    np.testing.assert_array_less(1.4 * right, off)
    told = 16 * logs**2 * np.ones(shape)
    right, off = (doubted(told, 5, found, reached, rig_is_off=is_off) for is_off in (False, True))
    np.testing.assert_allclose(off, right, rtol=0.1)


def test_of_two_surfaces_that_lamps_in_a_plane_explain_alike_the_one_that_faces_the_camera_is_taken() -> None:
    """Lamps 0.33 m before a relief light its mirror image as much before them, 0.94 m from the lens, whose normals face
    away: there it was put, and normals were 57 degrees off."""
    rig = ring_rig(6, 1)
    points, normals = surface(relief)
    rng = np.random.default_rng(3)
    plates = [plate + rng.normal(0, 0.0003, plate.shape).astype(np.float32) for plate in filmed(rig, points, normals)]
    near = near_surface.near_surface_of(rig, rig.lights, height_px=SIZE, width_px=SIZE)
    assert near is not None
    off = np.abs(np.log(swept(near, rig.lights, plates).ground.depth_m / -points[..., 2]))
    assert np.percentile(off, 98) < 0.02
    found = ps.solve_images(np.stack(plates), rig)
    assert np.degrees(np.linalg.norm(found.normals - normals, axis=-1)).mean() < 0.5


@pytest.mark.parametrize("seed", range(3))
def test_what_light_hardly_tells_stands_where_most_of_the_picture_does_or_on_the_plane(seed: int) -> None:
    """A disc on the plane, 13 % of the picture, before a wall a fifth farther away."""
    v, u = np.mgrid[:SIZE, :SIZE].astype(float)
    disc = np.hypot(u - SIZE / 2, v - SIZE / 2) < 20
    deep, rng = np.where(disc, FAR_M, 1.4 * FAR_M), np.random.default_rng(seed)
    points, rig = deep[..., None] * rays(u, v), ring_rig(5, 2)
    plates = filmed(rig, points, np.broadcast_to([0.0, 0.0, 1.0], points.shape))
    noisy = [plate + rng.normal(0, 0.003, plate.shape).astype(np.float32) for plate in plates]
    near = near_surface.near_surface_of(rig, rig.lights, height_px=SIZE, width_px=SIZE)
    assert near is not None
    off = np.abs(np.log(swept(near, rig.lights, noisy).ground.depth_m / deep))
    assert off[disc].mean() < 0.03, "0.17, where the plane counts no more than any distance"
    assert off[~disc].mean() < 0.1, "0.11 to 0.2, where each point is by itself"


def test_a_wall_behind_the_subject_is_found_by_how_light_falls_off() -> None:
    points, normals = surface(room)
    rig = ring_rig(8, 2)
    rng = np.random.default_rng(4)
    plates = [plate + rng.normal(0, 0.0003, plate.shape).astype(np.float32) for plate in filmed(rig, points, normals)]
    cols = np.arange(SIZE)
    wall = np.broadcast_to(np.abs(cols - MIDDLE) > 0.32 * SIZE, (SIZE, SIZE))
    subject = np.broadcast_to(np.abs(cols - MIDDLE) < 0.2 * SIZE, (SIZE, SIZE))
    found = ps.solve_images(np.stack(plates), rig)
    apart = np.degrees(np.linalg.norm(found.normals - normals, axis=-1))
    assert np.median(apart[wall]) < 1, "on the plane they would be off by more than ten degrees"
    assert np.median(apart[subject]) < 0.3
    near = near_surface.near_surface_of(rig, rig.lights, height_px=SIZE, width_px=SIZE)
    assert near is not None
    depth_m = swept(near, rig.lights, plates).ground.depth_m
    assert np.median(np.abs(depth_m / -points[..., 2] - 1)[wall]) < 0.04
    four = swept(near, rig.lights[::2], plates[::2]).ground
    assert (four.depth_m == near.ground.depth_m).all(), "four lights do not tell distance from normal"
    assert swept(near, rig.lights[:3], plates[:3]) is near, "and three not even where it is unsure"


@pytest.mark.parametrize(("strength_off", "trusted", "wall_deg"), [(0.0, 0.9, (0, 2)), (0.02, 0.5, (8, 30))])
def test_four_near_lights_do_not_vouch_for_a_wall_behind_the_plane(
    strength_off: float, trusted: float, wall_deg: tuple[float, float]
) -> None:
    """On the plane its normals are off by some twenty degrees, and there it stays where a lamp is weaker than said. A
    subject that stands on the plane is trusted, less of it then, for it may stand elsewhere."""
    points, normals = surface(room)
    rig = ring_rig(8, 2)
    rig = replace(rig, lights=rig.lights[::2])
    rng = np.random.default_rng(4)
    plates = [plate + rng.normal(0, 0.0003, plate.shape).astype(np.float32) for plate in filmed(rig, points, normals)]
    plates[0] *= np.float32(1 + strength_off)
    found = ps.solve_images(np.stack(plates), rig)
    apart = np.degrees(np.linalg.norm(found.normals - normals, axis=-1))
    cols = np.arange(SIZE)
    wall = np.broadcast_to(np.abs(cols - MIDDLE) > 0.32 * SIZE, (SIZE, SIZE))
    subject = np.broadcast_to(np.abs(cols - MIDDLE) < 0.2 * SIZE, (SIZE, SIZE))
    assert wall_deg[0] < np.median(apart[wall]) < wall_deg[1]
    assert (found.valid & (apart > 10)).sum() < 0.03 * found.valid.sum(), "all of the wall was trusted"
    assert found.valid[subject].mean() > trusted


def test_four_near_lights_put_a_ball_that_stands_off_the_plane_and_a_wall_behind_it() -> None:
    """Both were integrated as one, and the median of all was put on the plane: the ball came too near."""
    points, normals = surface(ball_before_wall)
    rig = ring_rig(8, 2)
    rig = replace(rig, lights=rig.lights[::2])
    rng = np.random.default_rng(4)
    plates = [plate + rng.normal(0, 0.0003, plate.shape).astype(np.float32) for plate in filmed(rig, points, normals)]
    found = ps.solve_images(np.stack(plates), rig)
    apart = np.degrees(np.linalg.norm(found.normals - normals, axis=-1))
    ball = points[..., 2] > -1.2 * FAR_M
    assert np.median(apart[ball]) < 1.5, "3.5 before"
    assert np.median(apart[~ball]) < 1.5, "17 before"
    assert (apart > 10)[found.valid].mean() < 0.01
    assert found.valid[ball].mean() > 0.6, "a quarter before"


def test_one_clipped_channel_says_nothing_of_how_light_falls_off() -> None:
    """A red wall on the plane whose red clips before each lamp, where its channels' mean is half of saturation."""
    ways = [(0.5 * np.cos(a), 0.5 * np.sin(a), 0.05) for a in np.arange(6) * np.pi / 3]
    lights = tuple(Light(name=f"L{n}", position_m=at, intensity=(1.5,)) for n, at in enumerate(ways))
    rig = Rig(lights=lights, focal_px=(80.0, 80.0), principal_px=(39.5, 29.5), plane=(0.0, 0.0, 1.0, 1.0))
    x, y = np.meshgrid((np.arange(80) - 39.5) / 80, (29.5 - np.arange(60)) / 80)
    points, normal = np.stack([x, y, -np.ones_like(x)], axis=-1), np.array([0.0, 0.0, 1.0])
    grey = np.stack(filmed(rig, points, normal, albedo=1.0))
    red = np.minimum(grey[..., None] * np.array([0.9, 0.3, 0.2], np.float32), 1)
    assert (red[..., 0] == 1).mean() > 0.25
    assert red.mean(axis=-1).max() < 0.6
    found = ps.solve_images(red, rig)
    assert np.degrees(np.linalg.norm(found.normals - normal, axis=-1)).max() < 0.1
    assert found.valid.mean() > 0.7


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_distances_do_not_hang_on_the_unit_of_the_lamps_strengths(scale: float) -> None:
    """Calibration on a mirror gives every lamp a strength of 1, whatever it sends."""
    ways = [(2 * np.cos(a), 2 * np.sin(a), 0.3) for a in np.linspace(0, 2 * np.pi, 6, endpoint=False)]
    plane = (0.0, 0.0, 1.0, 1.5)
    lights = tuple(Light(name=f"l{n}", position_m=at, intensity=(scale,)) for n, at in enumerate(ways))
    rig = Rig(lights=lights, focal_px=(60.0, 60.0), principal_px=(15.5, 11.5), plane=plane)
    ground = ground_of(rig, height_px=24, width_px=32)
    x, y = (np.arange(32) - 15.5) / 60, (11.5 - np.arange(24)) / 60
    points = 2.2 * np.stack([*np.meshgrid(x, y), -np.ones((24, 32))], axis=-1)  # a wall 2.2 m away
    seen = []
    for at in ways:
        towards = np.array(at) - points
        away = np.linalg.norm(towards, axis=-1)
        seen.append(towards[..., 2] / away**3)
    light = np.stack(seen, axis=-1)
    light *= 0.5 / light.max()
    costs = falloff_costs(ground, lights, light, ground.depth_m.astype(np.float64), RATIOS,
                          at=np.ones((24, 32), np.bool_), step=1, noise=1e-3)  # fmt: skip
    best = RATIOS[np.argmin(costs.mean(axis=1))]
    assert best == pytest.approx(2.2 / 1.5, rel=0.05)
    assert costs.mean(axis=1).max() > 10 * costs.mean(axis=1).min(), "other distances do not explain it"


def test_the_error_of_a_far_wall_does_not_hang_on_what_stands_in_the_middle_of_the_picture() -> None:
    """What lights and lenses are off by is a share of the light that a place gets: as shares of albedo, whose unit is
    the middle's light, residuals of a dim wall claimed what they would of a bright one."""
    rig, far = ring_rig(6, 2), np.full((SIZE, SIZE), 1.8 * FAR_M, np.float32)
    before = far.copy()
    before[SIZE // 3 : -SIZE // 3, SIZE // 3 : -SIZE // 3] = 0.7 * FAR_M
    v, u = np.mgrid[:SIZE, :SIZE].astype(float)
    noise = PlateNoise(read=1e-8, photon=0.0)

    def claimed_deg(depth_m: NDArray[np.float32]) -> float:
        points = far.astype(float)[..., None] * rays(u, v)
        plates = filmed(rig, points, np.broadcast_to([0.0, 0.0, 1.0], points.shape))
        ground = ground_of(rig, height_px=SIZE, width_px=SIZE).with_depth(depth_m)
        found = huber1981.solve(
            LitPlates(plates, illumination(rig.lights, channels=1, ground=ground)), plate_noise=noise
        )
        assert found.error_deg is not None
        return float(np.median(found.error_deg[: SIZE // 4]))

    assert claimed_deg(before) == pytest.approx(claimed_deg(far), rel=0.02)


@pytest.mark.parametrize(("noise", "least", "most"), [(0.0003, 0.0, 0.1), (0.003, 0.3, 0.7)])
def test_a_distance_that_nobody_knows_is_not_laid_upon_a_matte_surface(noise: float, least: float, most: float) -> None:
    points, normals = surface(room)
    rig, rng = ring_rig(8, 2), np.random.default_rng(5)
    plates = [plate + rng.normal(0, noise, plate.shape).astype(np.float32) for plate in filmed(rig, points, normals)]
    found = ps.solve_images(np.stack(plates), rig).misfit
    assert found is not None
    assert least < found.distance_share + 1e-6 < most
    assert found.error_deg < 1


def test_what_is_typical_is_that_of_places_whose_distance_is_known() -> None:
    whole, none = np.ones((8, 10), np.float32), np.zeros((8, 10), np.float32)
    normals = np.broadcast_to(np.array([0, 0, 1], np.float32), (8, 10, 3))
    one = Surface(normals=normals, albedo=whole, valid=whole > 0)
    points = ThinSurface(step=1, surface=one, noise_deg=none, fit_deg=none, fit_of_noise_deg=none)
    doubt_deg, errors_deg = none.copy(), whole.copy()
    doubt_deg[:, :4], errors_deg[:, :4] = 6, 20

    def found(limit_deg: float) -> Misfit:
        near = NearSpread(dim=whole, wider=whole, doubt_deg=doubt_deg)
        usual = UsualErrors.of(points, errors_deg, none, near, most_deg=limit_deg)
        return usual.misfit(Misfit(share=0.01, error_deg=9.0))

    assert (found(5).error_deg, found(5).distance_share) == pytest.approx((1.0, 0.4))
    assert (found(7).error_deg, found(7).distance_share) == pytest.approx((0.4 * 20 + 0.6, 0.0))


def test_where_a_shadow_ends_says_little_of_the_distance_around_it() -> None:
    """Half of a light's own light is explained by no distance, and drowned what the points beside it say."""
    rig = ring_rig(6, 2)
    v, u = np.mgrid[:SIZE, :SIZE].astype(float)
    points = np.full((SIZE, SIZE, 1), 1.3 * FAR_M) * rays(u, v)
    light = np.stack(filmed(rig, points, np.broadcast_to([0.0, 0.0, 1.0], points.shape)), axis=-1).astype(np.float64)
    light[:, SIZE // 2, 0] /= 2
    ground = ground_of(rig, height_px=SIZE, width_px=SIZE)
    costs = averaged(
        *swept_costs(ground, rig.lights, light, ground.depth_m.astype(np.float64), 1, noise=1e-4, own=0.005)
    )
    beside, away = (costs[:, SIZE // 4, col].min() for col in (SIZE // 2 + 1, SIZE // 4))
    assert beside < away + 0.1
