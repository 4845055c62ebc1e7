"""Along a body's true motion and depth one surface explains the plates of all lights; a motion or a depth that is off
is brought back by what is left."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from turning_ball import RADIUS_PX, SHAPE, TURN, UNITS, ball, pairs, surface_of, turned

from psvideo.model.arrays import Doubles, Floats
from psvideo.model.irradiance.ground import Ground
from psvideo.model.rig import Light
from psvideo.plates.align.by_surface import CLIPPED, LEAST_LIT
from psvideo.plates.align.plate_lamps import Lamps
from psvideo.plates.align.rigid import joint_fit
from psvideo.plates.align.rigid.along_kernel import PLANES, UNLIKE
from psvideo.plates.align.rigid.along_motion import AlongMotion, InPicture, left_of
from psvideo.plates.align.rigid.depth_blocks import DepthBlocks
from psvideo.plates.align.rigid.joint_fit import MovingPoints, fitted_together
from psvideo.plates.align.rigid.left_along import LeftAlong
from psvideo.plates.align.rigid.moving_parts import MovingPart
from psvideo.plates.align.rigid.near_plates import NearPlates
from psvideo.plates.align.rigid.plates_seen import PlatesSeen
from psvideo.plates.align.rigid.rigid_motion import BodyPoints, RigidMotion
from psvideo.plates.align.rigid.surface_fit import motion_of_surface
from psvideo.plates.align.rigid.with_bodies import SMOOTH_PX
from psvideo.plates.align.velocity.all_lights import AllLights
from psvideo.plates.align.velocity.followed import Followed

TRUE = RigidMotion(numbers=np.array([0.0, 0.0, *TURN, 0.0]))
NEAR_M = 0.75
"""Six of the ball's radii."""


def some_plates(rng: np.random.Generator, count: int = 7) -> PlatesSeen:
    """Pictures of any light, among them much that is dark or clipped."""
    pictures = rng.uniform(-0.02, 1.02, (count, 9, 11, 3)).astype(np.float32)
    return PlatesSeen(pictures=pictures, spans_s=rng.uniform(-1, 1, count), lamps=rng.normal(size=(count, 3)))


def shown(picture: Floats, row: float, col: float) -> Doubles:
    """What a picture shows between its pixels, or at its border."""
    row, col = float(np.clip(row, 0, picture.shape[0] - 1)), float(np.clip(col, 0, picture.shape[1] - 1))
    top, left = min(int(row), picture.shape[0] - 2), min(int(col), picture.shape[1] - 2)
    down, across = row - top, col - left
    rows = picture[top : top + 2].astype(np.float64)
    lines = rows[:, left] * (1 - across) + rows[:, left + 1] * across
    return np.asarray(lines[0] * (1 - down) + lines[1] * down)


def left_by_lstsq(lamps: Doubles, light: Doubles) -> Doubles:
    """What no normal explains of light, (plate,) or (plate, ...)."""
    return np.asarray(light - lamps @ np.linalg.lstsq(lamps, light, rcond=None)[0])


@pytest.mark.parametrize("seed", range(6))
def test_the_loop_leaves_what_least_squares_leave_of_plates_that_are_lit(seed: int) -> None:
    rng = np.random.default_rng(seed)
    plates, spin = some_plates(rng), rng.normal(size=3)
    lamps = plates.turned(RigidMotion(numbers=np.array([0, 0, *spin, 0.0])))
    places = np.concatenate([rng.uniform(-1, 11, (2, 40)), rng.normal(0, 3, (4, 40)), np.zeros((1, 40))])
    places = places.astype(np.float32)
    told = np.empty((PLANES, 7, 40), np.float32)
    left, beyond = left_of(plates, lamps, places, told)
    asked = 0
    for point, (col, row, *ways) in enumerate(places[:6].T):
        velocity, bend = np.array(ways[:2]), np.array(ways[2:])
        at = [np.array([col, row]) - span_s * velocity + span_s**2 / 2 * bend for span_s in plates.spans_s]
        light = np.array([shown(picture, y, x) for picture, (x, y) in zip(plates.pictures, at, strict=True)])
        lit = (light[:, 0] > LEAST_LIT) & (light[:, 0] < CLIPPED)
        assert beyond[point] == max(lit.sum() - 3, 0)
        if lit.sum() < 5:
            continue
        asked += 1
        own, mean = lamps[lit, 1:].astype(np.float64), light[lit, 0].mean()
        rest = left_by_lstsq(own, light[lit, 0]) / mean
        square = np.square(rest).sum() / (lit.sum() - 3)
        assert left[point] == pytest.approx(square / (square + UNLIKE**2), rel=0.02, abs=1e-3)
        scale = 0.02 * np.abs(told[:, :, point]).max() + 1e-3
        np.testing.assert_allclose(told[0, lit, point], rest, atol=scale)
        slopes = left_by_lstsq(own, -plates.spans_s[lit, None] * light[lit, 1:]) / mean
        np.testing.assert_allclose(told[1:3, lit, point].T, slopes, atol=scale)
        assert not told[:, ~lit, point].any(), "what is dark or clipped tells nothing"
    assert asked >= 10


