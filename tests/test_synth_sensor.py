"""The virtual sensor against brute force, closed forms, and another simulator's clips."""

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from other_simulator import flashes_told, plan_and_frames

from psvideo.errors import PsvideoError
from psvideo.model.camera import Camera
from psvideo.model.plan import Plan, PlannedFlash
from psvideo.synth import MainsSwing, Noise, TrueClock, expose
from psvideo.synth.camera.sensor import seen_share
from psvideo.synth.lamps.emission import Emission
from psvideo.synth.lamps.true_flashes import TrueFlash, row_opens_s, true_flashes

PERIOD_S = 0.01


def camera(*, shutter: float = 1.0, readout: float = 1.0, height_px: int = 60, width_px: int = 3) -> Camera:
    return Camera(
        width_px=width_px,
        height_px=height_px,
        fps=Fraction(100),
        exposure_s=shutter * PERIOD_S,
        readout_s=readout * PERIOD_S,
    )


def plan_of(cam: Camera, durations_s: tuple[float, ...] = (0.001,), **more: Any) -> Plan:
    flashes = tuple(PlannedFlash(lights={f"L{k}": 1.0}, duration_s=d) for k, d in enumerate(durations_s))
    options: dict[str, Any] = {"camera": cam, "flashes": flashes, "dark_s": cam.exposure_s, **more}
    return Plan(**options)


def ramp_plates(cam: Camera, count: int) -> list[np.ndarray]:
    rng = np.random.default_rng(4)
    return [rng.uniform(0.1, 0.9, (cam.height_px, cam.width_px)).astype(np.float32) for _ in range(count)]


@settings(max_examples=60, deadline=None)
@given(
    readout=st.floats(-1, 1),
    start_s=st.floats(0.03, 0.05),
    duration_s=st.floats(1e-5, 0.008),
    rise_s=st.sampled_from([0.0, 4e-5]),
    fall_s=st.sampled_from([0.0, 9e-5]),
)
def test_at_360_degrees_a_rows_frames_share_every_flash_without_loss(
    readout: float, start_s: float, duration_s: float, rise_s: float, fall_s: float
) -> None:
    flash = TrueFlash(index=0, slot=0, lights={"a": 1.0}, start_s=start_s, duration_s=duration_s, complete=True)
    emission = Emission(rise_s=rise_s, fall_s=fall_s)
    shares = sum(seen_share(camera(readout=readout), emission, flash, n) for n in range(12))
    np.testing.assert_allclose(shares, 1.0, atol=1e-6)


@settings(max_examples=30, deadline=None)
@given(
    shutter=st.floats(0.2, 1.0),
    readout=st.floats(-1, 1),
    start_s=st.floats(0.02, 0.03),
    duration_s=st.floats(2e-4, 0.004),
    rise_s=st.sampled_from([0.0, 6e-5]),
    fall_s=st.sampled_from([0.0, 2e-4]),
)
def test_a_rows_share_is_the_emission_summed_up_while_it_is_open(
    shutter: float, readout: float, start_s: float, duration_s: float, rise_s: float, fall_s: float
) -> None:
    cam = camera(shutter=shutter, readout=readout, height_px=7)
    time_s = (np.arange(600_000) + 0.5) * 1e-7
    light = np.where((time_s >= start_s) & (time_s < start_s + duration_s), 1.0, 0.0)
    if rise_s:
        light *= -np.expm1(-np.maximum(time_s - start_s, 0) / rise_s)
    if fall_s:
        reached = -np.expm1(-duration_s / rise_s) if rise_s else 1.0
        after_s = time_s - start_s - duration_s
        light += np.where(after_s >= 0, reached * np.exp(-np.maximum(after_s, 0) / fall_s), 0.0)
    flash = TrueFlash(index=0, slot=0, lights={"a": 1.0}, start_s=start_s, duration_s=duration_s, complete=True)
    for n in (1, 2, 3):
        found = seen_share(cam, Emission(rise_s=rise_s, fall_s=fall_s), flash, n)
        for row in range(cam.height_px):
            place = row if readout >= 0 else cam.height_px - 1 - row
            opens_s = n * PERIOD_S + place * abs(readout) * PERIOD_S / cam.height_px
            seen = light[(time_s >= opens_s) & (time_s < opens_s + cam.exposure_s)].sum() / light.sum()
            assert found[row] == pytest.approx(seen, abs=2e-3)


