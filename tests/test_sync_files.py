"""Timing found through the files that cameras write: eight-bit movies, log curves, mosaics."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from bench.compression import TRIALS, Trial, trial_of, tried
from bench.timing_files import write_h264

from psvideo.errors import NoStrobeError
from psvideo.formats.plan_toml import format_plan
from psvideo.model.camera import Encoding
from psvideo.model.plan import Plan
from psvideo.model.timing import Timing
from psvideo.sync.open_take import open_take
from psvideo.sync.take_timing import find_timing
from psvideo.synth import Exposure, Noise, TrueClock, expose
from psvideo.synth.camera.curves import CURVES
from psvideo.synth.camera.dpx_writer import dpx_bytes
from psvideo.synth.camera.encode import Codes
from psvideo.synth.camera.frames import write_frame
from psvideo.synth.scene_tables import CameraTable

PlanMaker = Callable[..., Plan]
ROWS = 160
FEIGNED = (1, 12, 28, 32, 33, 40, 53, 64, 68, 75)
"""Trials in which edges blurred by H.264 look most like slow LEDs or another exposure."""
QUICK = (64,)
"""The others are the campaign's."""
SHARES = 12
"""So many tests take the campaign's encodes, which other workers can take up: they were 528 s in one."""


def shoot(
    plan: Plan, *, frames: int, ppm: float = 30.0, ambient: float = 0.0, pattern: np.ndarray | None = None
) -> Exposure:
    rng = np.random.default_rng(3)
    shape = (plan.camera.height_px, plan.camera.width_px)
    filters = np.ones((2, 2)) if pattern is None else pattern
    mosaic = np.tile(filters, (shape[0] // 2, shape[1] // 2))
    scene = {slot: (mosaic * (0.1 + 0.5 * rng.random(shape))).astype(np.float32) for slot in plan.lit_slots}
    clock = TrueClock(phase_s=0.0123, offset_ppm=ppm)
    return expose(scene, plan, frames=frames, clock=clock, ambient=ambient, noise=Noise(full_well_e=20_000, read_e=8))


def timing_through(path: Path, plan: Plan) -> Timing:
    (path if path.is_dir() else path.parent).joinpath("plan.toml").write_text(format_plan(plan))
    return find_timing(open_take(path))


def rms_rows(timing: Timing, shot: Exposure, plan: Plan) -> float:
    """Return the RMS distance of every flash found from the nearest true flash with the same lights."""
    error_s = [
        min(abs(true.start_s - flash.start_s) for true in shot.flashes if dict(true.lights) == dict(flash.lights))
        for flash in timing.flashes
    ]
    return float(np.sqrt(np.mean(np.square(error_s)))) / plan.camera.row_time_s


@pytest.mark.parametrize(("ppm", "shutter"), [(-5000.0, 0.5), (30.0, 1.0)])
@pytest.mark.campaign
def test_compression_is_not_taken_for_slow_leds(
    ppm: float, shutter: float, make_plan: PlanMaker, tmp_path: Path
) -> None:
    plan = make_plan(height_px=ROWS, width_px=64, shutter=shutter, clock_tolerance_ppm=10_000)
    plan = replace(plan, camera=replace(plan.camera, encoding=Encoding(transfer="srgb")))
    shot = shoot(plan, frames=150, ppm=ppm, ambient=0.1)
    write_h264(tmp_path / "clip.mp4", plan, shot.frames)
    timing = timing_through(tmp_path / "clip.mp4", plan)
    assert rms_rows(timing, shot, plan) < 0.05
    assert timing.order == "marker"
    assert any("soft" in note for note in timing.notes) == (shutter == 0.5)


@pytest.mark.parametrize(
    "seed", [seed if seed in QUICK else pytest.param(seed, marks=pytest.mark.campaign) for seed in FEIGNED]
)
def test_blurred_edges_are_taken_for_no_other_time(seed: int) -> None:
    outcome = tried(trial_of(seed))
    assert outcome.owned, outcome


@pytest.mark.parametrize(("seed", "crf", "shutter"), [(5067, 14, 0.75), (5075, 17, 0.25), (5088, 11, 0.75)])
@pytest.mark.campaign
def test_edges_that_a_blur_softens_a_little_put_the_times_in_doubt(seed: int, crf: int, shutter: float) -> None:
    offset_ppm = 30.0 if seed == 5075 else 2000.0
    outcome = tried(Trial(seed=seed, crf=crf, preset="veryfast", shutter=shutter, offset_ppm=offset_ppm))
    assert 0.4 * outcome.claimed_rows < outcome.made_rows < 2 * outcome.claimed_rows


@pytest.mark.campaign
def test_tails_that_compression_could_feign_are_in_doubt_where_they_are_taken() -> None:
    trial = Trial(seed=6006, crf=19, preset="ultrafast", shutter=0.5, offset_ppm=-5000.0, tails_rows=0.6)
    outcome = tried(trial)
    assert outcome.made_rows < 0.15
    assert 0.2 < outcome.claimed_rows < 0.6


@pytest.mark.campaign
@pytest.mark.parametrize("seeds", [range(TRIALS)[first::SHARES] for first in range(SHARES)], ids=str)
def test_over_many_encodes_the_times_hold_or_the_doubt_is_claimed(seeds: range) -> None:
    missed = [outcome for outcome in map(tried, map(trial_of, seeds)) if not outcome.owned]
    assert not missed, missed


def test_footage_in_a_log_curve_is_timed(make_plan: PlanMaker, tmp_path: Path) -> None:
    plan = make_plan(height_px=ROWS, width_px=12)
    plan = replace(plan, camera=replace(plan.camera, encoding=Encoding(transfer="slog3")))
    shot = shoot(plan, frames=60)
    codes = Codes(curve=CURVES["slog3"], bits=10, black=95, white=1023, top=1023)
    for number, picture in enumerate(shot.frames):
        coded = np.repeat(codes.from_light(picture)[..., None], 3, axis=2)
        (tmp_path / f"frame.{number:04d}.dpx").write_bytes(dpx_bytes(coded, 10))
    assert rms_rows(timing_through(tmp_path, plan), shot, plan) < 0.02


def test_mosaics_are_timed_as_they_are(make_plan: PlanMaker, tmp_path: Path) -> None:
    plan = make_plan(height_px=ROWS, width_px=12)
    plan = replace(plan, camera=replace(plan.camera, encoding=Encoding(cfa="RGGB")))
    shot = shoot(plan, frames=60, pattern=np.array([[0.4, 1.0], [1.0, 0.6]]))
    codes = Codes(curve=CURVES["linear"], bits=12, black=256, white=4095, top=4095)
    camera = CameraTable(
        width_px=12, height_px=ROWS, fps=str(plan.camera.fps), shutter_deg=360, readout_s=0.0, cfa="RGGB"
    )
    for number, picture in enumerate(shot.frames):
        path = tmp_path / f"frame.{number:04d}.dng"
        write_frame(path, codes.from_light(picture), kind="dng", camera=camera, scale=codes)
    assert rms_rows(timing_through(tmp_path, plan), shot, plan) < 0.02


@pytest.mark.parametrize(
    ("turns", "back"), [(1, "clockwise"), pytest.param(-1, "counterclockwise", marks=pytest.mark.campaign)]
)
def test_footage_that_was_turned_by_90_degrees_is_said_to_be(
    turns: int, back: str, make_plan: PlanMaker, tmp_path: Path
) -> None:
    """Its rows all see the whole readout, as under another camera: all flashes were 0.95 ms off at a claim of 0.09."""
    lights = tuple("abcdef")
    plan = make_plan(height_px=96, width_px=80, lights=lights, duration_s=0.001, readout=0.3, clock_tolerance_ppm=100)
    rng = np.random.default_rng(8)
    row, col = np.mgrid[0:96, 0:80]
    plates: dict[int, np.ndarray] = {}
    for slot in plan.lit_slots:
        far = (row - rng.uniform(20, 76)) ** 2 + (col - rng.uniform(20, 60)) ** 2
        plates[slot] = (0.05 + 0.6 * np.exp(-far / rng.uniform(200, 900))).astype(np.float32)
    clock = TrueClock(phase_s=rng.uniform(0, plan.cycle_s), offset_ppm=rng.uniform(-90, 90))
    shot = expose(plates, plan, frames=70, clock=clock, noise=Noise(full_well_e=20_000, read_e=8), bits=12, seed=8)
    for n, frame in enumerate(np.rot90(shot.frames, turns, axes=(1, 2))):
        codes = np.rint(np.clip(frame, 0, 1) * 65535).astype(np.uint16)
        assert cv2.imwrite(str(tmp_path / f"{n:04d}.png"), codes)
    turned = replace(plan, camera=replace(plan.camera, width_px=96, height_px=80, encoding=Encoding(transfer="linear")))
    with pytest.raises(NoStrobeError, match=f"along the columns of the pictures.*turn them back, {back} "):
        timing_through(tmp_path, turned)


@pytest.mark.parametrize(("frames", "said"), [(2, "holds 2 frames"), (20, "do not change at all")])
def test_columns_are_not_asked_where_there_is_nothing_to_find(
    frames: int, said: str, make_plan: PlanMaker, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("psvideo.sync.sideways.best_rival", None)
    plan = make_plan(height_px=24, width_px=24)
    for n in range(frames):
        assert cv2.imwrite(str(tmp_path / f"{n:04d}.png"), np.full((24, 24), 9000, np.uint16))
    with pytest.raises(NoStrobeError, match=said):
        timing_through(tmp_path, plan)
