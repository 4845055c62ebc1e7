"""Timing found where something is wrong with the clip: every disturbance that the fit knows, one at a time."""

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction

import cv2
import numpy as np
import pytest
from disturbed_shots import COLUMNS, ROWS, PlanMaker, plates, rms_rows, shoot, timing_of, unknown_readout
from scipy.ndimage import gaussian_filter  # type: ignore[attr-defined]

from psvideo.errors import PsvideoError
from psvideo.formats.timing_json import parse_timing, timing_record
from psvideo.model.plan import Plan, PlannedFlash
from psvideo.model.rows.ripple import Exposures
from psvideo.model.timing import DroppedFrames
from psvideo.sync.find import timing_from_rows
from psvideo.synth import MainsSwing, Noise, TrueClock, TrueFlash, expose


@pytest.fixture
def plan(make_plan: PlanMaker) -> Plan:
    return make_plan(height_px=ROWS, width_px=COLUMNS)


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


@pytest.mark.campaign
def test_mains_that_run_a_little_fast_are_followed_through_the_clip(make_plan: PlanMaker) -> None:
    plan = make_plan(height_px=ROWS, width_px=COLUMNS, shutter=0.5, readout=0.6, fps=Fraction(90))
    timing = timing_of(plan, shoot(plan, frames=240, ambient=0.15, mains=MainsSwing(hz=100.15, depth=0.8)))
    assert timing.mains is not None
    assert timing.mains.hz == pytest.approx(100.15, abs=0.02)


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


@pytest.mark.campaign
def test_rows_that_saturate_count_for_less(plan: Plan) -> None:
    shot = shoot(plan, scene=plates(plan, bright=2.2), frames=96)
    share = (shot.frames >= 0.998).mean(axis=2)
    assert share.max() > 0.4
    timing = timing_of(plan, shot, doubt=0.3 * share)
    assert rms_rows(timing, shot, plan) < 0.05


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


def test_flicker_alone_is_no_strobe(make_plan: PlanMaker) -> None:
    plan, rng = make_plan(height_px=64, width_px=COLUMNS), np.random.default_rng(5)
    rows = (0.3 + 0.2 * rng.random(64)) * (1 + 0.3 * np.sin(np.arange(40) / 3))[:, None]
    with pytest.raises(PsvideoError, match="All rows change together"):
        timing_from_rows(plan, np.arange(40), rows + 1e-3 * rng.standard_normal(rows.shape))


@pytest.mark.parametrize("seed", [0, 2])
@pytest.mark.campaign
def test_tails_that_compressed_rows_hide_count_in_the_claim_where_the_exposure_differs_too(
    make_plan: PlanMaker, seed: int
) -> None:
    """The exposure was set free, and put back as a blur's doing; what tails may have moved was forgotten with it: 38 us
    at a claim of 11."""
    height, width = 96, 16
    plan = make_plan(
        lights=tuple("abcdefg"), height_px=height, width_px=width, fps=Fraction(24), shutter=20 / 360, readout=0.34
    )
    plan = replace(plan, dark_s=1.003 * plan.camera.exposure_s)
    rng = np.random.default_rng(seed)
    texture = gaussian_filter(rng.random((height, width)), 5)
    texture = 0.3 + 0.6 * (texture - texture.min()) / np.ptp(texture)
    y = np.arange(height)[:, None] / height
    lit = {
        slot: texture * np.clip(0.55 + 0.4 * np.sin(rng.uniform(2, 14) * y + rng.uniform(0, 6.3)), 0.02, 1)
        for slot in plan.lit_slots
    }
    clock, noise = TrueClock(phase_s=0.011, offset_ppm=60.0), Noise(full_well_e=30_000, read_e=8)
    slow = replace(plan, rise_s=20e-6, fall_s=30e-6)
    shot = expose(lit, slow, frames=80, clock=clock, noise=noise, bits=12)
    codes = np.rint(255 * np.clip(shot.frames, 0, 1)).astype(np.uint8)
    coded = [cv2.imdecode(cv2.imencode(".jpg", one, [cv2.IMWRITE_JPEG_QUALITY, 75])[1], 0) for one in codes]
    profiles = np.array(coded).mean(axis=2) / 255
    told = replace(plan, camera=replace(plan.camera, exposure_s=1.008 * plan.camera.exposure_s))
    timing = timing_from_rows(told, np.arange(len(profiles)), profiles)
    pitch_s = plan.cycle_s * (1 + 60e-6) / len(plan.flashes)
    late_s = [(one.start_s - 0.011 + pitch_s / 2) % pitch_s - pitch_s / 2 for one in timing.flashes if one.complete]
    assert timing.phase_error_s is not None
    assert np.abs(late_s).max() < 2 * timing.phase_error_s
