"""Timing found where something is wrong with the clip: every disturbance that the fit knows, one at a time."""

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from memory_frame import MemoryFrame

from psvideo.errors import PsvideoError
from psvideo.formats.exr_files import write_exr
from psvideo.formats.plan_toml import format_plan
from psvideo.formats.timing_json import format_timing, parse_timing, read_timing, timing_record
from psvideo.model.plan import Plan, PlannedFlash
from psvideo.model.rows.ripple import Exposures
from psvideo.model.rows.row_profiles import collect_with_doubt
from psvideo.model.timing import DroppedFrames, Timing, places_in_time
from psvideo.plates.gather import gather
from psvideo.sync.find import timing_from_rows
from psvideo.sync.open_take import open_take
from psvideo.sync.rowfit.beat import FoundClock
from psvideo.sync.take_timing import find_timing
from psvideo.sync.verdict.remarks import OF_MISNAMED_PPM
from psvideo.synth import Exposure, MainsSwing, Noise, TrueClock, TrueFlash, expose

PlanMaker = Callable[..., Plan]


NOISE = Noise(full_well_e=20_000, read_e=8)
ROWS, COLUMNS = 96, 12


def plates(plan: Plan, seed: int = 3, bright: float = 1.0) -> dict[int, np.ndarray]:
    """One picture a slot: noise under a gradient, in proportion to the flash's length and powers."""
    rng = np.random.default_rng(seed)
    shape = (plan.camera.height_px, plan.camera.width_px)
    pictures = {name: bright * (0.2 + 0.5 * rng.random(shape)) for name in plan.lights}
    longest_s = max(flash.duration_s for flash in plan.flashes)
    return {
        slot: np.asarray(
            sum(power * pictures[name] for name, power in plan.flashes[slot].lights.items())
            * (plan.flashes[slot].duration_s / longest_s),
            np.float32,
        )
        for slot in plan.lit_slots
    }


def shoot(plan: Plan, *, frames: int = 72, ppm: float = 30.0, drift: float = 0.0, **options: Any) -> Exposure:
    clock = TrueClock(
        phase_s=0.0123, offset_ppm=ppm, drift_ppm_per_s=drift, jitter_s=float(options.pop("jitter_s", 0.0))
    )
    scene = options.pop("scene", None) or plates(plan)
    asked: dict[str, Any] = {"noise": NOISE, "bits": 12} | options
    return expose(scene, plan, frames=frames, clock=clock, **asked)


def timing_of(plan: Plan, shot: Exposure, *, indices: object = None, **options: object) -> Timing:
    """Time the shot by its frames' true indices, unless others are said."""
    said = np.arange(len(shot.frames)) if indices is None else np.asarray(indices)
    return timing_from_rows(plan, said, shot.frames.mean(axis=2, dtype=np.float64), **options)  # type: ignore[arg-type]


def rms_rows(timing: Timing, shot: Exposure, plan: Plan, scale: float = 1.0) -> float:
    """Return the RMS distance of every flash found from the nearest true flash with the same lights, in true rows."""
    error_s = []
    for flash in timing.flashes:
        alike = [true.start_s * scale for true in shot.flashes if dict(true.lights) == dict(flash.lights)]
        error_s.append(np.abs(np.array(alike) - flash.start_s).min())
    row_s = abs(plan.camera.row_time_s) or plan.camera.frame_period_s / plan.camera.height_px
    return float(np.sqrt(np.mean(np.square(error_s)))) / row_s


@pytest.fixture
def plan(make_plan: PlanMaker) -> Plan:
    return make_plan(height_px=ROWS, width_px=COLUMNS)


def unknown_readout(plan: Plan) -> Plan:
    return replace(plan, camera=replace(plan.camera, readout_s=None))


@pytest.mark.parametrize("readout", [1.0, 0.35, 0.0, -0.7])
def test_an_unknown_readout_is_found_with_its_direction(readout: float, make_plan: PlanMaker) -> None:
    plan = make_plan(height_px=ROWS, width_px=COLUMNS, readout=readout)
    shot = shoot(plan)
    timing = timing_of(unknown_readout(plan), shot)
    assert rms_rows(timing, shot, plan) < 0.05
    assert timing.row_time_s * ROWS == pytest.approx(plan.camera.readout_s, abs=1e-3 * plan.camera.frame_period_s)
    assert timing.order == "marker"


