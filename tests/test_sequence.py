"""Rounds of plates against references by brute force: any power matrix, saturation, partial rounds, rare dark slots."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from memory_frame import MemoryFrame
from true_timing import true_timing

from psvideo.model.plan import Plan, PlannedFlash, mixing_matrix, reference_duration_s
from psvideo.model.rows.shutter import row_weights
from psvideo.model.timing import Timing
from psvideo.plates import sequence
from psvideo.plates.align.velocity.flow import changed, comparable, sketch_of, white_of
from psvideo.plates.ambient import ambient_off
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.sequence import Round, coming, light_plates
from psvideo.plates.split import split
from psvideo.report.observe.motion import Glimpse, glimpse, motion_between
from psvideo.synth import Exposure, Noise, TrueClock, expose
from psvideo.synth.camera.noise import NOISELESS

PlanMaker = Callable[..., Plan]
AMBIENT = 0.05


def patterned(plan: Plan, flashes: list[tuple[dict[str, float], float]]) -> Plan:
    return replace(plan, flashes=tuple(PlannedFlash(lights=lights, duration_s=s) for lights, s in flashes))


def light_pictures(plan: Plan, *, brightest: float = 0.3) -> dict[str, np.ndarray]:
    """What each light's full flash shows."""
    rng = np.random.default_rng(2)
    shape = (plan.camera.height_px, plan.camera.width_px)
    return {name: (brightest * rng.uniform(0.05, 1, shape)).astype(np.float32) for name in plan.lights}


def plates_under(plan: Plan, lights: dict[str, np.ndarray]) -> dict[int, np.ndarray]:
    """What every lit slot shows: written out from the plan, light by light."""
    shown = {}
    for slot in plan.lit_slots:
        flash = plan.flashes[slot]
        shown[slot] = np.sum(
            [
                power * flash.duration_s / reference_duration_s(plan, name) * lights[name]
                for name, power in flash.lights.items()
            ],
            axis=0,
        ).astype(np.float32)
    return shown


def shoot(
    plan: Plan, lights: dict[str, np.ndarray], *, frames: int = 36, noise: Noise = NOISELESS
) -> tuple[Exposure, Timing]:
    clock = TrueClock(phase_s=0.0123, offset_ppm=30.0)
    shot = expose(plates_under(plan, lights), plan, frames=frames, clock=clock, ambient=AMBIENT, noise=noise)
    return shot, true_timing(plan, shot.flashes, frames=frames)


def gathered(plan: Plan, shot: Exposure, timing: Timing) -> list[Round]:
    def frames() -> Iterator[MemoryFrame]:
        for n, image in zip(shot.indices, shot.frames, strict=True):
            yield MemoryFrame(n, image)

    held = list(split(frames(), plan.camera, timing))
    plates = ambient_off.subtract(held, darks=[plate for plate in held if not plate.flash.lights])
    expected = coming(plan, timing.flashes)
    single = light_plates(plates, plan, timing.flashes)
    return list(sequence.gathered(single, plan.lights, expected=expected.__getitem__))


@settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
)
@given(
    powers=st.lists(
        st.lists(st.sampled_from([0.0, 0.0, 0.25, 0.5, 1.0]), min_size=3, max_size=3), min_size=3, max_size=5
    ),
    durations=st.lists(st.sampled_from([0.0004, 0.0008, 0.0012]), min_size=5, max_size=5),
    dark_every=st.integers(1, 3),
    shutter=st.sampled_from([1.0, 0.7]),
)
def test_any_mixture_is_taken_apart(
    powers: list[list[float]], durations: list[float], dark_every: int, shutter: float, make_plan: PlanMaker
) -> None:
    flashes = [
        ({name: power for name, power in zip("abc", row, strict=True) if power}, duration_s)
        for row, duration_s in zip(powers, durations, strict=False)
    ]
    base = make_plan(duration_s=0.0012, dark_every=dark_every, shutter=shutter, height_px=60, width_px=6)
    plan = patterned(base, [*(flash for flash in flashes if flash[0]), ({}, 0.0012)])
    matrix = mixing_matrix(plan)
    if len(plan.lights) < 3 or np.linalg.matrix_rank(matrix) < 3 or np.linalg.cond(matrix) > 50:
        return
    lights = light_pictures(plan)
    shot, timing = shoot(plan, lights)
    compared = 0
    for one in gathered(plan, shot, timing):
        for plate in one.plates:
            error = np.abs(plate.image - lights[plate.light])[plate.seen]
            assert error.max(initial=0) < 1e-3
            assert not plate.image[~plate.seen].any()
            compared += error.size
    assert compared > 1000 or shutter < 1, "below 360 degrees, rows may miss one flash of every round"


