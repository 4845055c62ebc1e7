"""Rolling-flash reconstruction: plates against the virtual shoot's truth and a least-squares oracle."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from memory_frame import MemoryFrame
from other_simulator import flashes_told, plan_and_frames
from true_timing import true_timing

from psvideo.model.plan import Plan, PlannedFlash
from psvideo.model.rows.row_profiles import collect
from psvideo.model.rows.shutter import frames_touched, row_weights
from psvideo.model.timing import Timing
from psvideo.plates import hudon2015
from psvideo.plates.ambient import ambient_off
from psvideo.plates.sequence import Round, coming, gathered, light_plates
from psvideo.plates.split import Plate, split
from psvideo.sync.find import timing_from_rows
from psvideo.synth import Exposure, Noise, TrueClock, expose

PlanMaker = Callable[..., Plan]


def frames_of(shot: Exposure) -> Iterator[MemoryFrame]:
    return (MemoryFrame(n, image) for n, image in zip(shot.indices, shot.frames, strict=True))


def without_ambient(plates: Iterable[Plate]) -> Iterator[Plate]:
    held = list(plates)
    return ambient_off.subtract(held, darks=[plate for plate in held if not plate.flash.lights])


def rounds_of(plates: Iterable[Plate], plan: Plan, timing: Timing) -> list[Round]:
    """All rounds of the plates of single flashes, as far as they are complete."""
    expected = coming(plan, timing.flashes)
    return list(gathered(light_plates(plates, plan, timing.flashes), plan.lights, expected=expected.__getitem__))


def plates_for(plan: Plan, *, colour: bool = False, seed: int = 3) -> dict[int, np.ndarray]:
    rng = np.random.default_rng(seed)
    shape = (plan.camera.height_px, plan.camera.width_px) + ((3,) if colour else ())
    return {slot: (0.05 + 0.6 * rng.random(shape)).astype(np.float32) for slot in plan.lit_slots}


def shoot(plan: Plan, plates: dict[int, np.ndarray], *, frames: int = 40, **options: object) -> tuple[Exposure, Timing]:
    shot = expose(plates, plan, frames=frames, clock=TrueClock(phase_s=0.0123, offset_ppm=30.0), **options)  # type: ignore[arg-type]
    return shot, true_timing(plan, shot.flashes, frames=frames)


def relative_rms(plates: list[Plate], truth: dict[int, np.ndarray]) -> float:
    """Return the RMS error of lit plates as a share of the truth's RMS."""
    lit = [plate for plate in plates if plate.flash.lights]
    error = np.mean([np.mean((plate.image - truth[plate.flash.slot]) ** 2) for plate in lit])
    return float(np.sqrt(error / np.mean([np.mean(truth[plate.flash.slot] ** 2) for plate in lit])))


CASES: dict[str, dict[str, object]] = {
    "readout as long as the frame": {},
    "short readout": {"readout": 0.3},
    "global shutter": {"readout": 0.0},
    "bottom row first": {"readout": -1.0},
    "half-rate": {"mode": "half-rate"},
    "long flashes over three frames": {"duration_s": 0.004},
    "dark slots every third round": {"dark_every": 3},
}


@pytest.mark.parametrize("colour", [False, True], ids=["grey", "colour"])
@pytest.mark.parametrize("case", CASES)
def test_without_noise_every_plate_is_the_truth(case: str, colour: bool, make_plan: PlanMaker) -> None:
    plan = make_plan(**CASES[case])
    truth = plates_for(plan, colour=colour)
    shot, timing = shoot(plan, truth)
    plates = list(split(frames_of(shot), plan.camera, timing))
    assert [plate.flash.index for plate in plates] == [flash.index for flash in timing.flashes if flash.complete]
    assert len(plates) > 8
    assert relative_rms(plates, truth) < 1e-3
    assert all(plate.seen.all() for plate in plates)
    for dark in (plate for plate in plates if not plate.flash.lights):
        assert np.abs(dark.image).max() < 1e-5


def test_three_frame_flashes_were_among_them(make_plan: PlanMaker) -> None:
    plan = make_plan(duration_s=0.004)
    _, timing = shoot(plan, plates_for(plan))
    first, last = frames_touched(plan.camera, timing.start_s, timing.duration_s)
    assert (last - first == 2).any()