SLANTED = Ground(
    depth_m=1.1 + np.outer(np.linspace(-0.1, 0.15, 18), np.ones(22)).astype(np.float32),
    middle_m=np.array([0.04, -0.02, -1.1]),
    focal_px=(40.0, 40.0),
    principal_px=(10.0, 9.0),
)
"""A slanted plane in a picture of 18 x 22 pixels; plates have half as many."""


def mixed_lights(rng: np.random.Generator) -> list[Light]:
    """A distant light, and four near ones, two of which shine in cones."""
    around = 2 * np.pi * (np.arange(4) + rng.uniform(-0.2, 0.2, 4)) / 4
    lights = [Light(name="l0", direction=(0.36, -0.48, 0.8), intensity=(0.7,))]
    for n, (x, y) in enumerate(zip(0.6 * np.cos(around), 0.5 * np.sin(around), strict=True)):
        place, down = (float(x), float(y), float(rng.uniform(-0.6, -0.3))), np.array([-x, -y, -0.9])
        light = Light(name=f"l{n + 1}", position_m=place, intensity=(float(rng.uniform(0.5, 2)),))
        axis = down / np.linalg.norm(down)
        cone = replace(light, axis=(float(axis[0]), float(axis[1]), float(axis[2])), anisotropy=1.5 + n)
        lights.append(cone if n < 2 else light)
    return lights


def sent_to(light: Light, point_m: Doubles) -> Doubles:
    """What a light sends to a point, along right, down and near."""
    strength, flip = float(light.by_channel[0]), np.array([1, -1, 1])
    if light.position_m is None:
        return np.asarray(strength * np.array(light.direction) * flip)
    away_m = np.array(light.position_m) - point_m
    far_m = np.linalg.norm(away_m)
    cone = 1.0 if light.axis is None else max(-away_m @ np.array(light.axis) / far_m, 0) ** float(light.anisotropy or 0)
    return np.asarray(strength * cone * away_m / far_m**3 * flip)


@pytest.mark.parametrize("seed", range(4))
def test_near_lamps_light_every_point_from_where_they_stand(seed: int) -> None:
    rng = np.random.default_rng(seed)
    lights, which = mixed_lights(rng), [0, 0, 1, 2, 3, 3, 4]
    lamps = Lamps.of(lights, [light.name for light in lights], SLANTED)
    assert lamps is not None
    near = NearPlates.of(lamps, lamps.matrix, which, (9, 11))
    given = replace(some_plates(rng), lamps=lamps.matrix[which] * [1, -1, 1], near=near)
    plates = replace(given, pictures=rng.uniform(0.1, 0.9, given.pictures.shape).astype(np.float32))
    spin, rows, cols = rng.normal(0, 0.5, 3), rng.integers(0, 9, 30), rng.integers(0, 11, 30)
    velocity, rises = rng.normal(0, 2, (2, 30)), rng.normal(0, 1, 30).astype(np.float32)
    places = np.stack([cols, rows, *velocity, *np.zeros((2, 30)), plates.above(rises, (rows, cols))])
    told, metres_per_px = np.empty((PLANES, 7, 30), np.float32), 1.1 / 20
    left_of(plates, plates.turned(RigidMotion(numbers=np.array([0, 0, *spin, 0.0]))), places, told)
    depth_m = SLANTED.depth_m.reshape(9, 2, 11, 2).mean(axis=(1, 3))[rows, cols] - rises * metres_per_px
    for point in range(30):
        light, own = [], []
        for picture, span_s, number in zip(plates.pictures, plates.spans_s, which, strict=True):
            x, y = np.array([cols[point], rows[point]]) - span_s * velocity[:, point]
            point_m = depth_m[point] * np.array([(x - 4.75) / 20, -(y - 4.25) / 20, -1])
            light.append(shown(picture, y, x)[0])
            own.append(turned(sent_to(lights[number], point_m)[None], spin, span_s)[0])
        rest = left_by_lstsq(np.array(own), np.array(light)) / np.mean(light)
        np.testing.assert_allclose(told[0, :, point], rest, atol=0.02 * np.abs(rest).max() + 1e-3)