@pytest.mark.parametrize("error", [0.97, 1.002])
def test_an_exposure_that_is_only_nominal_is_refined(error: float, make_plan: PlanMaker) -> None:
    plan = make_plan(height_px=ROWS, width_px=COLUMNS, shutter=0.5, readout=0.6)
    shot = shoot(plan)
    nominal = replace(plan, camera=replace(plan.camera, exposure_s=error * plan.camera.exposure_s))
    timing = timing_of(nominal, shot)
    assert rms_rows(timing, shot, plan) < 0.05
    assert timing.exposure_s == pytest.approx(plan.camera.exposure_s, rel=1e-4)


def test_a_published_readout_that_is_slightly_wrong_is_corrected(plan: Plan) -> None:
    shot = shoot(plan)
    published = replace(plan, camera=replace(plan.camera, readout_s=0.99 * (plan.camera.readout_s or 0.0)))
    timing = timing_of(published, shot)
    assert rms_rows(timing, shot, plan) < 0.05
    assert timing.row_time_s == pytest.approx(plan.camera.row_time_s, rel=1e-3)


@pytest.mark.parametrize("ppm", [9900.0, -9900.0])
def test_clocks_of_unknown_tolerance_are_found(ppm: float, make_plan: PlanMaker) -> None:
    plan = replace(make_plan(height_px=ROWS, width_px=COLUMNS, clock_tolerance_ppm=10_000), clock_tolerance_ppm=None)
    shot = shoot(plan, ppm=ppm)
    timing = timing_of(plan, shot)
    assert rms_rows(timing, shot, plan) < 0.05
    assert timing.clock_offset_ppm == pytest.approx(ppm, abs=1.0)


@pytest.mark.parametrize(("drift", "bar"), [(20.0, 0.05), (4.0, 0.01)])
def test_a_clock_that_drifts_is_followed(drift: float, bar: float, plan: Plan) -> None:
    shot = shoot(plan, frames=400, ppm=100.0, drift=drift)
    timing = timing_of(plan, shot)
    assert rms_rows(timing, shot, plan) < bar
    assert timing.phase_error_rows < bar


def test_a_clock_that_runs_straight_stays_straight(plan: Plan) -> None:
    timing = timing_of(plan, shoot(plan, frames=150))
    gaps_s = np.diff([flash.start_s for flash in timing.flashes])
    assert np.ptp(gaps_s) < 1e-12


def test_a_misnamed_frame_rate_is_found_and_said(make_plan: PlanMaker) -> None:
    plan = make_plan(height_px=ROWS, width_px=COLUMNS, duration_s=0.00025, clock_tolerance_ppm=50)
    shot = shoot(plan)
    misnamed = replace(plan, camera=replace(plan.camera, fps=Fraction(120)))
    timing = timing_of(misnamed, shot)
    assert rms_rows(timing, shot, plan, scale=1 / 1.001) < 0.05
    assert timing.frame_period_s == 1 / 120
    assert any("misnamed by 1.001" in note for note in timing.notes)
    assert not timing_of(plan, shot).notes


def test_a_misnamed_rate_is_recognised_by_what_it_makes_of_the_strobes_period() -> None:
    """A strobe of 12.5 ms spans 12.5e-3 * (true rate) frames, which the plan's rate takes for other seconds."""
    exact, broadcast = Fraction(120), Fraction(120000, 1001)
    for ppm, (true_fps, named_fps) in zip(OF_MISNAMED_PPM, ((broadcast, exact), (exact, broadcast)), strict=True):
        seen_s = Fraction(125, 10000) * true_fps / named_fps
        assert ppm == pytest.approx(float(1e6 * (seen_s / Fraction(125, 10000) - 1)), abs=1e-6)


@pytest.mark.parametrize("hz", [100.0, 120.0])
def test_flickering_ambient_light_is_separated_from_the_strobe(hz: float, make_plan: PlanMaker) -> None:
    plan = make_plan(height_px=ROWS, width_px=COLUMNS, shutter=0.5, readout=0.6, fps=Fraction(90))
    shot = shoot(plan, ambient=0.15, mains=MainsSwing(hz=hz, depth=0.8))
    timing = timing_of(plan, shot)
    assert rms_rows(timing, shot, plan) < 0.02
    times_s = np.linspace(0, 1, 50)
    true = MainsSwing(hz=hz, depth=0.8).mean(times_s, plan.camera.exposure_s)
    middles_s = times_s[None] + plan.camera.exposure_s / 2
    assert timing.mains is not None
    found = timing.mains.swing(Exposures(shares=np.ones((1, 50)), middles_s=middles_s))
    assert np.sqrt(np.mean((found - true) ** 2)) < 0.02
    assert parse_timing(timing_record(timing), source="") == timing
    assert timing_of(plan, shoot(plan, ambient=0.15)).mains is None