@pytest.mark.parametrize("readout", [1.0, 0.4])
def test_with_noise_it_is_as_good_as_least_squares_with_all_frames(readout: float, make_plan: PlanMaker) -> None:
    plan = make_plan(readout=readout, dark=False)
    truth = plates_for(plan)
    shot, timing = shoot(plan, truth, noise=Noise(full_well_e=20_000, read_e=12))
    plates = list(split(frames_of(shot), plan.camera, timing))
    weights = row_weights(plan.camera, timing.start_s, timing.duration_s, frames=range(len(shot.frames)))
    oracle = []
    for row in range(plan.camera.height_px):
        solved = np.linalg.lstsq(weights[:, :, row].T, shot.frames[:, row].astype(np.float64), rcond=None)[0]
        oracle.append([np.mean((solved[p.flash.index] - truth[p.flash.slot][row]) ** 2) for p in plates])
    ours = np.mean([np.mean((plate.image - truth[plate.flash.slot]) ** 2) for plate in plates])
    assert np.sqrt(ours / np.mean(oracle)) < 1.05


def test_rows_that_two_frames_share_are_no_worse_than_whole_ones_without_noise(make_plan: PlanMaker) -> None:
    plan = make_plan()
    truth = plates_for(plan)
    shot, timing = shoot(plan, truth)
    for plate in split(frames_of(shot), plan.camera, timing):
        if plate.flash.lights:
            assert np.abs(plate.image - truth[plate.flash.slot]).max() < 1e-5


def test_below_360_degrees_plates_are_divided_by_what_rows_saw_and_the_rest_is_marked(make_plan: PlanMaker) -> None:
    plan = make_plan(shutter=0.5)
    truth = plates_for(plan)
    shot, timing = shoot(plan, truth)
    plates = list(split(frames_of(shot), plan.camera, timing))
    weights = row_weights(plan.camera, timing.start_s, timing.duration_s, frames=range(len(shot.frames)))
    for plate in plates:
        if plate.flash.lights:
            share = weights[plate.flash.index].sum(axis=0)
            assert (plate.seen == (share >= 0.12)).all()
            assert np.abs(plate.image - truth[plate.flash.slot])[plate.seen].max() < 2e-5
            assert not plate.image[~plate.seen].any()
    assert not all(plate.seen.all() for plate in plates)


def test_flashes_between_two_exposures_of_all_rows_give_plates_of_no_rows_where_these_are_wanted(
    make_plan: PlanMaker,
) -> None:
    plan = make_plan(shutter=0.25, readout=0.25)
    shot, timing = shoot(plan, plates_for(plan))
    seen, wanted = (list(split(frames_of(shot), plan.camera, timing, unseen=unseen)) for unseen in (False, True))
    complete = [flash.index for flash in timing.flashes if flash.complete]
    assert [plate.flash.index for plate in wanted] == complete
    assert len(complete) > 1.3 * len(seen)
    missed = [plate for plate in wanted if not plate.seen.any()]
    assert {plate.flash.index for plate in missed} >= set(complete) - {plate.flash.index for plate in seen}
    assert all(not plate.image.any() and not plate.exposures.any() for plate in missed)


def test_a_dropped_frame_leaves_rows_unseen_and_the_rest_whole(make_plan: PlanMaker) -> None:
    plan = make_plan()
    truth = plates_for(plan)
    shot, timing = shoot(plan, truth, dropped=(11,))
    plates = list(split(frames_of(shot), plan.camera, timing))
    torn = [plate for plate in plates if not plate.seen.all()]
    assert 1 <= len(torn) <= 3
    for plate in plates:
        if plate.flash.lights:
            assert np.abs(plate.image - truth[plate.flash.slot])[plate.seen].max(initial=0) < 2e-2


@pytest.mark.parametrize(("short_s", "all_seen"), [(0.0003, True), (0.0012, False)])
def test_rows_that_hold_two_flashes_are_rebuilt_from_other_frames_or_marked(
    short_s: float, all_seen: bool, make_plan: PlanMaker
) -> None:
    plan = make_plan(dark=False)
    plan = replace(plan, dark_s=plan.dark_s - short_s)
    truth = plates_for(plan)
    shot, timing = shoot(plan, truth)
    plates = list(split(frames_of(shot), plan.camera, timing))
    assert all(plate.seen.all() for plate in plates) == all_seen
    for plate in plates:
        assert np.abs(plate.image - truth[plate.flash.slot])[plate.seen].max() < 0.02


def test_what_is_clipped_in_a_frame_stays_at_one_in_the_plate(make_plan: PlanMaker) -> None:
    plan = make_plan()
    truth = plates_for(plan)
    for picture in truth.values():
        picture[:, :5] = 1.7
    shot, timing = shoot(plan, truth, ambient=0.05)
    plates = without_ambient(split(frames_of(shot), plan.camera, timing))
    for plate in plates:
        if plate.flash.lights:
            whole = row_weights(
                plan.camera, np.array([plate.flash.start_s]), np.array([plate.flash.duration_s]), frames=range(40)
            )
            assert (plate.image[whole[0].max(axis=0) > 0.999, :5] >= 1.0).all()


