"""A body that turns moves every point along a curved way; six numbers tell all of them, and plates of all lights tell
the numbers."""

import math

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation
from sketched_pairs import pairs_around, sketched

from psvideo.model.arrays import Doubles, Flags, Floats
from psvideo.model.rig import Light
from psvideo.plates.align.as_they_are import Lamps
from psvideo.plates.align.by_surface import BySurface
from psvideo.plates.align.rigid import with_bodies as bodies
from psvideo.plates.align.rigid.flow_fit import motion_of_flow
from psvideo.plates.align.rigid.moving_parts import parts_of
from psvideo.plates.align.rigid.rigid_motion import BodyPoints, RigidMotion
from psvideo.plates.align.rigid.seen_depth import depth_of
from psvideo.plates.align.rigid.with_bodies import with_bodies
from psvideo.plates.align.velocity.all_lights import AllLights
from psvideo.plates.align.velocity.flow import Sketch
from psvideo.plates.align.velocity.followed import Followed, Pair
from psvideo.plates.align.velocity.moving import followed_at

SHAPE, COUNT, RADIUS_PX = (160, 192), 5, 62.0
FLASHES_S = 1 / (COUNT + 1) * (np.arange(COUNT) - (COUNT - 1) / 2)
TURN = np.radians([-6.0, 15.0, 4.0])
"""How fast the ball turns, right, down and to the camera: 17 degrees and up to 18 px in a round."""
UNITS = np.array([1, 1, *[1 / RADIUS_PX] * 4])


def turned(places: Doubles, spin: Doubles, time_s: float) -> Doubles:
    """Places (point, 3: right, down, near) after a turn. With a third axis towards the camera these axes are
    left-handed: SciPy's rotations are told in right-handed ones, right, down and away."""
    away = np.array([1, 1, -1])
    return np.asarray(Rotation.from_rotvec(-spin * away * time_s).apply(places * away) * away)


@settings(deadline=None)
@given(st.data())
def test_velocity_and_bend_are_how_turning_points_go(data: st.DataObject) -> None:
    numbers = arrays(np.float64, 3, elements=st.floats(-1, 1))
    spin, place = data.draw(numbers), 50 * data.draw(numbers)
    points = BodyPoints(
        right=place[:1].astype(np.float32), down=place[1:2].astype(np.float32), near=place[2:].astype(np.float32)
    )
    motion = RigidMotion(numbers=np.array([3.0, -2.0, *spin, 0.0]))
    step_s = 1e-3
    ways = [turned(place[None], spin, time_s)[0, :2] for time_s in (-step_s, 0.0, step_s)]
    velocity = (ways[2] - ways[0]) / (2 * step_s) + [3, -2]
    bend = (ways[2] - 2 * ways[1] + ways[0]) / step_s**2
    np.testing.assert_allclose(motion.velocity(points)[:, 0], velocity, atol=1e-3)
    np.testing.assert_allclose(motion.bend(points)[:, 0], bend, atol=1e-3)
    columns = points.per_number()[:, :, 0]
    np.testing.assert_allclose(motion.numbers @ columns, motion.velocity(points)[:, 0], atol=1e-3)


def test_plates_of_what_turns_are_taken_along_curved_ways() -> None:
    place, spin = np.array([[20.0, -30.0, 40.0]]), np.array([0.1, -0.4, 0.2])
    points = BodyPoints(
        **{name: place[:1, n : n + 1].astype(np.float32) for n, name in enumerate(("right", "down", "near"))}
    )
    motion = RigidMotion(numbers=np.array([0, 0, *spin, 0]))
    there = np.ones((1, 1), np.bool_)
    found = Followed(time_s=0.0, velocity=motion.velocity(points), moves=there, rests=~there, bend=motion.bend(points))
    for span_s in (0.5, -0.3):
        came = place[0, :2] - turned(place, spin, -span_s)[0, :2]
        straight = span_s * found.velocity[:, 0, 0]
        assert np.hypot(*(found.way(span_s)[:, 0, 0] - came)) < 0.15 * np.hypot(*(straight - came))
    kept = found.without(there)
    assert not kept.way(0.5).any()