def test_mains_that_run_a_little_fast_are_followed_through_the_clip(make_plan: PlanMaker) -> None:
    plan = make_plan(height_px=ROWS, width_px=COLUMNS, shutter=0.5, readout=0.6, fps=Fraction(90))
    timing = timing_of(plan, shoot(plan, frames=240, ambient=0.15, mains=MainsSwing(hz=100.15, depth=0.8)))
    assert timing.mains is not None
    assert timing.mains.hz == pytest.approx(100.15, abs=0.02)


def test_tails_that_the_plan_does_not_give_are_found(plan: Plan) -> None:
    slow = replace(plan, rise_s=2e-5, fall_s=8e-5)
    shot = shoot(slow)
    timing = timing_of(plan, shot)
    assert rms_rows(timing, shot, plan) < 0.3
    assert any("LEDs" in note for note in timing.notes)


def test_a_rise_and_a_fall_that_are_alike_are_found_though_no_flash_seems_longer(make_plan: PlanMaker) -> None:
    plan = make_plan(height_px=160, width_px=COLUMNS)
    slow = replace(plan, rise_s=2e-5, fall_s=2e-5)
    shot = shoot(slow)
    assert rms_rows(timing_of(slow, shot), shot, plan) < 0.02
    timing = timing_of(plan, shot)
    assert rms_rows(timing, shot, plan) < 0.02
    assert [timing.rise_s, timing.fall_s] == pytest.approx([2e-5, 2e-5], rel=0.1)


@pytest.mark.parametrize(("rise_s", "fall_s"), [(2e-5, 6e-5)])
def test_tails_far_shorter_than_the_time_from_row_to_row_are_found(
    rise_s: float, fall_s: float, make_plan: PlanMaker
) -> None:
    """A blur that reached only as far as these tails stood for them: all flashes were 25 us late, and 5 us claimed."""
    plan = make_plan(height_px=48, width_px=COLUMNS, fps=Fraction(30))
    assert max(rise_s, fall_s) < 0.1 * plan.camera.row_time_s
    shot = shoot(replace(plan, rise_s=rise_s, fall_s=fall_s), frames=120)
    timing = timing_of(plan, shot)
    assert [timing.rise_s, timing.fall_s] == pytest.approx([rise_s, fall_s], rel=0.15)
    assert rms_rows(timing, shot, plan) < 3 * timing.phase_error_rows < 0.02


@pytest.mark.parametrize("share", [0.01, 0.03])
def test_a_blur_between_rows_that_are_far_apart_in_time_is_not_taken_for_tails(
    share: float, make_plan: PlanMaker
) -> None:
    plan = make_plan(height_px=48, width_px=COLUMNS, fps=Fraction(30))
    shot = shoot(plan, frames=120)
    profiles = shot.frames.mean(axis=2, dtype=np.float64)
    padded = np.pad(profiles, ((0, 0), (1, 1)), mode="edge")
    blurred = (1 - 2 * share) * profiles + share * (padded[:, :-2] + padded[:, 2:])
    timing = timing_from_rows(plan, np.arange(len(profiles)), blurred)
    assert (timing.rise_s, timing.fall_s) == (0.0, 0.0)
    assert rms_rows(timing, shot, plan) < 0.02


def test_rows_that_are_blurred_are_not_taken_for_tails(plan: Plan) -> None:
    shot = shoot(plan)
    profiles = shot.frames.mean(axis=2, dtype=np.float64)
    padded = np.pad(profiles, ((0, 0), (1, 1)), mode="edge")
    timing = timing_from_rows(
        plan, np.arange(len(profiles)), 0.25 * padded[:, :-2] + 0.5 * profiles + 0.25 * padded[:, 2:]
    )
    assert (timing.rise_s, timing.fall_s) == (0.0, 0.0)
    assert rms_rows(timing, shot, plan) < 0.05