def test_ambient_light_is_taken_off_before_rows_are_summed(make_plan: PlanMaker) -> None:
    plan = make_plan()
    truth = plates_for(plan)
    shot, timing = shoot(plan, truth, ambient=0.1)
    plates = list(without_ambient(split(frames_of(shot), plan.camera, timing)))
    first_dark = next(n for n, plate in enumerate(plates) if not plate.flash.lights)
    assert relative_rms(plates[first_dark:], truth) < 1e-3
    assert np.abs(plates[first_dark].image - 0.1).max() < 1e-4


def test_rows_of_a_dark_slot_that_no_frame_saw_do_not_pass_for_darkness(make_plan: PlanMaker) -> None:
    plan = make_plan()
    truth = plates_for(plan)
    shot, timing = shoot(plan, truth, ambient=0.2, dropped=(13, 14))
    for plate in without_ambient(split(frames_of(shot), plan.camera, timing)):
        if plate.flash.lights and plate.flash.index > 4:
            assert np.abs(plate.image - truth[plate.flash.slot])[plate.seen].max(initial=0) < 2e-2


def test_a_flash_that_no_frame_saw_gives_no_plate(make_plan: PlanMaker) -> None:
    plan = make_plan(readout=0.0)
    shot, timing = shoot(plan, plates_for(plan, colour=True), dropped=(10, 11))
    plates = list(split(frames_of(shot), plan.camera, timing))
    assert len(plates) < sum(flash.complete for flash in timing.flashes)
    assert {plate.image.ndim for plate in plates} == {3}


def test_algorithm_1_is_exact_on_a_clean_clip_until_its_dark_row_leaves_the_picture(make_plan: PlanMaker) -> None:
    plan = make_plan(dark=False)
    plan = replace(plan, dark_s=plan.camera.exposure_s)
    truth = plates_for(plan)
    shot, timing = shoot(plan, truth)
    moves = timing.duration_s[0] / plan.camera.row_time_s
    dark_row = (shot.flashes[1].start_s + timing.duration_s[0]) / plan.camera.row_time_s % plan.camera.height_px
    until = int((plan.camera.height_px - dark_row) / moves) - 2
    plates = list(hudon2015.split(frames_of(shot), plan.camera, timing))
    assert relative_rms(plates[: until - 1], truth) < 0.03
    assert relative_rms(plates, truth) > 0.2


def test_algorithm_1_fails_where_the_readout_is_short_and_the_weights_do_not(make_plan: PlanMaker) -> None:
    plan = make_plan(dark=False, readout=0.5)
    truth = plates_for(plan)
    shot, timing = shoot(plan, truth)
    assert relative_rms(list(hudon2015.split(frames_of(shot), plan.camera, timing)), truth) > 0.3
    assert relative_rms(list(split(frames_of(shot), plan.camera, timing)), truth) < 1e-3


@pytest.mark.parametrize("clip", ["plain", "ambient"])
def test_the_clips_of_another_simulator_give_its_true_plates(clip: str, shared_data: Path) -> None:
    folder = shared_data / "clips" / clip
    plan, images = plan_and_frames(folder)
    frames = [MemoryFrame(n, image) for n, image in enumerate(images)]
    timing = timing_from_rows(plan, *collect(frames))
    plates = list(split(iter(frames), plan.camera, timing))
    plates = list(without_ambient(plates))
    truth = flashes_told(folder)
    compared = 0
    for plate in plates:
        if "plate" in truth[plate.flash.index]:
            true = OpenEXR.File(str(folder / "truth" / truth[plate.flash.index]["plate"])).channels()["RGB"].pixels
            assert np.sqrt(np.mean((plate.image - true) ** 2)) < 0.006
            assert np.abs((plate.image - true).mean(axis=(1, 2))).max() < 0.002
            compared += 1
    assert compared == 5


def lit(plan: Plan, *flashes: dict[str, float]) -> Plan:
    return replace(plan, flashes=tuple(PlannedFlash(lights=lights, duration_s=0.0008) for lights in flashes))