HDR = [({"a": 1.0}, 0.0012), ({"a": 1.0}, 0.0003), ({"b": 1.0}, 0.0012), ({"a": 0.25}, 0.0003), ({}, 0.0012)]


def brute_force_merge(plan: Plan, shot: Exposure, timing: Timing, flashes: list[int]) -> tuple[np.ndarray, np.ndarray]:
    """Merge one round's flashes of light a sample by sample: clipped flashes are left out, the rest is summed.

    Returns the picture, and where every flash was clipped.
    """
    rows, cols = shot.frames.shape[1:3]
    weights = row_weights(plan.camera, timing.start_s, timing.duration_s, frames=range(len(shot.frames)))
    light, exposure = np.zeros((rows, cols)), np.zeros((rows, cols))
    for index in flashes:
        flash = timing.flashes[index]
        share = flash.lights["a"] * plan.flashes[flash.slot].duration_s / 0.0012
        for row in range(rows):
            saw = [n for n in range(len(shot.frames)) if weights[index, n, row] > 1e-9]
            whole = [n for n in saw if weights[index, n, row] > 1 - 1e-9]
            used = whole[:1] or saw
            for col in range(cols):
                samples = [float(shot.frames[n, row, col]) for n in used]
                if max(samples) < 0.998 and sum(samples) - AMBIENT * len(samples) < 1.0:
                    light[row, col] += sum(samples) - AMBIENT * len(samples)
                    exposure[row, col] += share
    return light / np.maximum(exposure, 1e-9), exposure == 0


@pytest.mark.parametrize("noise", [NOISELESS, Noise(full_well_e=20_000, read_e=5)], ids=["clean", "noisy"])
@pytest.mark.parametrize("dark_every", [1, 3])
def test_hdr_merges_as_sample_by_sample(dark_every: int, noise: Noise, make_plan: PlanMaker) -> None:
    plan = patterned(make_plan(duration_s=0.0012, dark_every=dark_every, height_px=80, width_px=10), HDR)
    lights = light_pictures(plan) | {"a": light_pictures(plan, brightest=25.0)["a"]}
    shot, timing = shoot(plan, lights, frames=60, noise=noise)
    whole = [one for one in gathered(plan, shot, timing) if one.lights == ("a", "b")]
    assert len(whole) >= 5
    slots = [flash.slot for flash in timing.flashes]
    held = 0
    for one in whole[1:]:
        merged = one.plates[0]
        near = int(np.argmin([abs(flash.start_s - merged.time_s) for flash in timing.flashes]))
        begin = max(n for n in range(near + 1) if slots[n] == 0)
        group = [n for n in range(begin, begin + 4) if "a" in timing.flashes[n].lights]
        want, clipped = brute_force_merge(plan, shot, timing, group)
        tolerance = 1e-3 if noise is NOISELESS else 0.06  # the dark slots' own noise, 16 times as much for the weakest
        np.testing.assert_allclose(merged.image[~clipped], want[~clipped], rtol=tolerance, atol=tolerance)
        assert (merged.image[clipped] >= merged.saturation * 0.999).all()
        assert (merged.image[~clipped] < merged.saturation).all()
        held += int(clipped.sum())
        true = lights["a"]
        certain = ~clipped & (true > 1.2)  # beyond what the longest flash can show
        assert certain.sum() > 300
        assert abs(float(np.median(merged.image[certain] / true[certain])) - 1) < 0.01
    assert held > 0