def test_flashes_that_stray_in_a_short_clip_are_followed_and_what_is_left_is_claimed(make_plan: PlanMaker) -> None:
    plan = make_plan(height_px=ROWS, width_px=COLUMNS)
    row_s = plan.camera.row_time_s
    shot = shoot(plan, frames=36, jitter_s=row_s)
    timing = timing_of(plan, shot)
    lit = [flash for flash in timing.flashes if flash.complete and flash.lights]
    true_s = np.array([flash.start_s for flash in shot.flashes])
    off_s = np.array([np.abs(true_s - flash.start_s).min() for flash in lit])
    assert np.sqrt(np.mean(off_s**2)) < 2 * timing.phase_error_rows * row_s
    assert np.median(off_s) < 0.1 * row_s


def test_flashes_that_stray_are_followed_one_by_one(make_plan: PlanMaker) -> None:
    plan = make_plan(height_px=ROWS, width_px=COLUMNS, dark=False)
    shot = shoot(plan, jitter_s=1e-5)
    timing = timing_of(plan, shot)
    inside = [f for f in timing.flashes if f.complete]
    true_s = np.array([flash.start_s for flash in shot.flashes])
    error_s = np.array([np.abs(true_s - flash.start_s).min() for flash in inside])
    assert np.sqrt(np.mean(error_s**2)) < 0.4e-5
    assert timing.phase_error_rows * timing.row_time_s < 1e-5


def test_flashes_that_stray_are_followed_where_few_rows_open_and_close_during_the_same_flash(
    make_plan: PlanMaker,
) -> None:
    plan = make_plan(height_px=96, width_px=COLUMNS, shutter=0.52, readout=0.55, duration_s=0.001)
    row_s = plan.camera.row_time_s
    ends = np.ones((96, 1), np.float32)
    ends[:14] = ends[-14:] = 0.04
    dim = {slot: plate * ends for slot, plate in plates(plan).items()}
    shot = shoot(plan, frames=60, jitter_s=0.3 * row_s, scene=dim, noise=Noise(full_well_e=8000, read_e=8))
    timing = timing_of(plan, shot)
    lit = [flash for flash in timing.flashes if flash.complete and flash.lights]
    true_s = np.array([flash.start_s for flash in shot.flashes])
    error_s = np.array([np.abs(true_s - flash.start_s).min() for flash in lit])
    assert np.sqrt(np.mean(error_s**2)) < 2 * timing.phase_error_rows * row_s
    assert np.median(error_s) < 0.1 * row_s


@pytest.mark.parametrize(("full_well_e", "followed"), [(1500, True), (700, False)])
def test_flashes_that_stray_are_followed_or_in_the_error_where_rows_show_each_by_one_edge(
    full_well_e: float, followed: bool, make_plan: PlanMaker
) -> None:
    """No row opens in a flash that other rows close in: even and odd rows tell, since noise parts them."""
    plan = make_plan(height_px=128, width_px=COLUMNS, shutter=0.5, readout=0.41, duration_s=5e-4)
    row_s = plan.camera.row_time_s
    shot = shoot(plan, frames=80, jitter_s=0.08 * row_s, noise=Noise(full_well_e=full_well_e, read_e=8))
    timing = timing_of(plan, shot)
    lit = [flash for flash in timing.flashes if flash.complete and flash.lights]
    true_s = np.array([flash.start_s for flash in shot.flashes])
    off_s = np.array([np.abs(true_s - flash.start_s).min() for flash in lit])
    assert not followed or np.median(off_s) < 0.03 * row_s
    assert np.sqrt(np.mean(off_s**2)) < 2 * timing.phase_error_rows * row_s


def test_frames_missing_without_a_hole_are_found_numbered_and_bridged(plan: Plan) -> None:
    shot = shoot(plan, dropped=(20, 21, 50))
    timing = timing_of(plan, shot, numbers=range(101, 101 + len(shot.frames)))
    assert timing.dropped_frames == (DroppedFrames(after=120, count=2), DroppedFrames(after=148, count=1))
    assert rms_rows(timing, shot, plan) < 0.05
    places = places_in_time(timing, range(101, 101 + len(shot.frames)))
    assert tuple(places.values()) == shot.indices


def test_frames_missing_near_either_end_are_found(plan: Plan) -> None:
    shot = shoot(plan, dropped=(4, 66))
    timing = timing_of(plan, shot)
    assert timing.dropped_frames == (DroppedFrames(after=3, count=1), DroppedFrames(after=64, count=1))
    assert rms_rows(timing, shot, plan) < 0.05