def test_of_distant_lights_none_is_near() -> None:
    seen = pairs()
    assert seen_plates(TURN)[1].near is None
    assert seen_plates(TURN)[1].at_rest.shape == (2 * len(seen), 4)
    assert seen_plates(TURN, lamps_m=NEAR_M)[1].at_rest.shape == (2 * len(seen), 24)


numbers = arrays(np.float64, 3, elements=st.floats(-1, 1))


@settings(deadline=None)
@given(normal=numbers, lamp=numbers, spin=numbers, span_s=st.floats(-1, 1))
def test_a_lamp_that_turns_along_lights_the_normal_at_the_instant_as_it_did_the_one_before(
    normal: Doubles, lamp: Doubles, spin: Doubles, span_s: float
) -> None:
    none = np.zeros((1, 2, 2, 3), np.float32)
    plates = PlatesSeen(pictures=none, spans_s=np.array([span_s]), lamps=lamp[None])
    turned_lamp = plates.turned(RigidMotion(numbers=np.array([0, 0, *spin, 0.0])))[0]
    assert turned_lamp[0] == np.float32(span_s)
    before = turned(normal[None], spin, -span_s)[0]
    assert turned_lamp[1:] @ normal == pytest.approx(float(lamp @ before), abs=1e-5)


@pytest.mark.parametrize("axis", range(3))
def test_what_is_left_grows_with_the_turn_as_the_loop_tells(axis: int) -> None:
    """Plates are even here, so that nothing but lights' turning along changes what is left."""
    rng, by = np.random.default_rng(7), 1e-3
    spin = RigidMotion(numbers=np.zeros(6))
    spans_s, lamps = rng.uniform(-1, 1, 8), rng.normal([0, 0, 2], 0.6, (8, 3))
    none = PlatesSeen(pictures=np.zeros((8, 4, 4, 3), np.float32), spans_s=spans_s, lamps=lamps)
    light = none.turned(spin)[:, 1:] @ np.array([0.05, -0.08, 0.2])
    assert ((light > LEAST_LIT) & (light < CLIPPED)).all()
    pictures = np.zeros_like(none.pictures)
    pictures[..., 0] = light[:, None, None]
    plates, place = replace(none, pictures=pictures), np.array([[1, 1, 0, 0, 0, 0, 0]], np.float32).T
    told = [np.empty((PLANES, 8, 1), np.float32) for _ in range(3)]
    turns = np.zeros(6)
    turns[2 + axis] = by
    for each, motion in zip(told, (spin, spin.changed(turns), spin.changed(-turns)), strict=True):
        left_of(plates, plates.turned(motion), place, each)
    grows = (told[1][0] - told[2][0]) / (2 * by)
    np.testing.assert_allclose(told[0][3 + axis], grows, atol=0.05 * np.abs(grows).max())


@pytest.fixture(scope="module")
def turning() -> tuple[AllLights, PlatesSeen]:
    """The plates of a ball that turns by 17 degrees in a round."""
    return seen_plates(TURN)


def seen_plates(spin: Doubles, smooth_px: float = 1.5, *, lamps_m: float | None = None) -> tuple[AllLights, PlatesSeen]:
    """The plates of a ball that turns, under distant lights or some so near."""
    seen = pairs(spin, lamps_m=lamps_m)
    lights = AllLights.of([*seen.values()], 0.0)
    return lights, PlatesSeen.of(surface_of(seen, lamps_m=lamps_m), lights, smooth_px)


def body_part() -> MovingPart:
    """The middle of the ball, of which all lights show something."""
    _, points = ball()
    found = points[..., 2] > 0.6
    return MovingPart(found=found, within=found, about=found)


def true_points(part: MovingPart, deep: float = 1.0) -> BodyPoints:
    """The ball's points, or those of a flatter one."""
    _, points = ball()
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]].astype(np.float32)
    middle = np.float32((SHAPE[1] - 1) / 2), np.float32((SHAPE[0] - 1) / 2)
    near = deep * RADIUS_PX * np.where(part.about, points[..., 2], 0)
    return BodyPoints(right=x - middle[0], down=y - middle[1], near=np.asarray(near, np.float32))


def left_along(motion: RigidMotion, points: BodyPoints, part: MovingPart, plates: PlatesSeen) -> float:
    """The mean share that is left on a part."""
    return AlongMotion.of(motion, InPicture.of(points, *np.nonzero(part.found)), plates).share