def ball(middle: tuple[float, float] = (0, 0), radius_px: float = RADIUS_PX) -> tuple[Flags, Doubles]:
    """Where a ball is, and its points from its middle, right, down, near (row, col, 3), in radii."""
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]].astype(np.float64)
    x, y = (x - (SHAPE[1] - 1) / 2 - middle[0]) / radius_px, (y - (SHAPE[0] - 1) / 2 - middle[1]) / radius_px
    depth = np.sqrt(np.maximum(1 - x * x - y * y, 0))
    return np.asarray(depth > 0), np.stack([x, y, depth], axis=-1)


@pytest.mark.parametrize("scale", [1.0, 0.3])
def test_the_depth_of_a_ball_is_found_from_its_normals_of_any_length(scale: float) -> None:
    inside, points = ball()
    normals = np.asarray(scale * points * [1, -1, 1], np.float32)
    seen = points[..., 2] > 0.5
    off = depth_of(normals, seen) - RADIUS_PX * points[..., 2]
    assert off[seen].std() < 0.02 * RADIUS_PX
    assert not depth_of(normals, seen)[~inside].any()


def test_parts_without_a_common_edge_lie_at_one_depth() -> None:
    (left, points), (right, others) = ball((-45, 0), 30), ball((45, 0), 30)
    normals = np.where(left[..., None], points, others) * [1, -1, 1]
    seen = np.where(left, points[..., 2], others[..., 2]) > 0.5
    near = depth_of(np.asarray(normals, np.float32), seen)
    assert near[seen & left].mean() == pytest.approx(near[seen & right].mean(), abs=1)


@pytest.mark.parametrize("wrong", [0.0, 0.35])
def test_a_motion_is_found_in_velocities_of_which_many_are_wrong(wrong: float) -> None:
    rng = np.random.default_rng(4)
    places = rng.uniform(-50, 50, (3, 400)).astype(np.float32)
    points = BodyPoints(right=places[0], down=places[1], near=places[2])
    true = np.array([2.0, -5.0, *TURN, 0.02])
    velocity = RigidMotion(numbers=true).velocity(points)
    velocity[:, rng.random(400) < wrong] *= 0.3
    found = motion_of_flow(points, velocity, UNITS)
    np.testing.assert_allclose(found.numbers / UNITS, true / UNITS, atol=0.1 if wrong else 0.01)


def lights() -> list[Light]:
    around = [2 * math.pi * n / COUNT + 0.3 for n in range(COUNT)]
    return [Light(name=f"l{n}", direction=(0.7 * math.cos(a), 0.7 * math.sin(a), 0.71)) for n, a in enumerate(around)]


SPOTS = cv2.GaussianBlur(np.random.default_rng(5).normal(size=(400, 800)), (0, 0), 4)