def test_a_hole_that_the_numbering_shows_is_reported_once(plan: Plan) -> None:
    shot = shoot(plan, dropped=(30,))
    said = (DroppedFrames(after=29, count=1),)
    timing = timing_of(plan, shot, indices=shot.indices, dropped=said)
    assert timing.dropped_frames == said
    assert rms_rows(timing, shot, plan) < 0.05


def test_a_repeated_frame_takes_no_time(plan: Plan, tmp_path: Path) -> None:
    shot = shoot(plan)
    frames = np.insert(shot.frames, 41, shot.frames[40], axis=0)
    timing = timing_from_rows(plan, np.arange(len(frames)), frames.mean(axis=2, dtype=np.float64))
    assert timing.repeated_frames == (41,)
    assert timing.dropped_frames == ()
    assert rms_rows(timing, shot, plan) < 0.05
    path = tmp_path / "timing.json"
    path.write_text(format_timing(timing))
    assert read_timing(path) == timing


def test_a_frame_that_another_stands_in_for_is_repeated_and_missing(plan: Plan) -> None:
    shot = shoot(plan)
    frames = shot.frames.copy()
    frames[41] = frames[40]
    timing = timing_from_rows(plan, np.arange(len(frames)), frames.mean(axis=2, dtype=np.float64))
    assert timing.repeated_frames == (41,)
    assert timing.dropped_frames == (DroppedFrames(after=41, count=1),)
    assert places_in_time(timing, range(72))[42] == 42
    assert rms_rows(timing, shot, plan) < 0.05


@pytest.mark.parametrize("at", [12, 13, 33])
def test_a_frame_that_another_stands_in_for_is_so_whatever_moves_before_it(at: int, make_plan: PlanMaker) -> None:
    """A coarse texture runs past a short readout, so that brightnesses predict nothing: the frame kept its own place,
    and the flash there was 850 us off under a wrong name."""
    plan = make_plan(height_px=48, width_px=12, readout=0.12)
    walls = {slot: np.random.default_rng(slot).uniform(0.1, 0.9, (4000, 12)) for slot in plan.lit_slots}

    def scene(flash: TrueFlash) -> np.ndarray:
        first = 100 + int(11 * flash.start_s / plan.camera.frame_period_s)
        wall = walls.get(flash.slot, np.zeros((4000, 12)))
        return np.asarray(wall[first : first + 48], np.float32)

    shot = shoot(plan, scene=scene)
    frames = shot.frames.copy()
    frames[at] = frames[at - 1]
    timing = timing_from_rows(plan, np.arange(len(frames)), frames.mean(axis=2, dtype=np.float64))
    assert timing.repeated_frames == (at,)
    assert timing.dropped_frames == (DroppedFrames(after=at, count=1),)


def tumbling(plan: Plan) -> Callable[[TrueFlash], np.ndarray]:
    """A lumpy subject that tumbles fast in a void: its rows brighten and darken from flash to flash."""
    rows = np.arange(plan.camera.height_px) / plan.camera.height_px
    lumps = np.random.default_rng(1).uniform(0, 2 * np.pi, (6, 2))

    def plate(flash: TrueFlash) -> np.ndarray:
        turn = 6.9 * flash.middle_s
        across = (rows - 0.5 - 0.15 * np.sin(0.9 * turn)) / (0.25 + 0.08 * np.sin(1.7 * turn + 1))
        body = np.clip(1 - across**2, 0, 1) ** 0.5
        for k, (a, b) in enumerate(lumps):
            body = body * (1 + 0.12 * np.sin((k + 1) * across * 2 + turn + a) * np.sin(turn + b))
        light = sum(power * (0.6 + 0.1 * len(name)) for name, power in flash.lights.items())
        return np.asarray(0.4 * light * body[:, None] * np.ones(plan.camera.width_px), np.float32)

    return plate


def rolling_stripes(plan: Plan) -> Callable[[TrueFlash], np.ndarray]:
    """Black stripes that travel as fast as the dark row."""
    still, camera = plates(plan), plan.camera
    pitch_s = plan.flashes[0].duration_s + plan.dark_s
    speed = (pitch_s - camera.frame_period_s) / camera.row_time_s / pitch_s
    rows = np.arange(camera.height_px)

    def plate(flash: TrueFlash) -> np.ndarray:
        dark = (rows - speed * flash.middle_s) % (camera.height_px / 2) < 16
        picture = still.get(flash.slot, np.zeros((camera.height_px, camera.width_px)))
        return np.asarray(picture * np.where(dark, 0.15, 1.0)[:, None], np.float32)

    return plate