def test_a_row_that_only_one_of_the_hdr_flashes_showed_is_taken_from_it(make_plan: PlanMaker) -> None:
    plan = patterned(make_plan(duration_s=0.0012, shutter=0.6, height_px=80, width_px=10), HDR)
    lights = light_pictures(plan)
    shot, timing = shoot(plan, lights, frames=60)
    seen = {"a": 0.0, "b": 0.0}
    whole = [one for one in gathered(plan, shot, timing) if one.lights == ("a", "b")]
    for one in whole:
        for plate in one.plates:
            seen[plate.light] += float(plate.seen.mean()) / len(whole)
            assert np.abs(plate.image - lights[plate.light])[plate.seen].max(initial=0) < 2e-3
    assert seen["a"] > 0.95 > 0.8 > seen["b"]


def test_the_clip_s_ends_give_the_lights_that_are_complete_there_and_no_others(make_plan: PlanMaker) -> None:
    plan = make_plan(height_px=60, width_px=6, dark_every=2)
    lights = light_pictures(plan)
    for frames in range(20, 28):
        shot, timing = shoot(plan, lights, frames=frames)
        found = [(plate.light, plate.time_s) for one in gathered(plan, shot, timing) for plate in one.plates]
        want = [
            (next(iter(flash.lights)), flash.start_s + flash.duration_s / 2)
            for flash in timing.flashes
            if flash.complete and flash.lights
        ]
        assert sorted(found, key=lambda pair: pair[1]) == want


PATTERNS = [
    ({"a": 1.0, "b": 1.0}, 0.0012),
    ({"b": 1.0, "c": 1.0}, 0.0012),
    ({"a": 1.0, "c": 1.0}, 0.0012),
    ({}, 0.0012),
]


def of_light_a(plan: Plan, lights: dict[str, np.ndarray]) -> list[LightPlate]:
    shot, timing = shoot(plan, lights, frames=40, noise=Noise(full_well_e=20_000, read_e=5))
    return [one.plates[0] for one in gathered(plan, shot, timing) if one.lights == ("a", "b", "c")]


def uneven(plan: Plan, brightest: float) -> np.ndarray:
    """A picture from black to its brightest, across and along."""
    rows, cols = np.mgrid[0 : plan.camera.height_px, 0 : plan.camera.width_px]
    return np.asarray(brightest * (0.15 + 0.85 * (0.5 + 0.5 * np.sin(rows / 9) * np.cos(cols / 11))), np.float32)


def test_flashes_of_several_lights_that_clip_do_not_look_like_motion(make_plan: PlanMaker) -> None:
    """Two frames that share a flash do not clip where one that holds all of it does: rounds differ by the ceiling."""
    plan = patterned(make_plan(duration_s=0.0012, height_px=120, width_px=160), PATTERNS)
    light = uneven(plan, 0.75)  # two at once are half as bright again as what clips
    one, other = of_light_a(plan, {"a": light, "b": light[::-1], "c": light[:, ::-1]})[1:3]
    assert (np.abs(one.image - other.image) > 0.3).mean() > 0.01, "rounds do differ"
    white = white_of(one)
    before, after = sketch_of(one, white=white), sketch_of(other, white=white)
    assert not changed(before, after).any()
    codes = [picture.astype(int) for picture in comparable(before, after)]
    assert np.abs(codes[0] - codes[1]).max() < 20, "noise"
    seen = glimpse(one)
    found = motion_between(seen, glimpse(other, seen.white))
    assert found is not None
    assert found.share == 0