def test_the_true_motion_leaves_next_to_nothing_and_a_twentieth_off_leaves_more(
    turning: tuple[AllLights, PlatesSeen],
) -> None:
    part = body_part()
    points = true_points(part)
    least = left_along(TRUE, points, part, turning[1])
    assert least < 0.03
    for number in range(5):
        by = np.zeros(6)
        by[number] = 1.0 if number < 2 else 1.0 / RADIUS_PX
        for other in (TRUE.changed(by), TRUE.changed(-by)):
            assert left_along(other, points, part, turning[1]) > 1.5 * least, f"number {number}, off by a pixel"


@pytest.mark.parametrize("smooth_px", SMOOTH_PX)
def test_so_it_does_under_near_lights_which_distant_ones_do_not_explain(smooth_px: float) -> None:
    part, (_, plates) = body_part(), seen_plates(TURN, smooth_px, lamps_m=NEAR_M)
    points = true_points(part)
    least = left_along(TRUE, points, part, plates)
    assert least < 0.05
    assert left_along(TRUE, points, part, replace(plates, near=None)) > 3 * least


@pytest.mark.parametrize("number", range(5))
def test_one_step_leads_most_of_the_way_back_of_one_number(turning: tuple[AllLights, PlatesSeen], number: int) -> None:
    part, by = body_part(), np.zeros(6)
    by[number] = 0.3
    seen = InPicture.of(true_points(part), *np.nonzero(part.found))
    left = AlongMotion.of(TRUE.changed(by * UNITS), seen, turning[1])
    squares, pull = left.equations(seen.points.per_number(), UNITS)
    assert np.linalg.solve(squares, pull)[number] == pytest.approx(-0.3, abs=0.12)


def test_a_motion_that_is_pixels_off_is_brought_back_to_a_tenth(turning: tuple[AllLights, PlatesSeen]) -> None:
    part = body_part()
    rows, cols = np.nonzero(part.found)
    seen = InPicture.of(true_points(part), rows[::5], cols[::5])
    start = TRUE.changed(UNITS * [1.5, -1.5, 1, -2, 1.5, 0.5])
    found = motion_of_surface(start, seen, turning[1], UNITS)
    off = (found.velocity(seen.points) - TRUE.velocity(seen.points), start.velocity(seen.points))
    assert np.hypot(*(off[1] - TRUE.velocity(seen.points))).mean() > 1.5
    assert np.hypot(*off[0]).mean() < 0.15


def moving(points: BodyPoints, motion: RigidMotion, part: MovingPart) -> MovingPoints:
    return MovingPoints(points=points, motion=motion, blocks=DepthBlocks.of(part.about, points.near))


@pytest.mark.parametrize("deep", [0.6, 1.3])
@pytest.mark.parametrize("spin", [TURN, np.radians([15.0, 3.0, 4.0])], ids=["about down", "about right"])
def test_depth_and_motion_that_are_wrong_are_brought_back_together(deep: float, spin: Doubles) -> None:
    part, true = body_part(), RigidMotion(numbers=np.array([0.0, 0.0, *spin, 0.0]))
    near = true_points(part).near
    start = moving(true_points(part, deep), true.changed(UNITS * [1, -0.7, 1.5, -1, 0.5, 0.5]), part)
    found = start
    for smooth_px in SMOOTH_PX:
        found = fitted_together(found, part, seen_plates(spin, smooth_px)[1], UNITS)

    def off_px(one: MovingPoints) -> float:
        true_way = true.velocity(replace(one.points, near=near))
        return float(np.hypot(*(one.motion.velocity(one.points) - true_way)[:, part.found]).mean())

    def relief_off_px(one: MovingPoints) -> float:
        return float((one.points.near - near)[part.found].std())

    assert off_px(start) > 1.5
    assert off_px(found) < 0.3
    assert relief_off_px(found) < 0.7 * relief_off_px(start)
    np.testing.assert_allclose(found.motion.numbers[2:5] / UNITS[2:5], true.numbers[2:5] / UNITS[2:5], atol=1.0)
    assert np.abs(found.blocks.off_px).mean() > 0.1, "it is kept, for pictures that are less smooth"