@pytest.mark.parametrize("scene", [tumbling, rolling_stripes])
def test_moving_subjects_do_not_mislead(scene: Callable[[Plan], Callable[[TrueFlash], np.ndarray]], plan: Plan) -> None:
    shot = shoot(plan, frames=96, scene=scene(plan))
    timing = timing_of(plan, shot)
    assert rms_rows(timing, shot, plan) < 0.05
    assert timing.order == "marker"
    assert timing.dropped_frames == ()


def painted(plan: Plan) -> dict[int, np.ndarray]:
    """Bands with the dark row's own profile, as deep as it, and a black one."""
    rows = np.arange(plan.camera.height_px)
    reach = plan.flashes[0].duration_s / plan.camera.row_time_s
    albedo = np.full(len(rows), 0.6)
    for middle in (0.2, 0.55, 0.8):
        albedo *= np.clip(np.abs(rows - middle * len(rows)) / reach, 0.0, 1)
    albedo[int(0.35 * len(rows)) : int(0.42 * len(rows))] = 0.0
    return {slot: picture * albedo[:, None] for slot, picture in plates(plan).items()}


def void(plan: Plan) -> dict[int, np.ndarray]:
    """A subject in a quarter of the rows, nothing at all in the others."""
    rows = np.arange(plan.camera.height_px) / plan.camera.height_px
    shape = np.clip(1 - ((rows - 0.4) / 0.13) ** 2, 0, 1) ** 0.5
    return {slot: picture * shape[:, None] for slot, picture in plates(plan).items()}


def vignetted(plan: Plan) -> dict[int, np.ndarray]:
    """A hundredth of the light in the first and last rows."""
    rows = np.arange(plan.camera.height_px) / plan.camera.height_px
    fall = 1 - 0.99 * (2 * rows - 1) ** 2
    return {slot: picture * fall[:, None] for slot, picture in plates(plan).items()}


@pytest.mark.parametrize("scene", [painted, void, vignetted])
def test_rows_that_are_dark_by_themselves_do_not_mislead(
    scene: Callable[[Plan], dict[int, np.ndarray]], plan: Plan
) -> None:
    shot = shoot(plan, scene=scene(plan))
    timing = timing_of(plan, shot)
    assert rms_rows(timing, shot, plan) < 0.02
    assert timing.order == "marker"
    assert timing.notes == ()


def test_under_a_global_shutter_flashes_are_timed_within_the_frame(make_plan: PlanMaker) -> None:
    plan = make_plan(height_px=ROWS, width_px=COLUMNS, readout=0.0)
    shot = shoot(plan)
    timing = timing_of(plan, shot)
    assert rms_rows(timing, shot, plan) < 0.05
    assert timing.row_time_s == 0.0
    assert timing.order == "marker"


@pytest.mark.parametrize("dark", [True, False])
def test_flashes_of_different_lengths_are_timed_and_named(dark: bool, make_plan: PlanMaker) -> None:
    """Two lights, each long and short; without a dark slot the lengths alone show which is which, up to the light."""
    plan = make_plan(height_px=ROWS, width_px=COLUMNS, dark=dark)
    each = [("key", 0.0008), ("key", 0.0002), ("left", 0.0008), ("left", 0.0004)]
    lit = tuple(PlannedFlash(lights={name: 1.0}, duration_s=duration_s) for name, duration_s in each)
    plan = replace(plan, flashes=lit + plan.flashes[3:])
    shot = shoot(plan)
    timing = timing_of(plan, shot)
    assert rms_rows(timing, shot, plan) < 0.05
    assert timing.order == "marker"


@pytest.mark.campaign  # of half as many frames: test_sync_moving.py
def test_everything_at_once_is_borne(make_plan: PlanMaker) -> None:
    plan = make_plan(height_px=160, width_px=COLUMNS, readout=0.7, clock_tolerance_ppm=10_000)
    slow = replace(plan, fall_s=5e-5)
    shot = shoot(
        slow,
        frames=300,
        ppm=3000.0,
        drift=2.0,
        scene=tumbling(plan),
        ambient=0.05,
        mains=MainsSwing(hz=100, depth=0.4),
        dropped=(120,),
    )
    timing = timing_of(unknown_readout(replace(plan, clock_tolerance_ppm=None)), shot)
    assert rms_rows(timing, shot, plan) < 0.3
    assert timing.order == "marker"
    assert timing.dropped_frames == (DroppedFrames(after=119, count=1),)


