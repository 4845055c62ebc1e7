"""The timing of a clip, found from its row profiles: against the virtual shoot's truth and another simulator's."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from memory_frame import MemoryFrame
from other_simulator import flashes_told, plan_and_frames

from psvideo.errors import PsvideoError, UsageError
from psvideo.formats.plan_toml import format_plan
from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan, PlannedFlash
from psvideo.model.rows.row_profiles import collect
from psvideo.model.rows.shutter import row_weights
from psvideo.model.timing import Timing
from psvideo.runs.sync import sync
from psvideo.sync.find import timing_from_rows
from psvideo.sync.rowfit import kernel
from psvideo.sync.rowfit.beat import Beat, FoundClock, train_between
from psvideo.sync.rowfit.compiled_profiles import unexplained
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.synth import Exposure, Noise, TrueClock, expose

PlanMaker = Callable[..., Plan]
CAMERA_NOISE = Noise(full_well_e=20_000, read_e=8)


def textured_plates(plan: Plan, seed: int = 3) -> dict[int, np.ndarray]:
    """Plates whose rows differ: noise under a gradient, with a black band that could pass for a dark row."""
    rng = np.random.default_rng(seed)
    camera = plan.camera
    shape = (camera.height_px, camera.width_px)
    plates = {slot: (0.1 + 0.6 * rng.random(shape)).astype(np.float32) for slot in plan.lit_slots}
    for plate in plates.values():
        plate[camera.height_px // 3 : camera.height_px // 3 + 6] *= 0.02
    return plates


def shoot(plan: Plan, *, frames: int = 60, phase_s: float = 0.0123, ppm: float = 30.0, **options: object) -> Exposure:
    clock = TrueClock(phase_s=phase_s, offset_ppm=ppm)
    options = {"noise": CAMERA_NOISE, "bits": 12} | options
    return expose(textured_plates(plan), plan, frames=frames, clock=clock, **options)  # type: ignore[arg-type]


def timing_of(plan: Plan, shot: Exposure, **options: str) -> Timing:
    indices, profiles = collect(MemoryFrame(n, image) for n, image in zip(shot.indices, shot.frames, strict=True))
    return timing_from_rows(plan, indices, profiles, **options)  # type: ignore[arg-type]


def errors_rows(timing: Timing, shot: Exposure) -> Doubles:
    """Return by how many rows every flash found is off the true flash nearest to it."""
    true_s = np.array([flash.start_s for flash in shot.flashes])
    nearest = np.abs(true_s[:, None] - timing.start_s).argmin(axis=0)
    off: Doubles = (timing.start_s - true_s[nearest]) / abs(timing.row_time_s)
    return off


def names_right(timing: Timing, shot: Exposure) -> bool:
    true_s = np.array([flash.start_s for flash in shot.flashes])
    nearest = np.abs(true_s[:, None] - timing.start_s).argmin(axis=0)
    return all(
        set(flash.lights) == set(shot.flashes[n].lights) for flash, n in zip(timing.flashes, nearest, strict=True)
    )


CASES: dict[str, tuple[dict[str, object], dict[str, object]]] = {
    "three lights and a dark slot": ({}, {}),
    "clocks 200 ppm apart": ({}, {"ppm": 200.0}),
    "the strobe slow by 200 ppm": ({}, {"ppm": -200.0}),
    "a dark slot in every fifth round": ({"dark_every": 5}, {"frames": 90}),
    "ambient light": ({}, {"ambient": 0.15}),
    "short flashes of five rows": ({"duration_s": 0.00035}, {}),
    "five lights": ({"lights": ("a", "b", "c", "d", "e")}, {"frames": 72}),
    "a short readout": ({"readout": 0.5}, {}),
    "bottom row first": ({"readout": -1.0}, {}),
    "half-rate": ({"mode": "half-rate"}, {}),
    "a dropped frame": ({}, {"dropped": (17, 18, 40)}),
}


@pytest.mark.parametrize("case", CASES)
def test_every_flash_is_found_to_a_twentieth_of_a_row_and_named(case: str, make_plan: PlanMaker) -> None:
    plan_options, shot_options = CASES[case]
    plan = make_plan(**plan_options)
    shot = shoot(plan, **shot_options)  # type: ignore[arg-type]
    timing = timing_of(plan, shot)
    assert np.sqrt(np.mean(errors_rows(timing, shot) ** 2)) < 0.05
    assert timing.order == "marker"
    assert names_right(timing, shot)
    assert timing.phase_error_rows < 0.05
    assert abs(timing.clock_offset_ppm - shot_options.get("ppm", 30.0)) < 1.5  # type: ignore[operator]


@pytest.mark.parametrize("phase", np.linspace(0.0, 1.0, 7, endpoint=False))
def test_the_start_phase_does_not_matter(phase: float, make_plan: PlanMaker) -> None:
    plan = make_plan()
    shot = shoot(plan, frames=32, phase_s=phase * plan.cycle_s)
    timing = timing_of(plan, shot)
    assert np.abs(errors_rows(timing, shot)).max() < 0.05
    assert names_right(timing, shot)


def test_the_flashes_listed_are_those_that_the_clip_saw_and_the_cut_ones_are_marked(make_plan: PlanMaker) -> None:
    plan = make_plan()
    shot = shoot(plan, frames=24)
    timing = timing_of(plan, shot)
    weights = row_weights(plan.camera, timing.start_s, timing.duration_s, frames=range(24))
    all_weights = row_weights(plan.camera, timing.start_s, timing.duration_s, frames=range(-3, 27))
    assert (weights.sum(axis=(1, 2)) > 0).all()
    whole = np.isclose(weights.sum(axis=1), all_weights.sum(axis=1), atol=1e-9).all(axis=1)
    assert [flash.complete for flash in timing.flashes] == whole.tolist()
    assert [flash.index for flash in timing.flashes] == list(range(len(timing.flashes)))


@pytest.mark.parametrize("clip", ["plain", "ambient"])
def test_the_clips_of_another_simulator_are_timed_and_named(clip: str, shared_data: Path) -> None:
    folder = shared_data / "clips" / clip
    plan, images = plan_and_frames(folder)
    profiles = np.array([image.mean(axis=(1, 2), dtype=np.float64) for image in images])
    timing = timing_from_rows(plan, np.arange(len(images)), profiles, clip=clip)
    truth = flashes_told(folder)
    assert [next(iter(flash.lights), None) for flash in timing.flashes] == [flash["light"] for flash in truth]
    assert [flash.complete for flash in timing.flashes] == [flash["complete"] for flash in truth]
    true_s = np.array([flash["start_s"] for flash in truth])
    assert np.sqrt(np.mean((timing.start_s - true_s) ** 2)) < 0.05 * timing.row_time_s
    assert timing.order == "marker"


@pytest.mark.parametrize("ambient", [pytest.param(0.0, marks=pytest.mark.campaign), 0.1])
def test_the_dark_slot_names_the_lights_where_no_row_opens_or_closes_during_a_flash(
    ambient: float, make_plan: PlanMaker
) -> None:
    plan = make_plan(shutter=0.8, readout=0.4, duration_s=0.0008)
    plan = replace(plan, dark_s=plan.camera.frame_period_s - 0.0008)
    shot = shoot(plan, phase_s=0.00525, ppm=0.0, ambient=ambient)
    timing = timing_of(plan, shot)
    assert any("no row opens or closes during a flash" in note for note in timing.notes)
    assert timing.order == "marker"
    assert names_right(timing, shot)


def test_without_a_marker_the_names_are_called_a_guess_until_they_are_given(make_plan: PlanMaker) -> None:
    plan = make_plan(dark=False)
    shot = shoot(plan)
    assert timing_of(plan, shot).order == "guess"
    latest_row_s = plan.camera.row_offsets_s().max()
    first = next(flash for flash in shot.flashes if flash.start_s >= latest_row_s)
    given = timing_of(plan, shot, first_light=next(iter(first.lights)))
    assert given.order == "given"
    assert names_right(given, shot)
    with pytest.raises(UsageError, match="no such flash in the plan; its flashes are"):
        timing_of(plan, shot, first_light="kee")


@pytest.mark.parametrize(
    ("dark", "first", "order"),
    [(False, None, "key left right"), (False, "left", "left right key"), (True, "right", "right - key left")],
)
def test_a_synced_clip_begins_with_the_light_that_is_named(
    dark: bool, first: str | None, order: str, make_plan: PlanMaker
) -> None:
    plan = make_plan(mode="synced", readout=0.0, dark=dark)
    names = list(plan.lights)
    timing = timing_from_rows(plan, np.arange(len(order.split())), np.zeros((4, 2)), first_light=first)
    assert ["+".join(flash.lit) or "-" for flash in timing.flashes] == order.split(), names


def test_of_a_synced_clip_only_frames_that_are_used_have_flashes(make_plan: PlanMaker) -> None:
    """Frames 4 to 11 without 6 and 7, as ``frames`` picks them: names, times and holes are those of these frames."""
    plan = make_plan(mode="synced", readout=0.0, dark=False)
    used = np.array([4, 5, 8, 9, 10, 11])
    timing = timing_from_rows(plan, used, np.zeros((6, 2)))
    period_s = plan.camera.frame_period_s
    assert [int(flash.start_s // period_s) for flash in timing.flashes] == list(range(4, 12))
    assert [flash.index for flash in timing.flashes] == list(range(8))
    assert [int(flash.start_s // period_s) for flash in timing.flashes if flash.complete] == used.tolist()
    assert [flash.slot for flash in timing.flashes] == [n % 3 for n in range(4, 12)]
    named = timing_from_rows(plan, used, np.zeros((6, 2)), first_light="right")
    assert [flash.lit[0] for flash in named.flashes[:3]] == ["right", "key", "left"]
    assert named.flashes[0].start_s == timing.flashes[0].start_s


def test_of_a_synced_clip_there_is_no_picture_to_draw(make_plan: PlanMaker, tmp_path: Path) -> None:
    plan = make_plan(mode="synced", readout=0.0, height_px=8, width_px=8)
    for number in range(4):
        cv2.imwrite(str(tmp_path / f"shot.{number:04d}.png"), np.full((8, 8, 3), 9000, np.uint16))
    (tmp_path / "plan.toml").write_text(format_plan(plan))
    with pytest.raises(UsageError, match="`picture`: there is nothing to draw of"):
        sync(tmp_path, out=tmp_path / "timing.json", picture=tmp_path / "found.png")
    assert not (tmp_path / "timing.json").exists()
    assert len(sync(tmp_path, out=tmp_path / "timing.json").flashes) == 4


def test_lights_that_flash_together_are_named_together(make_plan: PlanMaker) -> None:
    plan = make_plan(mode="synced", readout=0.0, dark=False)
    pair = replace(plan.flashes[1], lights={"left": 1.0, "right": 0.5})
    plan = replace(plan, flashes=(plan.flashes[0], pair, plan.flashes[2]))
    timing = timing_from_rows(plan, np.arange(3), np.zeros((3, 2)), first_light="right+left")
    assert timing.flashes[0].lit == ("left", "right")
    with pytest.raises(UsageError, match=r"its flashes are key, left\+right, right"):
        timing_from_rows(plan, np.arange(3), np.zeros((3, 2)), first_light="left")


@pytest.mark.parametrize("phase_s", [0.0002, 0.002, 0.006])
def test_below_360_degrees_the_first_light_is_the_first_complete_flashes(phase_s: float, make_plan: PlanMaker) -> None:
    plan = make_plan(shutter=0.5, readout=0.4, dark=False)
    shot = shoot(plan, phase_s=phase_s)
    first = next(flash for flash in shot.flashes if flash.complete)
    timing = timing_of(plan, shot, first_light="+".join(first.lit))
    assert next(flash for flash in timing.flashes if flash.complete).lit == first.lit
    assert names_right(timing, shot)


def test_a_first_light_that_the_marker_contradicts_is_refused(make_plan: PlanMaker) -> None:
    plan = make_plan()
    shot = shoot(plan)
    timing = timing_of(plan, shot)
    first = next(flash for flash in timing.flashes if flash.complete and flash.lights)
    wrong = next(light for light in plan.lights if light not in first.lights)
    with pytest.raises(PsvideoError, match="does not fit the footage"):
        timing_of(plan, shot, first_light=wrong)


def test_a_marker_that_the_clip_is_too_short_to_show_is_not_claimed(make_plan: PlanMaker) -> None:
    plan = make_plan(dark_every=20)
    shot = shoot(plan, frames=14, phase_s=-0.15)
    assert not any(not flash.lights for flash in shot.flashes if 0 < flash.start_s < 13 * plan.camera.frame_period_s)
    assert timing_of(plan, shot).order == "guess"


def test_one_longer_flash_is_a_marker_too(make_plan: PlanMaker) -> None:
    plan = make_plan(dark=False)
    longer = PlannedFlash(lights=plan.flashes[0].lights, duration_s=1.6 * plan.flashes[0].duration_s)
    plan = replace(plan, flashes=(longer, *plan.flashes[1:]))
    shot = shoot(plan)
    timing = timing_of(plan, shot)
    assert np.abs(errors_rows(timing, shot)).max() < 0.05
    assert timing.order == "marker"
    assert names_right(timing, shot)


def test_footage_that_is_not_strobed_is_not_timed(make_plan: PlanMaker) -> None:
    plan = make_plan()
    rng = np.random.default_rng(5)
    steady = 0.3 + 0.2 * rng.random(plan.camera.height_px) + 0.01 * rng.standard_normal((60, plan.camera.height_px))
    with pytest.raises(PsvideoError, match="no strobe like the plan's was found"):
        timing_from_rows(plan, np.arange(60), steady)


def test_pictures_of_one_row_are_not_timed(make_plan: PlanMaker) -> None:
    plan = make_plan(height_px=1)
    with pytest.raises(PsvideoError, match=r"1 row high.*expected 2 rows at least"):
        timing_from_rows(plan, np.arange(60), np.random.default_rng(1).random((60, 1)))


def test_another_plans_footage_is_not_timed(make_plan: PlanMaker) -> None:
    shot = shoot(make_plan(duration_s=0.0008))
    with pytest.raises(PsvideoError, match="no strobe like the plan's was found"):
        timing_of(make_plan(duration_s=0.002), shot)


def test_synced_footage_has_one_flash_a_frame_in_the_plans_order(make_plan: PlanMaker) -> None:
    plan = make_plan(mode="synced", readout=0.7)
    timing = timing_from_rows(plan, np.arange(8), np.zeros((8, plan.camera.height_px)))
    assert [flash.slot for flash in timing.flashes] == [0, 1, 2, 3, 0, 1, 2, 3]
    camera = replace(plan.camera, readout_s=timing.row_time_s * plan.camera.height_px)
    weights = row_weights(camera, timing.start_s, timing.duration_s, frames=range(8))
    np.testing.assert_allclose(weights, np.broadcast_to(np.eye(8)[:, :, None], weights.shape), atol=1e-9)


@pytest.mark.parametrize("readout", [-1.0, 0.0, 0.4, 1.0])
@pytest.mark.parametrize("shutter", [0.5, 1.0])
def test_the_fit_uses_exactly_the_row_weights(readout: float, shutter: float, make_plan: PlanMaker) -> None:
    """What the fit leaves equals what plain least squares with the shared model's weights leaves, row by row."""
    plan = make_plan(readout=readout, shutter=shutter, height_px=9)
    camera = plan.camera
    clock = FoundClock(phase_s=0.3 * plan.cycle_s, offset_ppm=700.0)
    values = np.random.default_rng(1).random((24, camera.height_px))
    rows = Profiles(
        value=values,
        index=np.arange(24),
        period_s=camera.frame_period_s,
        place=np.arange(9.0) if readout >= 0 else 8.0 - np.arange(9.0),
        window_start=np.array([0, 12]),
    )
    rest = unexplained(plan, rows, Beat(clock=clock, row_time_s=abs(camera.row_time_s), exposure_s=camera.exposure_s))
    train = train_between(plan, clock, 0.0, 26 * camera.frame_period_s)
    unknown = np.array([1, 2, 3, 0])[train.slot]
    weights = row_weights(camera, train.start_s, train.duration_s, frames=range(24))
    for row in range(camera.height_px):
        lit = [weights[unknown == number, :, row].sum(axis=0) for number in (1, 2, 3)]
        design = np.stack([np.ones(24), *lit], axis=1)
        for window in (slice(0, 12), slice(12, 24)):
            plain = design[window] @ np.linalg.lstsq(design[window], values[window, row], rcond=None)[0]
            np.testing.assert_allclose(rest[window, row], values[window, row] - plain, atol=1e-3)


def test_brightnesses_of_many_lights_stay_as_sparse_as_what_frames_share() -> None:
    """A flash shares frames with its neighbours in the cycle and with the room; its factor held a number for all."""
    lights, frames = 40, 100
    rng = np.random.default_rng(1)
    design = np.zeros((frames, lights + 1))
    design[:, 0] = 1.0
    for n in range(frames):
        for m in range(2):
            design[n, 1 + (n + m) % lights] = rng.random()
    value, normal, right = rng.random(frames), np.empty((lights + 1, lights + 1)), np.empty(lights + 1)
    kernel.fit_window(value, np.ones(frames), design, 0, frames, normal, right)
    factor = np.tril(normal)
    np.testing.assert_allclose(right, np.linalg.lstsq(design, value, rcond=None)[0], atol=1e-3)
    np.testing.assert_allclose(factor.T @ factor, design.T @ design, rtol=1e-5, atol=1e-9)
    assert np.count_nonzero(factor) < 5 * (lights + 1)
