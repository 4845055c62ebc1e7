"""Timing found where frames are missing, repeated or stand in for others."""

from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from disturbed_shots import COLUMNS, ROWS, PlanMaker, plates, rms_rows, shoot, timing_of

from psvideo.formats.exr_files import write_exr
from psvideo.formats.plan_toml import format_plan
from psvideo.formats.timing_json import format_timing, read_timing
from psvideo.model.plan import Plan
from psvideo.model.timing import DroppedFrames, places_in_time
from psvideo.plates.gather import gather
from psvideo.sync.find import timing_from_rows
from psvideo.sync.open_take import open_take
from psvideo.sync.take_timing import find_timing
from psvideo.synth import Noise, TrueFlash


@pytest.fixture
def plan(make_plan: PlanMaker) -> Plan:
    return make_plan(height_px=ROWS, width_px=COLUMNS)


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


@pytest.mark.parametrize("margin", [1.29, 1.3])
@pytest.mark.parametrize("readout", [-1.0, 1.0])
@pytest.mark.parametrize("lost", [True, False])
@pytest.mark.campaign
def test_a_frame_that_looks_like_the_one_before_it_because_another_is_missing_is_not_repeated(
    make_plan: PlanMaker, margin: float, readout: float, *, lost: bool
) -> None:
    """Of a cycle of 1.99 or 2.01 frames the next but one shows the same lights, half a flash away: times were 549 us
    off at a claim of 46. A frame that is repeated stays so."""
    plan = make_plan(
        lights=("key", "left"),
        fps=Fraction(24),
        shutter=0.5,
        readout=readout,
        duration_s=0.02 / 24,
        height_px=ROWS,
        width_px=COLUMNS,
    )
    plan = replace(plan, dark_s=margin * plan.camera.exposure_s)
    shot = shoot(plan, frames=60, dropped=(25,) if lost else ())
    profiles = shot.frames.mean(axis=2, dtype=np.float64)
    profiles = profiles if lost else np.insert(profiles, 25, profiles[24], axis=0)
    timing = timing_from_rows(plan, np.arange(len(profiles)), profiles)
    assert timing.dropped_frames == ((DroppedFrames(after=24, count=1),) if lost else ())
    assert timing.repeated_frames == (() if lost else (25,))
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