def test_a_step_of_motion_and_depth_is_that_of_all_unknowns_at_once(turning: tuple[AllLights, PlatesSeen]) -> None:
    """Eliminating depth first gives what one dense system of six numbers and every block gives."""
    part, pixels = body_part(), np.nonzero(body_part().found)
    pixels = pixels[0][::9], pixels[1][::9]
    now = moving(true_points(part, 0.8), TRUE.changed(UNITS * 0.3), part)
    now = replace(now, blocks=replace(now.blocks, off_px=np.sin(np.arange(len(now.blocks.off_px)))))
    by, by_px = joint_fit._step(now, pixels, turning[1], UNITS)
    seen, block, count = InPicture.of(now.points, *pixels), now.blocks.at(pixels), len(now.blocks.off_px)
    along = AlongMotion.of(now.motion, seen, turning[1])
    nearer = now.motion.spin[1] * along.slopes[0] - now.motion.spin[0] * along.slopes[1]
    grows = np.zeros((6 + count, *nearer.shape))
    grows[:6] = along.steps(seen.points.per_number(), UNITS)
    grows[6 + block, :, np.arange(block.size)] = nearer.T
    counts = along.weight / np.bincount(block, minlength=count)[block] / UNLIKE**2
    columns, values = grows.reshape(6 + count, -1), np.asarray(along.values * counts).ravel()
    squares = (columns * np.tile(counts, len(nearer))) @ columns.T
    squares[:6, :6] += joint_fit.FIRM * np.diag(np.diag(squares)[:6])
    squares[6:, 6:] += now.blocks.even @ np.eye(count) + joint_fit.LEAST * np.eye(count)
    pull = -columns @ values
    pull[6:] -= now.blocks.even @ now.blocks.off_px
    both = np.linalg.solve(squares, pull)
    np.testing.assert_allclose(by, both[:6], atol=0.01 * np.abs(both[:6]).max())
    np.testing.assert_allclose(by_px, both[6:], atol=0.01 * np.abs(both[6:]).max())


def test_depth_departs_more_freely_where_it_is_steep() -> None:
    """A slope is off by 1 + slope² times as much as one that faces the camera."""
    there = np.ones((20, 24), np.bool_)
    near = np.asarray(2 * np.maximum(np.mgrid[:20, :24][1] - 12, 0), np.float32)
    blocks = DepthBlocks.of(there, near)
    held = (blocks.even @ np.eye(480)).diagonal().reshape(20, 24)
    assert blocks.step == 1
    assert held[10, 5] / held[10, 18] == pytest.approx((1 + 2**2) ** 2, rel=1e-4)


def test_depth_and_motion_stay_where_plates_tell_nothing(turning: tuple[AllLights, PlatesSeen]) -> None:
    part = body_part()
    dark = replace(turning[1], pictures=np.zeros_like(turning[1].pictures))
    found = fitted_together(moving(true_points(part), TRUE, part), part, dark, UNITS)
    np.testing.assert_allclose(found.points.near, true_points(part).near, atol=1e-3)
    np.testing.assert_allclose(found.motion.numbers, TRUE.numbers, atol=1e-6)


def test_what_one_light_does_not_reach_is_told_by_the_others(turning: tuple[AllLights, PlatesSeen]) -> None:
    """Faces that turn away are dark under one light of five, and brightest under another."""
    part = body_part()
    pictures = turning[1].pictures.copy()
    pictures[:2, ..., 0] = 0
    one_dark = replace(turning[1], pictures=pictures)
    assert left_along(TRUE, true_points(part), part, one_dark) < 0.03
    off = TRUE.changed(np.array([0, 0, 0, 2 / RADIUS_PX, 0, 0]))
    assert left_along(off, true_points(part), part, one_dark) > 0.06


def test_over_windows_the_ball_s_way_is_the_best_one_on_the_ball_and_rest_on_the_wall(
    turning: tuple[AllLights, PlatesSeen],
) -> None:
    lights, plates = turning
    inside, _ = ball()
    part = body_part()
    points = true_points(part)
    still = np.zeros(SHAPE, np.bool_)
    none = Followed(time_s=0.0, velocity=np.zeros((2, *SHAPE), np.float32), moves=still, rests=~still)
    moved = replace(none, velocity=TRUE.velocity(points), bend=TRUE.bend(points))
    rest = LeftAlong.of(lights, plates, plates.at_rest, none)
    along = LeftAlong.of(lights, plates, plates.turned(TRUE), moved)
    core = cv2.erode(part.found.astype(np.uint8), np.ones((9, 9))) > 0
    wall = cv2.erode((~inside).astype(np.uint8), np.ones((41, 41))) > 0
    assert along.told[core].all()
    assert np.quantile(along.wide[core], 0.9) < 0.05
    assert np.median(rest.wide[core]) > 0.5
    assert rest.told[wall].all()
    assert rest.wide[wall].max() < 0.01
    assert np.median(along.wide[wall]) > 0.2, "a bare wall does not turn with the ball"
    least = along.least(rest)
    np.testing.assert_array_equal(least.wide, np.minimum(along.wide, rest.wide))
    asked = LeftAlong.of(lights, plates, plates.at_rest, none, part.about)
    assert not asked.told[wall].any(), "what was not asked is not told"
    assert (asked.wide[~asked.told] == 1).all()