def test_patterns_of_several_lights_are_taken_apart(make_plan: PlanMaker) -> None:
    plan = lit(make_plan(), {"a": 1.0, "b": 1.0}, {"b": 1.0, "c": 1.0}, {"a": 1.0, "c": 1.0}, {})
    rng = np.random.default_rng(2)
    lights = {
        name: (0.3 * rng.random((plan.camera.height_px, plan.camera.width_px))).astype(np.float32) for name in "abc"
    }
    truth = {slot: sum(lights[name] for name in plan.flashes[slot].lights) for slot in plan.lit_slots}
    shot, timing = shoot(plan, truth)  # type: ignore[arg-type]
    whole = rounds_of(split(frames_of(shot), plan.camera, timing), plan, timing)
    assert len(whole) >= 5
    for one in whole[1:-1]:
        assert one.lights == ("a", "b", "c")
        for plate in one.plates:
            np.testing.assert_allclose(plate.image, lights[plate.light], atol=1e-4)


def test_rounds_are_numbered_from_the_first_with_a_complete_flash_and_hold_each_light_once(
    make_plan: PlanMaker,
) -> None:
    plan = make_plan(dark_every=3)
    truth = plates_for(plan)
    shot, timing = shoot(plan, truth, frames=60)
    gathered = rounds_of(split(frames_of(shot), plan.camera, timing), plan, timing)
    numbers = [one.number for one in gathered]
    assert numbers == list(range(1001, 1001 + len(numbers)))
    assert all(one.lights == plan.lights for one in gathered[1:-1])
    assert sum(one.ambient is not None for one in gathered) in (len(gathered) // 3, len(gathered) // 3 + 1)
    times = [plate.time_s for one in gathered for plate in one.plates]
    assert times == sorted(times)


def test_a_light_flashed_at_half_power_is_delivered_at_full_power(make_plan: PlanMaker) -> None:
    plan = lit(make_plan(), {"a": 0.5}, {"b": 1.0}, {"c": 1.0}, {})
    truth = plates_for(plan)
    shot, timing = shoot(plan, truth)
    gathered = rounds_of(split(frames_of(shot), plan.camera, timing), plan, timing)
    np.testing.assert_allclose(gathered[2].plates[0].image, 2 * truth[0], atol=1e-4)


def hdr(plan: Plan) -> Plan:
    """Light a at full power and, four times as short, at half of it: an eighth of the light; then b and c."""
    long_s, short_s = 0.0008, 0.0002
    lights = [({"a": 1.0}, long_s), ({"a": 0.5}, short_s), ({"b": 1.0}, long_s), ({"c": 1.0}, long_s), ({}, long_s)]
    return replace(plan, flashes=tuple(PlannedFlash(lights=names, duration_s=s) for names, s in lights))


def test_hdr_flashes_of_one_light_are_merged_without_what_is_clipped(make_plan: PlanMaker) -> None:
    plan = hdr(make_plan())
    rng = np.random.default_rng(4)
    shape = (plan.camera.height_px, plan.camera.width_px)
    scene = (0.02 + 3.0 * rng.random(shape)).astype(np.float32)
    other = np.full(shape, 0.3, np.float32)
    shot, timing = shoot(plan, {0: scene, 1: scene / 8, 2: other, 3: other})
    plates = without_ambient(split(frames_of(shot), plan.camera, timing))
    one = rounds_of(plates, plan, timing)[2]
    merged = one.plates[0]
    assert merged.light == "a"
    assert merged.saturation == pytest.approx(8.0)
    assert np.abs(merged.image / scene - 1).max() < 1e-3
    assert (merged.image > 1.5).any()


def test_merging_is_as_good_as_the_best_of_the_exposures(make_plan: PlanMaker) -> None:
    plan = hdr(make_plan())
    shape = (plan.camera.height_px, plan.camera.width_px)
    scene = np.full(shape, 0.6, np.float32)
    other = np.full(shape, 0.3, np.float32)
    noise = Noise(full_well_e=20_000, read_e=0)
    shot, timing = shoot(plan, {0: scene, 1: scene / 8, 2: other, 3: other}, noise=noise)
    rounds = rounds_of(split(frames_of(shot), plan.camera, timing), plan, timing)[1:-1]
    error = np.std([one.plates[0].image - scene for one in rounds])
    assert error < 1.02 * np.sqrt(0.6 / 20_000 / (1 + 1 / 8))


def test_what_is_clipped_in_every_exposure_is_held_at_the_weakest_ones_limit(make_plan: PlanMaker) -> None:
    plan = hdr(make_plan())
    shape = (plan.camera.height_px, plan.camera.width_px)
    bright, other = np.full(shape, 20.0, np.float32), np.full(shape, 0.3, np.float32)
    shot, timing = shoot(plan, {0: bright, 1: bright / 8, 2: other, 3: other})
    plates = without_ambient(split(frames_of(shot), plan.camera, timing))
    one = rounds_of(plates, plan, timing)[2]
    assert (one.plates[0].image[5:-5] >= one.plates[0].saturation).mean() > 0.8