def test_the_dark_row_lies_where_the_flash_ended_and_moves_by_the_next_flash() -> None:
    """physics.md: behind flash k it is at row (s_k + d_k - n * Tc) / tr where the dark time is exactly the exposure."""
    cam = camera(height_px=1000, width_px=1)
    duration_s = 0.0004
    shot = expose(
        [np.ones((1000, 1), np.float32)], plan_of(cam, (duration_s,)), frames=8, clock=TrueClock(phase_s=0.0032)
    )
    tr = PERIOD_S / 1000
    rows = []
    for flash in shot.flashes[1:6]:
        n = int((flash.start_s + flash.duration_s) // PERIOD_S)
        rows.append((flash.start_s + flash.duration_s - n * PERIOD_S) / tr)
        assert np.argmin(shot.frames[n, :, 0]) == pytest.approx(rows[-1], abs=1)
        half_lit = np.flatnonzero(np.abs(shot.frames[n, :, 0] - 0.5) < 0.02)
        assert half_lit.min() == pytest.approx(rows[-1] - 0.5 * duration_s / tr, abs=2)
        assert half_lit.max() == pytest.approx(rows[-1] + 0.5 * duration_s / tr, abs=2)
    np.testing.assert_allclose(np.diff(rows), duration_s / tr, atol=1e-6)


def test_no_row_sees_two_flashes_under_the_rolling_rule_and_some_do_when_it_is_broken() -> None:
    cam = camera()
    plates = [np.ones((60, 3), np.float32), np.ones((60, 3), np.float32)]
    kept = expose(plates, plan_of(cam, (0.001, 0.002)), frames=12, clock=TrueClock(phase_s=0.0021))
    assert kept.frames.max() <= 1.0 + 1e-6
    halves = [0.4 * plate for plate in plates]
    broken = expose(halves, plan_of(cam, (0.001, 0.002), dark_s=0.006), frames=12, clock=TrueClock(phase_s=0.0021))
    assert broken.frames.max() == pytest.approx(0.8, abs=1e-6)


def test_half_rate_flashes_are_whole_in_the_sum_of_two_frames() -> None:
    cam = camera()
    plates = ramp_plates(cam, 2)
    plan = plan_of(cam, (0.001, 0.001), dark_s=2 * PERIOD_S - 0.001, mode="half-rate")
    shot = expose(plates, plan, frames=12, clock=TrueClock(phase_s=0.0044))
    for flash in shot.flashes:
        if flash.complete:
            n = int(flash.start_s // PERIOD_S)
            pair = shot.frames[n - 1 : n + 1].sum(axis=0)
            np.testing.assert_allclose(pair, plates[flash.slot], atol=1e-5)
    assert sum(flash.complete for flash in shot.flashes) >= 4


def test_a_global_shutter_gives_every_row_the_same_share() -> None:
    cam = camera(readout=0.0)
    shot = expose([np.ones((60, 3), np.float32)], plan_of(cam), frames=6, clock=TrueClock(phase_s=0.0096))
    assert np.ptp(shot.frames, axis=(1, 2)).max() == 0.0
    np.testing.assert_allclose(shot.frames[:2, 0, 0], [0.4, 0.6], atol=1e-6)


def test_a_bottom_up_camera_is_a_top_down_one_upside_down() -> None:
    plates = ramp_plates(camera(), 2)
    clock = TrueClock(phase_s=0.0043, offset_ppm=80)
    down = expose(plates, plan_of(camera(readout=0.8), (0.001, 0.002)), frames=7, clock=clock)
    flipped = [plate[::-1] for plate in plates]
    up = expose(flipped, plan_of(camera(readout=-0.8), (0.001, 0.002)), frames=7, clock=clock)
    np.testing.assert_array_equal(up.frames[:, ::-1], down.frames)
    assert row_opens_s(camera(readout=-0.8)).argmin() == 59


def test_a_synced_clip_holds_one_whole_flash_per_frame_in_order() -> None:
    cam = camera(readout=0.3)
    plates = ramp_plates(cam, 3)
    plan = plan_of(cam, (0.001, 0.004, 0.002), dark_s=0.006, mode="synced")
    shot = expose(plates, plan, frames=7, clock=TrueClock(phase_s=0.004, offset_ppm=5000))
    for n in range(7):
        np.testing.assert_allclose(shot.frames[n], plates[n % 3], atol=1e-6)
    with pytest.raises(PsvideoError, match=r"synced plan flashes for 1 ms, but all rows .* only 0\.1667 ms"):
        expose(plates, plan_of(camera(), mode="synced"), frames=2)


def test_below_360_degrees_a_flash_in_the_blind_time_is_lost() -> None:
    cam = camera(shutter=0.5, readout=0.0)
    shot = expose([np.ones((60, 3), np.float32)], plan_of(cam, dark_s=1.0), frames=3, clock=TrueClock(phase_s=0.0147))
    np.testing.assert_allclose(shot.frames[:, 0, 0], [0, 0.3, 0], atol=1e-6)


@pytest.mark.parametrize("fall_s", [0.0, 1e-4])
def test_a_flash_is_complete_exactly_when_the_recorded_frames_hold_all_its_light(fall_s: float) -> None:
    cam = camera(readout=-0.7)
    plan = plan_of(cam, (0.001, 0.003), fall_s=fall_s)
    lost = frozenset({7})
    emission, kept = Emission(fall_s=fall_s), 1 - (1e-3 if fall_s else 1e-9)
    for phase_s in np.linspace(-0.012, 0.012, 60):
        clock = TrueClock(phase_s=float(phase_s), offset_ppm=-300, drift_ppm_per_s=40, jitter_s=1e-5, seed=2)
        flashes = true_flashes(plan, clock, frames=12, dropped=lost)
        held = [sum(seen_share(cam, emission, flash, n) for n in range(12) if n not in lost) for flash in flashes]
        assert [flash.complete for flash in flashes] == [bool(np.all(share >= kept)) for share in held]
        assert [flash.index for flash in flashes] == list(range(len(flashes)))
        assert {False, True} == {flash.complete for flash in flashes[1:-1]}


def test_an_leds_tail_reaches_into_the_next_frame_and_nothing_of_it_is_lost() -> None:
    """The flash ends with frame 0; with equal rise and fall an LED gives off as much as a square pulse."""
    cam = camera(readout=0.0)
    plan = plan_of(cam, (0.0005,), dark_s=1.0, rise_s=2e-4, fall_s=2e-4)
    shot = expose([np.ones((60, 3), np.float32)], plan, frames=3, clock=TrueClock(phase_s=0.0095))
    late = 2e-4 * -np.expm1(-2.5) / 0.0005
    np.testing.assert_allclose(shot.frames[:, 0, 0], [1 - late, late, 0.0], atol=1e-6)


def test_drift_and_offset_stretch_the_strobes_seconds() -> None:
    plan = plan_of(camera(), (0.001,), dark_s=0.099)
    clock = TrueClock(phase_s=0.02, offset_ppm=1000, drift_ppm_per_s=50)
    flashes = true_flashes(plan, clock, frames=1000)
    strobe_s = 0.1 * np.arange(len(flashes))
    expected_s = 0.02 + strobe_s * 1.001 + 25e-6 * strobe_s**2
    np.testing.assert_allclose([flash.start_s for flash in flashes], expected_s, atol=1e-12)
    np.testing.assert_allclose(flashes[50].duration_s, 0.001 * (1.001 + 50e-6 * 5.0), rtol=1e-12)


def test_jitter_has_the_given_spread_and_comes_from_the_seed() -> None:
    plan = plan_of(camera(), (0.001,))
    even, late, again = (
        np.array([f.start_s for f in true_flashes(plan, TrueClock(phase_s=0.004, jitter_s=j, seed=3), frames=3000)])
        for j in (0.0, 2e-5, 2e-5)
    )
    assert np.std(late - even) == pytest.approx(2e-5, rel=0.06)
    np.testing.assert_array_equal(late, again)


def test_ambient_light_adds_to_every_row_and_flickers_as_its_mean_over_the_exposure() -> None:
    cam = camera(shutter=0.4)
    mains = MainsSwing(hz=130.0, depth=0.6)
    shot = expose({0: np.zeros((60, 3), np.float32)}, plan_of(cam), frames=3, ambient=0.2, mains=mains)
    for n, row in ((0, 0), (1, 31), (2, 59)):
        opens_s = (n + row / 60) * PERIOD_S
        time_s = opens_s + (np.arange(20_000) + 0.5) / 20_000 * cam.exposure_s
        mean = np.mean(0.2 * (1 + 0.6 * np.sin(2 * np.pi * 130.0 * time_s)))
        assert shot.frames[n, row, 0] == pytest.approx(mean, abs=1e-6)


def test_noise_has_the_variance_of_the_electrons_and_the_seed_decides_it() -> None:
    cam = camera(readout=0.0, height_px=200, width_px=200)
    plan = plan_of(cam, mode="synced")
    noise = Noise(full_well_e=4000.0, read_e=12.0)
    plate = [np.full((200, 200), 0.3, np.float32)]
    shots = [expose(plate, plan, frames=3, noise=noise, seed=seed).frames for seed in (1, 1, 2)]
    np.testing.assert_array_equal(shots[0], shots[1])
    assert not np.array_equal(shots[0], shots[2])
    assert not np.array_equal(shots[0][0], shots[0][1])
    assert shots[0].mean() == pytest.approx(0.3, abs=3e-4)
    assert shots[0].std() == pytest.approx(np.sqrt(0.3 * 4000 + 144) / 4000, rel=0.01)
    later = expose(plate, plan, frames=3, noise=noise, seed=1, dropped=[0]).frames
    np.testing.assert_array_equal(later, shots[0][1:])


def test_frames_saturate_and_come_in_the_converters_steps() -> None:
    cam = camera(readout=0.0)
    plate = [np.linspace(0, 1.5, 180, dtype=np.float32).reshape(60, 3)]
    shot = expose(plate, plan_of(cam, mode="synced"), frames=1, bits=8)
    assert shot.frames.max() == 1.0
    np.testing.assert_allclose(shot.frames * 255, np.round(shot.frames * 255), atol=1e-4)


@pytest.mark.parametrize("clip", ["plain", "ambient"])
def test_another_simulators_frames_come_out_of_its_plates_and_timing(shared_data: Path, clip: str) -> None:
    folder = shared_data / "clips" / clip
    plan, images = plan_and_frames(folder)
    truth, light = flashes_told(folder), np.stack(images)
    slots = {next(iter(flash.lights), None): slot for slot, flash in enumerate(plan.flashes)}
    plates = {slots[row["light"]]: _exr(folder / "truth" / row["plate"]) for row in truth if "plate" in row}
    first = truth[0]
    planned = plan.flashes[slots[first["light"]]]
    ppm = (first["duration_s"] / planned.duration_s - 1) * 1e6
    strobe_s = float(plan.train(slots[first["light"]], 1).start_s[0])
    clock = TrueClock(phase_s=first["start_s"] - strobe_s * (1 + ppm * 1e-6), offset_ppm=ppm)
    shot = expose(plates, plan, frames=len(images), clock=clock)
    for flash, row in zip(shot.flashes, truth, strict=True):
        assert flash.start_s == pytest.approx(row["start_s"], abs=1e-9)
        assert flash.complete == row["complete"]
    left = light - shot.frames
    left -= np.median(left, axis=0)  # ambient light
    saturated = light.max(axis=-1) > 0.99
    rows = np.where(saturated[..., None], 0, left).mean(axis=(2, 3))
    assert np.abs(rows).max() < 7e-4  # noise of 0.0037 over 960 samples is 1.2e-4
    assert left[~saturated].std() < 0.004


def _exr(path: Path) -> np.ndarray:
    return np.asarray(OpenEXR.File(str(path)).channels()["RGB"].pixels, np.float32)


@given(st.floats(-5000, 5000), st.floats(-20, 20), st.floats(-1, 1), st.floats(0, 600))
def test_a_clock_turns_back_what_it_turned(offset_ppm: float, drift: float, phase_s: float, at_s: float) -> None:
    clock = TrueClock(phase_s=phase_s, offset_ppm=offset_ppm, drift_ppm_per_s=drift)
    there = clock.camera_time_s(np.array([at_s]))
    assert clock.strobe_time_s(there)[0] == pytest.approx(at_s, abs=1e-9)


@pytest.mark.parametrize("offset_ppm", [-5000.0, 5000.0])
def test_a_strobe_flashes_to_the_end_of_a_long_clip(make_plan: Callable[..., Plan], offset_ppm: float) -> None:
    plan, frames = make_plan(), 1800
    flashes = true_flashes(plan, TrueClock(offset_ppm=offset_ppm), frames=frames, dropped=frozenset())
    pitch_s = 2 * plan.cycle_s / len(plan.cycle_slots)
    assert flashes[-1].start_s > frames * plan.camera.frame_period_s - pitch_s
    assert flashes[0].start_s < pitch_s
