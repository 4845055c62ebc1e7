"""A strobe that begins anew during a clip, at another place in its cycle: each part is timed by itself."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from psvideo.model.camera import FloatArray
from psvideo.model.plan import Plan
from psvideo.model.timing import Timing
from psvideo.sync.find import find_timing
from psvideo.sync.flashes_seen import flashes_seen
from psvideo.sync.rowfit.beat import Beat, FoundClock
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.restarts import TICKS, moved
from psvideo.synth import Exposure, Noise, TrueClock, expose

PlanMaker = Callable[..., Plan]
FRAMES, BREAK = 120, 63
PHASE_S = 0.0123


@pytest.fixture
def plan(make_plan: PlanMaker) -> Plan:
    return make_plan(height_px=48, width_px=12)


def shot_of(plan: Plan, phase_s: float = PHASE_S) -> Exposure:
    rng = np.random.default_rng(5)
    plates = {slot: (0.2 + 0.5 * rng.random((48, 12))).astype(np.float32) for slot in plan.lit_slots}
    clock = TrueClock(phase_s=phase_s, offset_ppm=80.0)
    return expose(plates, plan, frames=FRAMES, clock=clock, ambient=0.02, noise=Noise(full_well_e=2e5, read_e=5))


def with_restart(plan: Plan, late_s: float) -> tuple[tuple[Exposure, Exposure], FloatArray]:
    """Return a strobe's shots before and after it waits for some time, and the row means of both in one clip."""
    before, after = shot_of(plan), shot_of(plan, PHASE_S + late_s)
    frames = np.concatenate([before.frames[:BREAK], after.frames[BREAK:]])
    return (before, after), frames.mean(axis=2, dtype=np.float64)


def off_s(timing: Timing, shots: tuple[Exposure, Exposure], period_s: float) -> NDArray[np.float64]:
    """Return by how much complete flashes are off those of the part they lie in, and by light, shape (flash,)."""
    off = []
    for flash in timing.flashes:
        if flash.complete:
            true = shots[flash.start_s > BREAK * period_s].flashes
            same = [one.start_s for one in true if dict(one.lights) == dict(flash.lights)]
            off.append(np.abs(np.array(same) - flash.start_s).min())
    return np.array(off)


@pytest.mark.parametrize("share", [0.37, 1.0, 2.6])
def test_a_strobe_that_begins_anew_is_timed_before_and_after(share: float, plan: Plan) -> None:
    pitch_s = plan.cycle_s / len(plan.cycle_slots)
    shots, profiles = with_restart(plan, share * pitch_s)
    timing = find_timing(plan, np.arange(FRAMES), profiles)
    off = off_s(timing, shots, plan.camera.frame_period_s)
    assert off.max() < 0.05 * plan.camera.row_time_s
    assert len(off) > 0.9 * FRAMES * plan.camera.frame_period_s / pitch_s - 4
    assert timing.order == "marker"
    assert timing.dropped_frames == ()
    assert any("began anew" in note for note in timing.notes)
    assert [flash.index for flash in timing.flashes] == list(range(len(timing.flashes)))


def test_without_a_marker_lights_keep_their_names_over_a_restart(make_plan: PlanMaker) -> None:
    plan = make_plan(height_px=48, width_px=12, dark=False)
    pitch_s = plan.cycle_s / len(plan.cycle_slots)
    shots, profiles = with_restart(plan, 1.4 * pitch_s)
    first = next(flash for flash in shots[0].flashes if flash.start_s > plan.camera.frame_period_s)
    (light,) = first.lights
    timing = find_timing(plan, np.arange(FRAMES), profiles, first_light=light)
    assert off_s(timing, shots, plan.camera.frame_period_s).max() < 0.05 * plan.camera.row_time_s
    assert timing.order == "given"


def test_frames_that_are_missing_are_no_restart(plan: Plan) -> None:
    keep = np.delete(np.arange(FRAMES), [31, 62, 63, 64])
    profiles = shot_of(plan).frames.mean(axis=2, dtype=np.float64)[keep]
    timing = find_timing(plan, np.arange(len(keep)), profiles)
    assert [(hole.after, hole.count) for hole in timing.dropped_frames] == [(30, 1), (60, 3)]
    assert not any("began anew" in note for note in timing.notes)


def test_flashes_in_frames_that_may_lie_on_either_side_of_a_hole_are_incomplete(plan: Plan) -> None:
    camera = plan.camera
    beat = Beat(
        clock=FoundClock(phase_s=0.0, offset_ppm=0.0), row_time_s=camera.row_time_s, exposure_s=camera.exposure_s
    )
    sure, unsure = (
        flashes_seen(plan, beat, camera, (0, 40), trusted=(0, 40), unsure=places) for places in ((), (20, 21))
    )
    lost = [a.start_s / camera.frame_period_s for a, b in zip(sure, unsure, strict=True) if a.complete > b.complete]
    assert 2 <= len(lost) <= 5
    assert min(lost) > 18
    assert max(lost) < 22


def test_places_between_frames_are_counted_in_ticks(plan: Plan) -> None:
    rows = Profiles(
        value=np.random.default_rng(0).random((5, 4)),
        index=np.arange(5),
        period_s=plan.camera.frame_period_s,
        place=np.arange(4.0),
        window_start=np.zeros(1, np.int64),
    )
    late = moved(rows, 0.25 * rows.period_s)
    np.testing.assert_allclose(
        late.frame_start_s - rows.frame_start_s, 0.25 * rows.period_s, atol=rows.period_s / TICKS
    )
