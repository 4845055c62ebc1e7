"""The order of the lights from a rig's directions: given where the rig shows it, refused where it cannot."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from psvideo.model.irradiance.ground import ground_of
from psvideo.model.irradiance.light_field import Points, light_vectors, points_on_plane
from psvideo.model.marker import turned_slot
from psvideo.model.plan import Plan
from psvideo.model.rig import Light, Rig
from psvideo.model.timing import Flash, Timing
from psvideo.sync.order_by_rig import named_by_turn, order_by_rig

PlanMaker = Callable[..., Plan]
NAMES = tuple("abcdefgh")
STRONG = (1.0, 0.6, 1.3, 0.8, 0.5)


def ring(degrees: Sequence[float], heights: Sequence[float]) -> Rig:
    lights = []
    for name, turn, height in zip(NAMES, np.radians(degrees), heights, strict=False):
        across = np.sqrt(1 - height**2)
        direction = (float(across * np.cos(turn)), float(across * np.sin(turn)), height)
        lights.append(Light(name=name, intensity=(1.0,), direction=direction))
    return Rig(lights=tuple(lights))


def pictures(plan: Plan, rig: Rig, turn: int) -> dict[int, np.ndarray]:
    """A bump under the rig's lights; the slots are named ``turn`` places too early."""
    y, x = np.mgrid[-1:1:24j, -1:1:24j]
    normals = np.stack([0.5 * x, 0.5 * y, np.ones_like(x)], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    rng = np.random.default_rng(1)
    albedo = rng.uniform(0.3, 0.8, x.shape)
    shown = [
        light.intensity[0] * albedo * np.clip(normals @ np.array(light.direction), 0, None) for light in rig.lights
    ]
    noisy = [picture + 0.003 * rng.standard_normal(x.shape) for picture in shown]
    return {slot: noisy[(slot + turn) % len(noisy)].astype(np.float32) for slot in plan.lit_slots}


def near_ring(*, radius_m: float, anisotropy: float | None = None) -> Rig:
    """Five lights in a ring about the lens, 1.2 m before a plane that the camera sees 0.9 m of."""
    lights = []
    for name, turn in zip(NAMES, np.radians(72 * np.arange(5)), strict=False):
        position_m = (radius_m * float(np.cos(turn)), radius_m * float(np.sin(turn)), 0.0)
        light = Light(name=name, intensity=(0.9,), position_m=position_m)
        lights.append(replace(light, anisotropy=anisotropy, axis=(0.0, 0.0, -1.0)) if anisotropy else light)
    return Rig(lights=tuple(lights), focal_px=(30.0, 30.0), principal_px=(11.5, 11.5), plane=(0.0, 0.0, 1.0, 1.2))


def bump(size: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The normals of a rounded relief, and where its points lie from -1 to 1."""
    y, x = np.mgrid[1 : -1 : size * 1j, -1 : 1 : size * 1j]
    normals = np.stack([0.5 * x + 0.2 * np.sin(5 * y), 0.5 * y + 0.2 * np.cos(4 * x), np.ones_like(x)], axis=-1)
    return normals / np.linalg.norm(normals, axis=-1, keepdims=True), x, y


def near_pictures(plan: Plan, rig: Rig, turn: int) -> dict[int, np.ndarray]:
    normals, x, y = bump(24)
    points_m = np.stack([x * 11.5 / 30 * 1.2, y * 11.5 / 30 * 1.2, np.full_like(x, -1.2)], axis=-1)
    shown = []
    for light in rig.lights:
        away = np.array(light.position_m) - points_m
        distance = np.linalg.norm(away, axis=-1)
        shown.append(0.5 * light.intensity[0] * np.clip((normals * away).sum(axis=-1), 0, None) / distance**3)
    return {slot: shown[(slot + turn) % len(shown)].astype(np.float32) for slot in plan.lit_slots}


def disturbed(rng: np.random.Generator, plan: Plan, rig: Rig, turn: int) -> dict[int, np.ndarray]:
    """A patchy relief under the rig, with gloss, a cast shadow per light, ambient light and noise at random."""
    normals, x, y = bump(32)
    albedo = np.exp(0.4 * rng.standard_normal((8, 8))).repeat(4, 0).repeat(4, 1)
    gloss, shadow, ambient = rng.choice([0, 0, 0.2]), rng.choice([0, 0.4]), rng.choice([0, 0, 0.02, 0.1])
    shown = []
    for light in rig.lights:
        half = np.add(np.array(light.direction), (0, 0, 1))
        lit = albedo * np.clip(normals @ np.array(light.direction), 0, None)
        lit += gloss * np.clip(normals @ (half / np.linalg.norm(half)), 0, 1) ** 60
        middle = rng.uniform(-1, 1, 2)
        lit[(x - middle[0]) ** 2 + (y - middle[1]) ** 2 < shadow**2] *= 0.03
        shown.append(light.intensity[0] * lit + ambient * albedo)
    scale = 0.8 / np.percentile(shown, 99)
    noisy = [scale * picture + 0.004 * rng.standard_normal(x.shape) for picture in shown]
    return {slot: noisy[(slot + turn) % len(noisy)].astype(np.float32) for slot in plan.lit_slots}


@pytest.mark.parametrize("turn", range(5))
def test_an_irregular_rig_shows_the_turn(turn: int, make_plan: PlanMaker) -> None:
    plan = make_plan(lights=NAMES[:5], dark=False)
    rig = ring([0, 50, 130, 200, 300], [0.8, 0.6, 0.9, 0.7, 0.75])
    assert order_by_rig(plan, rig, pictures(plan, rig, turn)).turn == turn


def test_a_regular_ring_shows_nothing(make_plan: PlanMaker) -> None:
    plan = make_plan(lights=NAMES[:5], dark=False)
    rig = ring([0, 72, 144, 216, 288], [0.8] * 5)
    verdict = order_by_rig(plan, rig, pictures(plan, rig, 2))
    assert verdict.turn is None
    assert "looks nearly the same when it is turned" in verdict.why


def test_three_lights_fit_any_picture(make_plan: PlanMaker) -> None:
    plan = make_plan(lights=NAMES[:3], dark=False)
    rig = ring([0, 100, 220], [0.8, 0.6, 0.9])
    verdict = order_by_rig(plan, rig, pictures(plan, rig, 1))
    assert verdict.turn is None
    assert "3 flashes" in verdict.why


def test_strengths_show_the_turn_of_a_regular_ring(make_plan: PlanMaker) -> None:
    plan = make_plan(lights=NAMES[:5], dark=False)
    rig = ring([0, 72, 144, 216, 288], [0.8] * 5)
    uneven = Rig(lights=tuple(replace(light, intensity=(s,)) for light, s in zip(rig.lights, STRONG, strict=True)))
    shown = pictures(plan, uneven, 3)
    assert order_by_rig(plan, uneven, shown).turn == 3
    assert order_by_rig(plan, rig, shown).turn is None, "a rig file that does not fit is not believed"


def test_a_calibrated_rig_needs_less_of_a_difference(make_plan: PlanMaker) -> None:
    plan = make_plan(lights=NAMES[:5], dark=False)
    rig = ring([0, 85, 140, 224, 288], [0.8, 0.7, 0.8, 0.88, 0.8])
    shown = pictures(plan, rig, 1)
    assert order_by_rig(plan, rig, shown).turn is None
    measured = Rig(lights=tuple(replace(light, error_deg=0.4) for light in rig.lights))
    assert order_by_rig(plan, measured, shown).turn == 1


def test_near_lights_are_taken_at_the_plane_and_show_the_turn_of_a_regular_ring(make_plan: PlanMaker) -> None:
    plan = make_plan(lights=NAMES[:5], dark=False, width_px=24, height_px=24)
    rig = near_ring(radius_m=0.6)
    shown = near_pictures(plan, rig, 2)
    assert order_by_rig(plan, rig, shown).turn is None, "seen from the middle it is still a ring"
    strong = Rig(
        lights=tuple(replace(light, intensity=(s,)) for light, s in zip(rig.lights, STRONG, strict=True)),
        focal_px=rig.focal_px,
        principal_px=rig.principal_px,
        plane=rig.plane,
    )
    assert order_by_rig(plan, strong, near_pictures(plan, strong, 2)).turn == 2
    verdict = order_by_rig(plan, replace(strong, plane=None), near_pictures(plan, strong, 2))
    assert verdict.turn is None
    assert "[surface]" in verdict.why


def test_the_light_of_near_lights_is_what_the_virtual_shoot_makes_of_them(make_plan: PlanMaker) -> None:
    plan = make_plan(lights=NAMES[:5], dark=False, width_px=24, height_px=24)
    rig = near_ring(radius_m=0.6, anisotropy=2.0)
    rows, cols = np.mgrid[0:24, 0:24]
    points = Points(
        down=(rows.ravel() + 0.5) / 24,
        across=(cols.ravel() + 0.5) / 24,
        channel=np.zeros(rows.size, np.intp),
        channels=1,
    )
    points_m = points_on_plane(plan, rig, down=points.down, across=points.across)
    np.testing.assert_allclose(points_m[:, 2], -1.2)
    np.testing.assert_allclose(points_m[0], [-11.5 / 30 * 1.2, 11.5 / 30 * 1.2, -1.2])
    found = light_vectors(plan, rig, points)
    for slot, light in enumerate(rig.lights):
        away = np.array(light.position_m) - points_m
        distance = np.linalg.norm(away, axis=1)
        cosine = -(away / distance[:, None]) @ np.array(light.axis)
        want = 0.9 * cosine[:, None] ** 2 * away / distance[:, None] ** 3
        np.testing.assert_allclose(found[:, slot], want / plan.flashes[slot].duration_s * 0.0008, rtol=1e-6)


def test_points_past_the_horizon_lie_as_far_before_the_camera_as_where_normals_are_solved(make_plan: PlanMaker) -> None:
    """Rays above a floor's horizon meet it behind the camera: both follow it to a thousand times its nearest depth."""
    plan = make_plan(lights=NAMES[:3], dark=False, width_px=24, height_px=40)
    floor = (0.0, 0.8, 0.6, 1.0)
    rig = replace(
        near_ring(radius_m=0.6, anisotropy=0.0), plane=floor, focal_px=(16.0, 16.0), principal_px=(11.5, 19.5)
    )
    rows, cols = np.mgrid[0:40, 0:24]
    points_m = points_on_plane(plan, rig, down=(rows.ravel() + 0.5) / 40, across=(cols.ravel() + 0.5) / 24)
    past = np.array([points_m[0] @ floor[:3] + floor[3], points_m[-1] @ floor[:3] + floor[3]])
    assert past[0] > 1.0, "the top row looks past the horizon"
    assert past[1] == pytest.approx(0.0, abs=1e-9), "and the bottom row at the floor"
    ground = ground_of(rig, height_px=40, width_px=24)
    np.testing.assert_allclose(-points_m[:, 2], ground.depth_m.ravel(), rtol=1e-6)


def random_rig(rng: np.random.Generator, kind: str, count: int) -> Rig:
    """Lights all over, or on a ring: regular, jostled by a few degrees or by many, or of different strengths."""
    degrees = 360 / count * np.arange(count) + rng.uniform(0, 360)
    tilt = np.full(count, rng.uniform(25, 55))
    jostle = {"nearly": 4.0, "uneven": 20.0}.get(kind, 0.0)
    degrees, tilt = degrees + jostle * rng.standard_normal(count), tilt + jostle / 2 * rng.standard_normal(count)
    if kind == "random":
        degrees, tilt = rng.uniform(0, 360, count), rng.uniform(10, 65, count)
    rig = ring(list(degrees), list(np.cos(np.radians(tilt))))
    strengths = rng.uniform(0.5, 1.5, count) if kind == "strengths" else np.ones(count)
    return Rig(
        lights=tuple(replace(light, intensity=(float(s),)) for light, s in zip(rig.lights, strengths, strict=True))
    )


def measured_badly(rng: np.random.Generator, rig: Rig, error_deg: float) -> Rig:
    lights = []
    for light in rig.lights:
        vector = np.array(light.direction) + np.radians(error_deg) * rng.standard_normal(3)
        x, y, z = vector / np.linalg.norm(vector)
        strength = light.intensity[0] * float(np.exp(0.017 * error_deg * rng.standard_normal()))
        lights.append(replace(light, direction=(float(x), float(y), float(z)), intensity=(strength,)))
    return Rig(lights=tuple(lights))


@pytest.mark.parametrize(
    ("kind", "least_right"), [("random", 12), ("uneven", 8), ("strengths", 8), ("nearly", 0), ("regular", 0)]
)
@pytest.mark.campaign
def test_over_many_rigs_and_scenes_no_order_is_ever_wrong(kind: str, least_right: int, make_plan: PlanMaker) -> None:
    rng = np.random.default_rng(7)
    right = 0
    for _ in range(40):
        count = int(rng.integers(4, 9))
        plan = make_plan(lights=NAMES[:count], dark=False)
        rig, turn = random_rig(rng, kind, count), int(rng.integers(count))
        shown = disturbed(rng, plan, rig, turn)
        verdict = order_by_rig(plan, measured_badly(rng, rig, rng.choice([0.0, 1.0, 3.0, 5.0])), shown)
        assert verdict.turn in (None, turn), verdict.why
        right += verdict.turn == turn
    assert right >= least_right
    assert right == 0 or kind != "regular"


def test_turning_renames_the_flashes_and_nothing_else(make_plan: PlanMaker) -> None:
    plan = make_plan(dark=False)
    flash = Flash(index=0, slot=2, lights=plan.flashes[2].lights, start_s=0.1, duration_s=0.001, complete=True)
    timing = Timing(
        clip="",
        frame_period_s=0.01,
        exposure_s=0.01,
        row_time_s=1e-5,
        clock_offset_ppm=0.0,
        phase_error_rows=0.0,
        order="guess",
        flashes=(flash,),
    )
    assert named_by_turn(plan, timing, 1).flashes == (replace(flash, slot=0, lights=plan.flashes[0].lights),)
    assert named_by_turn(plan, timing, 0) == timing


@pytest.mark.parametrize("dead", range(6))
def test_a_dead_light_that_looks_like_the_marker_is_told_from_it_by_the_rig(dead: int, make_plan: PlanMaker) -> None:
    plan = make_plan(lights=NAMES[:6], dark=True)
    rig = ring([0, 50, 130, 200, 260, 300], [0.8, 0.6, 0.9, 0.7, 0.95, 0.75])
    measured = replace(rig, lights=tuple(replace(light, error_deg=0.5) for light in rig.lights))
    (marker,) = (slot for slot in plan.cycle_slots if plan.flashes[slot].is_dark)
    turn = next(turn for turn in range(7) if turned_slot(plan, marker, turn) == plan.lit_slots[dead])
    lit = pictures(make_plan(lights=NAMES[:6], dark=False), measured, 0)
    lit = {slot: lit[n] for n, slot in enumerate(plan.lit_slots)}
    lit[plan.lit_slots[dead]] = lit[marker] = np.zeros_like(lit[plan.lit_slots[0]])
    shown = {slot: lit[turned_slot(plan, slot, turn)] for slot in plan.lit_slots}
    assert order_by_rig(plan, measured, shown).turn == turn
    shown = {slot: lit[slot] for slot in plan.lit_slots}
    assert order_by_rig(plan, measured, shown).turn == 0