def painted(points: Doubles, spin: Doubles, time_s: float) -> Floats:
    """The paint of a ball's points where it turned so long."""
    before = turned(points.reshape(-1, 3), spin, -time_s).reshape(points.shape)
    angle = np.arctan2(before[..., 0], before[..., 2])
    places = ((angle / math.pi + 1) % 2 * 400).astype(np.float32), ((before[..., 1] + 1) * 199).astype(np.float32)
    spots = (SPOTS / SPOTS.std()).astype(np.float32)
    shown = cv2.remap(spots, *places, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
    return np.asarray(np.clip(0.5 + 0.15 * shown, 0.1, 0.9), np.float32)


def seen(light: int, time_s: float, spin: Doubles) -> Sketch:
    """A light's sketch of the ball before an even wall."""
    inside, points = ball()
    direction = np.array(lights()[light].direction)
    shaded = painted(points, spin, time_s) * np.maximum(points * [1, -1, 1] @ direction, 0)
    noise = np.random.default_rng([light, int(1e4 * (time_s + 9))]).normal(0, 0.002, SHAPE)
    image = np.asarray(np.where(inside, shaded, 0.3 * direction[2]) + noise, np.float32)
    return sketched(image, light, time_s)


def pairs(spin: Doubles = TURN) -> dict[str, Pair]:
    """Every light's plates before and after the instant 0."""
    return pairs_around(lambda light, time_s: seen(light, time_s, spin), FLASHES_S)


def surface_of(shown: dict[str, Pair]) -> BySurface:
    by_surface = BySurface.of(Lamps.of(lights(), [*shown]), shown, {})
    assert by_surface is not None
    return by_surface


def with_and_without(shown: dict[str, Pair], still: Flags | None = None) -> tuple[Followed, Followed]:
    """What flow finds, and that with bodies."""
    found = followed_at([*shown.values()], 0.0)
    none = np.zeros(SHAPE, np.bool_) if still is None else still
    return found, with_bodies(surface_of(shown), AllLights.of([*shown.values()], 0.0), found, none)


def off_px(found: Followed, spin: Doubles = TURN) -> float:
    """How far ways over half a round are off on the ball, half of its points, in pixels."""
    _, points = ball()
    middle = points[..., 2] > 0.5
    off = []
    for span_s in (0.5, -0.5):
        before = turned(RADIUS_PX * points[middle], spin, -span_s)
        true = (RADIUS_PX * points[middle] - before)[:, :2].T
        off.append(np.hypot(*(found.way(span_s)[:, middle] - true)))
    return float(np.median(off))


def test_a_painted_ball_goes_along_its_curved_ways_where_flow_is_held_back_by_shading() -> None:
    found, told = with_and_without(pairs())
    assert off_px(told) < 0.45
    assert off_px(found) > 5 * off_px(told)
    straight = Followed(time_s=0.0, velocity=told.velocity, moves=told.moves, rests=told.rests)
    assert off_px(straight) > 1.1 * off_px(told)


def test_what_is_still_stays_and_a_bare_wall_beside_is_not_carried_along() -> None:
    still = np.zeros(SHAPE, np.bool_)
    still[:, : SHAPE[1] // 2] = True
    found, told = with_and_without(pairs(), still)
    np.testing.assert_array_equal(told.velocity[:, still], found.velocity[:, still])
    assert not told.bends[:, still].any()
    inside, _ = ball()
    beside = cv2.erode((~inside).view(np.uint8), np.ones((9, 9), np.uint8)) > 0
    assert told.moves[beside].mean() <= found.moves[beside].mean() + 0.005


def passing(light: int, time_s: float, lower_px_s: float) -> Sketch:
    """A painted relief whose upper half goes 8 px a second to the right, and the lower one as fast as one likes."""
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]].astype(np.float32)
    x = np.asarray(x - np.where(y < SHAPE[0] / 2, 8, lower_px_s) * time_s, np.float32)
    shown = cv2.remap((SPOTS / SPOTS.std()).astype(np.float32), x + 300, y + 100, cv2.INTER_LINEAR)
    normal = np.stack([0.3 * np.sin(x / 9), 0.3 * np.cos(x / 7), np.ones_like(x)], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    shaded = (0.5 + 0.1 * shown) * (normal @ np.array(lights()[light].direction))
    return sketched(np.asarray(shaded, np.float32), light, time_s)


def test_what_leaves_nothing_to_gain_is_as_flow_found_it() -> None:
    found, told = with_and_without(pairs_around(lambda light, time_s: passing(light, time_s, 8), FLASHES_S))
    assert found.moves.mean() > 0.9
    assert told is found


def test_two_halves_that_pass_each_other_are_no_body(monkeypatch: pytest.MonkeyPatch) -> None:
    """One motion for both would be off for either; here it is looked for however little is left."""
    monkeypatch.setattr(bodies, "LITTLE", np.float32(0))
    _, told = with_and_without(pairs_around(lambda light, time_s: passing(light, time_s, -8), FLASHES_S))
    inner = told.velocity[0, 8:-8, 16:-16]
    half = len(inner) // 2 - 6
    assert np.median(np.abs(inner[:half] - 8)) < 0.3
    assert np.median(np.abs(inner[-half:] + 8)) < 0.3


def test_parts_are_the_largest_things_that_move_and_hold_what_lies_within_them() -> None:
    moves = np.zeros(SHAPE, np.bool_)
    moves[20:80, 20:80], moves[40:60, 40:60] = True, False
    moves[120:125, 150:155] = True
    rests = np.zeros(SHAPE, np.bool_)
    rests[45:50, 45:50] = True
    none = np.zeros((2, *SHAPE), np.float32)
    parts = list(parts_of(Followed(time_s=0.0, velocity=none, moves=moves, rests=rests)))
    assert len(parts) == 1, "the small one tells nothing"
    assert parts[0].within[55, 55]
    assert not parts[0].within[47, 47], "what clearly rests is of no body"
    assert parts[0].about[100, 50]
    assert not parts[0].about[140, 50]


def test_turns_bring_a_body_nearer_to_its_motion(monkeypatch: pytest.MonkeyPatch) -> None:
    shown = pairs()
    _, told = with_and_without(shown)
    monkeypatch.setattr(bodies, "TURNS", 1)
    _, first = with_and_without(shown)
    assert off_px(told) < 0.8 * off_px(first)