def test_a_thing_that_clips_flashes_of_several_lights_moves_where_it_comes_and_goes(make_plan: PlanMaker) -> None:
    plan = patterned(make_plan(duration_s=0.0012, height_px=120, width_px=160), PATTERNS)
    light = uneven(plan, 0.15)
    light[:30, :30] = 0.3  # bright enough that it might clip in another round
    bright = light.copy()
    bright[40:72, 64:104] = 0.7
    one, other = (of_light_a(plan, dict.fromkeys("abc", shown))[1] for shown in (light, bright))
    white = white_of(one)
    found = changed(sketch_of(one, white=white), sketch_of(other, white=white))
    assert found[11:17, 17:25].all(), "all of the thing within"
    seen = glimpse(one)
    moving = motion_between(seen, glimpse(other, seen.white))
    assert moving is not None
    assert moving.share > 0.05


def detail_plate(px: float, noise: float, *, number: int = 0) -> LightPlate:
    """A wall of fine detail so far to the right, under noise."""
    rng = np.random.default_rng(5)
    paint = cv2.GaussianBlur(rng.normal(size=(120, 200)), (0, 0), 0.8)
    wide = np.asarray(0.4 + 0.1 * paint / paint.std(), np.float32)
    way = np.array([[1, 0, px - 20], [0, 1, 0]], np.float64)
    shown = cv2.warpAffine(wide, way, (160, 120), flags=cv2.INTER_CUBIC)
    image = np.asarray(shown + noise * np.random.default_rng(number + 70).normal(size=shown.shape), np.float32)
    return LightPlate(
        light="a", number=number, time_s=0.1 * number, picture=mixture_of(image), seen=np.ones(120, np.bool_)
    )


@pytest.mark.parametrize("px", [0.6, 1.0, 2.3])
def test_fine_detail_that_goes_by_everywhere_moves_and_is_no_noise(px: float) -> None:
    seen = glimpse(detail_plate(0, 0.003))
    found = motion_between(seen, glimpse(detail_plate(px, 0.003, number=1), seen.white))
    assert found is not None
    assert found.share > 0.05
    assert found.speed_px_s == pytest.approx(10 * px, rel=0.25)


@pytest.mark.parametrize("px", [0.25, 0.4])
@pytest.mark.parametrize(("radius", "share"), [(120, (0.26, 0.34)), (500, (1.0, 1.0))])
def test_fine_detail_that_shifts_a_little_before_a_smooth_wall_is_not_all_of_the_picture(
    radius: int, share: tuple[float, float], px: float
) -> None:
    """A disc of 28 % of the picture was all of it, where it shifted so little that it passed for noise."""
    rows, cols = np.mgrid[:400, :400] - 199.5
    paint = cv2.GaussianBlur(np.random.default_rng(5).normal(size=(440, 440)), (0, 0), 0.8)

    def seen(shift_px: float, number: int, white: float | None = None) -> Glimpse:
        way = np.array([[1, 0, shift_px - 20], [0, 1, -20]], np.float64)
        detail = cv2.warpAffine(paint, way, (400, 400), flags=cv2.INTER_CUBIC)
        inside = np.clip(radius - np.hypot(cols - shift_px, rows) + 0.5, 0, 1)
        image = inside * (0.4 + 0.03 * detail / paint.std()) + (1 - inside) * 0.35
        image += 0.002 * np.random.default_rng(number).normal(size=image.shape)
        whole = np.ones(400, np.bool_)
        picture = mixture_of(np.asarray(image, np.float32))
        return glimpse(LightPlate(light="a", number=number, time_s=0.1 * number, picture=picture, seen=whole), white)

    before = seen(0, 0)
    found = motion_between(before, seen(px, 1, before.white))
    assert found is not None
    assert found.changed is not None
    assert share[0] <= found.share <= share[1]
    assert found.speed_px_s == pytest.approx(10 * px, rel=0.25)
    assert found.changed[200, 200]
    assert found.changed[5, 5] == (radius > 400)


@pytest.mark.parametrize("noise", [0.003, 0.03])
def test_noise_before_fine_detail_moves_nothing(noise: float) -> None:
    seen = glimpse(detail_plate(0, noise))
    found = motion_between(seen, glimpse(detail_plate(0, noise, number=1), seen.white))
    assert found is not None
    assert (found.share, found.speed_px_s) == (0, 0)
