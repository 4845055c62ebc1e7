"""A body that turns moves every point along a curved way; six numbers tell all of them, and plates of all lights tell
the numbers."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from sketched_pairs import pairs_around, sketched
from turning_ball import FLASHES_S, RADIUS_PX, SHAPE, SPOTS, TURN, UNITS, ball, lights, pairs, surface_of, turned

from psvideo.model.arrays import Doubles, Flags
from psvideo.plates.align.rigid import with_bodies as bodies
from psvideo.plates.align.rigid.bodies import RigidBody
from psvideo.plates.align.rigid.flow_fit import motion_of_flow
from psvideo.plates.align.rigid.left_along import LeftAlong
from psvideo.plates.align.rigid.moving_parts import MovingPart, parts_of
from psvideo.plates.align.rigid.plates_seen import PlatesSeen
from psvideo.plates.align.rigid.rigid_motion import BodyPoints, RigidMotion
from psvideo.plates.align.rigid.seen_depth import depth_of
from psvideo.plates.align.rigid.with_bodies import with_bodies
from psvideo.plates.align.velocity.all_lights import AllLights
from psvideo.plates.align.velocity.flow import Sketch
from psvideo.plates.align.velocity.followed import Followed, Pair
from psvideo.plates.align.velocity.moving import followed_at


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


def with_and_without(
    shown: dict[str, Pair], still: Flags | None = None, *, lamps_m: float | None = None
) -> tuple[Followed, Followed]:
    """What flow finds, and that with bodies."""
    found = followed_at([*shown.values()], 0.0)
    none = np.zeros(SHAPE, np.bool_) if still is None else still
    return found, with_bodies(surface_of(shown, lamps_m=lamps_m), AllLights.of([*shown.values()], 0.0), found, none)


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


def test_so_it_does_under_three_lights_whose_plates_before_and_after_check_each_other() -> None:
    seen = pairs()
    found, told = with_and_without({name: seen[name] for name in ("l0", "l2", "l3")})
    assert off_px(told) < 0.6
    assert off_px(found) > 3 * off_px(told)


def test_so_it_does_under_near_lights() -> None:
    """What each sends differs by a factor of 1.25 over what it reaches of the ball, and by 6.5 degrees from what it
    sends to its middle. (At 0.75 m flow finds nothing to start from.)"""
    seen = pairs(lamps_m=1.1)
    found, told = with_and_without(seen, lamps_m=1.1)
    _, as_distant = with_and_without(seen)
    assert off_px(told) < 0.15
    assert off_px(found) > 30 * off_px(told)
    assert off_px(as_distant) > 1.5 * off_px(told)


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


def sliding_before_a_wall(light: int, time_s: float) -> Sketch:
    """A painted relief that slides to the right before a bare, even wall."""
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]].astype(np.float32)
    x, y = x - SHAPE[1] / 2 - 8 * np.float32(time_s), y - SHAPE[0] / 2
    shown = cv2.remap((SPOTS / SPOTS.std()).astype(np.float32), x + 300, y + 200, cv2.INTER_LINEAR)
    normal = np.stack([0.3 * np.sin(x / 9), 0.3 * np.cos(y / 7), np.ones_like(x)], axis=-1)
    direction = np.array(lights()[light].direction)
    shaded = (0.5 + 0.1 * shown) * (normal / np.linalg.norm(normal, axis=-1, keepdims=True) @ direction)
    there = (np.abs(x) < 50) & (np.abs(y) < 45)
    return sketched(np.asarray(np.where(there, shaded, 0.3 * direction[2]), np.float32), light, time_s)


def test_a_bare_wall_does_not_slide_with_what_slides_before_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Along any way it is as even as at rest; here a body is looked for however little is left."""
    monkeypatch.setattr(bodies, "LITTLE", np.float32(0))
    found, told = with_and_without(pairs_around(sliding_before_a_wall, FLASHES_S))
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]] - np.array(SHAPE).reshape(2, 1, 1) / 2
    assert told.moves[(np.abs(x) < 40) & (np.abs(y) < 40)].mean() > 0.95
    beside = (np.abs(x) > 66) | (np.abs(y) > 57)
    assert told.moves[beside].mean() <= found.moves[beside].mean() + 0.005


def test_of_two_bodies_at_one_place_the_one_that_explains_more_is_taken() -> None:
    shown = pairs_around(lambda light, time_s: passing(light, time_s, -8), FLASHES_S)
    lights_seen, none, every = AllLights.of([*shown.values()], 0.0), np.zeros(SHAPE, np.bool_), np.ones(SHAPE, np.bool_)
    still = Followed(time_s=0.0, velocity=np.zeros((2, *SHAPE), np.float32), moves=none, rests=every)
    plates = PlatesSeen.of(surface_of(shown), lights_seen, 1.5)
    before = bodies._Before.of(lights_seen, plates, still, bodies._Rest.of(lights_seen, plates, still))
    part, points = MovingPart(found=every, within=every, about=every), BodyPoints.of(np.zeros(SHAPE, np.float32), every)
    ways = [RigidMotion(numbers=np.array([right, 0.0, 0, 0, 0, 0])) for right in (8.0, 6.5)]
    two = [RigidBody(part=part, points=points, motion=way) for way in ways]
    for order in (two, two[::-1]):
        inner = bodies._joined(still, order, before, none).velocity[0, 8:-8, 16:-16]
        assert np.median(inner[: len(inner) // 2 - 6]) == 8


@pytest.mark.parametrize(("equal", "taken"), [(0.9, 0.9 + 0.05), (0.7, 0.05)])
def test_what_leaves_as_little_counts_only_where_most_of_a_part_is_one_body(equal: float, taken: float) -> None:
    """Of the pixels a share is left as before, a twentieth clearly better, and the rest worse."""
    place, every = np.linspace(0, 1, 1000, endpoint=False)[None], np.ones((1, 1000), np.bool_)
    before = LeftAlong(wide=np.full((1, 1000), 0.5, np.float32), told=every)
    wide = np.where(place < equal, 0.5, np.where(place < equal + 0.05, 0.4, 0.9)).astype(np.float32)
    part = MovingPart(found=every, within=every, about=every)
    assert bodies._holds(LeftAlong(wide=wide, told=every), before, part).mean() == pytest.approx(taken)


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