def test_rows_that_saturate_count_for_less(plan: Plan) -> None:
    shot = shoot(plan, scene=plates(plan, bright=2.2), frames=96)
    share = (shot.frames >= 0.998).mean(axis=2)
    assert share.max() > 0.4
    timing = timing_of(plan, shot, doubt=0.3 * share)
    assert rms_rows(timing, shot, plan) < 0.05


def test_flashes_of_two_lights_that_clip_together_are_neither_flicker_nor_tails(plan: Plan) -> None:
    """Rows that split such a flash are the only ones that do not clip: what they say must not be outvoted."""
    patterns = [{"a": 1.0, "b": 1.0}, {"b": 1.0, "c": 1.0}, {"a": 1.0, "c": 1.0}]
    plan = replace(plan, flashes=tuple(PlannedFlash(lights=one, duration_s=0.0008) for one in patterns))
    shot = shoot(plan, scene=plates(plan, bright=1.2), frames=96)
    frames = (MemoryFrame(n, image) for n, image in enumerate(shot.frames))
    index, profiles, doubt = collect_with_doubt(frames)
    assert (shot.frames >= 0.998).mean() > 0.4
    timing = timing_from_rows(plan, index, profiles, doubt=doubt)
    true_s = np.array([flash.start_s for flash in shot.flashes])
    error_s = np.array([np.abs(true_s - flash.start_s).min() for flash in timing.flashes])
    assert np.sqrt(np.mean(error_s**2)) < 0.01 * plan.camera.row_time_s
    assert timing.notes == ()


def test_light_that_flashes_hold_in_known_powers_marks_the_cycle(plan: Plan) -> None:
    powers = [{"key": 1.0}, {"key": 0.25}, {"left": 1.0}, {"right": 1.0}]
    plan = replace(plan, flashes=tuple(PlannedFlash(lights=one, duration_s=0.0008) for one in powers))
    shot = shoot(plan)
    timing = timing_of(plan, shot)
    assert timing.order == "marker"
    assert rms_rows(timing, shot, plan) < 0.05


def test_patterns_that_are_all_alike_are_no_marker(plan: Plan) -> None:
    patterns = [{"a": 1.0, "b": 1.0}, {"b": 1.0, "c": 1.0}, {"a": 1.0, "c": 1.0}]
    plan = replace(plan, flashes=tuple(PlannedFlash(lights=one, duration_s=0.0008) for one in patterns))
    assert timing_of(plan, shoot(plan)).order == "guess"


def test_a_light_that_shows_nothing_could_be_the_dark_slot(plan: Plan) -> None:
    shot = shoot(plan, scene={slot: picture for slot, picture in plates(plan).items() if slot != 2})
    assert timing_of(plan, shot).order == "guess"


def test_automatic_exposure_is_said(plan: Plan) -> None:
    shot = shoot(plan, gain=1 + 0.25 * np.sin(np.arange(72) / 20), ambient=0.03)
    assert any("gain by itself" in note for note in timing_of(plan, shot).notes)


def test_a_dark_time_shorter_than_the_exposure_is_said(plan: Plan) -> None:
    mixed = replace(plan, dark_s=0.8 * plan.dark_s)
    timing = timing_of(mixed, shoot(mixed))
    assert any("hold two flashes" in note for note in timing.notes)


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        pytest.param(0.55, "flashes mixed", marks=pytest.mark.campaign),
        pytest.param(0.9, "but only if frames are missing or repeated at", marks=pytest.mark.campaign),
        pytest.param(1.4, "and not every", marks=pytest.mark.campaign),
    ],
)
def test_a_strobe_that_flashes_at_another_rate_is_not_timed_but_told(factor: float, words: str, plan: Plan) -> None:
    shot = shoot(replace(plan, dark_s=factor * plan.dark_s), frames=96)
    with pytest.raises(PsvideoError, match=words):
        timing_of(plan, shot)


def test_flicker_alone_is_no_strobe(make_plan: PlanMaker) -> None:
    plan, rng = make_plan(height_px=64, width_px=COLUMNS), np.random.default_rng(5)
    rows = (0.3 + 0.2 * rng.random(64)) * (1 + 0.3 * np.sin(np.arange(40) / 3))[:, None]
    with pytest.raises(PsvideoError, match="All rows change together"):
        timing_from_rows(plan, np.arange(40), rows + 1e-3 * rng.standard_normal(rows.shape))


def test_bends_add_up_and_run_straight_on_beyond_the_last_knot() -> None:
    clock = FoundClock(phase_s=0.0, offset_ppm=0.0).bent(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1e-6, 3e-6]))
    np.testing.assert_allclose(clock.bend(np.array([-1.0, 0.5, 3.0])), [-1e-6, 0.5e-6, 5e-6])
    twice = clock.bent(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1e-6, 3e-6]))
    np.testing.assert_allclose(twice.bend(np.array([0.5])), [1e-6])
    moved = clock.shifted(2e-6, 10.0, pivot_s=1.0)
    np.testing.assert_allclose([moved.phase_s, moved.offset_ppm], [2e-6 - 10e-6, 10.0])
    assert (moved.knot_s, moved.bend_s) == (clock.knot_s, clock.bend_s), "bends stay with the clock"


def test_plates_of_a_clip_with_frames_missing_unseen_are_those_of_the_whole_clip(plan: Plan, tmp_path: Path) -> None:
    """Files numbered as if nothing were missing give the plates that the scene has, after the hole too."""
    shot = shoot(plan, frames=48, dropped=(20,), noise=Noise(), bits=0)
    (tmp_path / "plan.toml").write_text(format_plan(plan))
    for number, frame in enumerate(shot.frames, start=1):
        write_exr(tmp_path / f"frame.{number:04d}.exr", {"Y": frame}, half=False)
    take = open_take(tmp_path)
    timing = find_timing(take)
    assert timing.dropped_frames == (DroppedFrames(after=20, count=1),)
    last = list(gather(take, timing))[-1]
    for plate, slot in zip(last.plates, plan.lit_slots, strict=True):
        np.testing.assert_allclose(plate.image, plates(plan)[slot], atol=5e-3)


@pytest.mark.parametrize(("true", "planned"), [(1.0, 0.99), (0.97, 1.0), (0.5, 0.515)])
def test_an_exposure_that_is_off_by_more_than_a_flash_lasts_is_found(
    true: float, planned: float, make_plan: PlanMaker
) -> None:
    """Behind a short readout one end of the exposure explained the flashes, and all were off by what the plan was."""
    plan = make_plan(height_px=48, width_px=12, readout=0.11, shutter=true, fps=Fraction(25), duration_s=0.0003)
    plan = replace(plan, dark_s=1.1 * plan.camera.exposure_s)
    shot = shoot(plan, frames=100)
    told = replace(plan, camera=replace(plan.camera, exposure_s=planned * plan.camera.frame_period_s))
    timing = timing_from_rows(told, np.arange(100), shot.frames.mean(axis=2, dtype=np.float64))
    assert rms_rows(timing, shot, plan) < 0.05
    assert timing.exposure_s == pytest.approx(plan.camera.exposure_s, rel=1e-4)


def test_where_the_longer_flash_is_a_guess_so_are_the_times(make_plan: PlanMaker) -> None:
    """In heavy noise any of five flashes may be the longer one: times were off by what that changes, unclaimed."""
    plan = make_plan(
        height_px=48, width_px=12, readout=0.88, shutter=0.25, fps=Fraction(24), lights=tuple("abcde"), dark=False
    )
    flash = replace(plan.flashes[0], duration_s=0.00045)
    others = tuple(replace(one, duration_s=0.0003) for one in plan.flashes[1:])
    plan = replace(plan, flashes=(flash, *others))
    rng, down = np.random.default_rng(3), np.linspace(0, 1, 48)[:, None] * np.ones(12)
    waves = {slot: np.sin(rng.uniform(2, 6) * down + rng.uniform(0, 6)) for slot in plan.lit_slots}
    walls = {slot: np.asarray(0.3 + 0.2 * wave, np.float32) for slot, wave in waves.items()}
    noise = Noise(full_well_e=20_000, read_e=2000)
    shot = expose(walls, plan, frames=40, clock=TrueClock(phase_s=0.0123, offset_ppm=60.0), noise=noise, bits=12)
    timing = timing_from_rows(plan, np.arange(40), shot.frames.mean(axis=2, dtype=np.float64))
    assert timing.order == "guess"
    assert (timing.phase_error_s or 0.0) > 0.2 * (flash.duration_s - others[0].duration_s)
