"""A strobe that stops within a frame and begins again within one: no flash is listed as complete that never fired."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.model.rows.shutter import frames_touched
from psvideo.model.timing import Timing, places_in_time
from psvideo.sync.find import timing_from_rows
from psvideo.synth import Noise, TrueClock, TrueFlash, expose

PlanMaker = Callable[..., Plan]
PPM = 80.0
CLEAN = Noise(full_well_e=1e7, read_e=1.0)


def broken_off(
    plan: Plan, seed: int, *, frames: int, stops: float, begins: float
) -> tuple[tuple[TrueFlash, ...], Doubles]:
    """Return the flashes that fire, and row means (frame, row), of a strobe that stops and begins again at some times,
    in frames."""
    rng, period_s = np.random.default_rng(seed), plan.camera.frame_period_s
    plates = {slot: (0.2 + 0.5 * rng.random((48, 12))).astype(np.float32) for slot in plan.lit_slots}
    none = np.zeros((48, 12), np.float32)

    def only(fires: Callable[[TrueFlash], bool]) -> Callable[[TrueFlash], NDArray[np.float32]]:
        return lambda flash: plates[flash.slot] if flash.slot in plates and fires(flash) else none

    def before(flash: TrueFlash) -> bool:
        return flash.start_s < stops * period_s

    def after(flash: TrueFlash) -> bool:
        return flash.start_s > (begins - 1e-4) * period_s

    cycle_s = plan.cycle_s * (1 + PPM * 1e-6)
    phase_s = float(rng.uniform(0, plan.cycle_s)), begins * period_s - cycle_s * int(begins * period_s / cycle_s + 1)
    shots = [
        expose(
            only(fires), plan, frames=frames, clock=TrueClock(phase_s=one, offset_ppm=PPM), ambient=light, noise=CLEAN
        )
        for fires, one, light in zip((before, after), phase_s, (0.02, 0.0), strict=True)
    ]
    fired = (*filter(before, shots[0].flashes), *filter(after, shots[1].flashes))
    profiles = sum((shot.frames.mean(axis=2, dtype=np.float64) for shot in shots), np.zeros((frames, 48)))
    return fired, profiles + rng.normal(0, 2e-4, profiles.shape)


def off_rows(plan: Plan, timing: Timing, fired: tuple[TrueFlash, ...], frames: int) -> NDArray[np.float64]:
    """Return by how much complete flashes are off the nearest of their light that fired, within the frames that saw
    them: frames that are missing by mistake move the ones with the others."""
    period_s = plan.camera.frame_period_s
    number = {place: n for n, place in places_in_time(timing, range(frames)).items()}
    first, last = frames_touched(plan.camera, timing.start_s, timing.duration_s)
    off = []
    for flash, begin, end in zip(timing.flashes, first.tolist(), last.tolist(), strict=True):
        saw = range(begin, end + 1)
        if flash.complete and flash.lights and len(saw) and all(place in number for place in saw):
            true_s = np.array([one.start_s for one in fired if dict(one.lights) == dict(flash.lights)])
            moved_s = {(number[place] - place) * period_s for place in saw}
            off.append(max(np.abs(true_s - flash.start_s - one).min() for one in moved_s))
    return np.array(off) / plan.camera.row_time_s


@pytest.mark.parametrize(
    ("lights", "shutter", "readout", "frames", "stops", "begins", "seed"),
    [
        pytest.param(5, 0.25, 1.0, 54, 22.73, 22.96, 1, id="part-ends"),
        pytest.param(5, 0.25, 1.0, 54, 22.73, 22.96, 2, id="hole"),
        pytest.param(4, 0.5, 0.6, 60, 25.48, 40.63, 2, id="dark"),
        pytest.param(3, 1.0, 1.0, 57, 33.1, 35.97, 1, id="hole-and-repeats"),
        pytest.param(3, 0.25, 0.6, 60, 42.96, 43.61, 1, id="between-two-exposures"),
        pytest.param(3, 0.25, 0.83, 73, 13.82, 17.64, 876, id="more-dark-frames-than-places"),
        pytest.param(3, 1.0, 0.78, 64, 30.11, 34.93, 15, id="three-dark-repeats"),
        pytest.param(4, 0.5, 0.45, 71, 39.09, 43.08, 889, id="two-dark-repeats"),
        pytest.param(3, 0.25, 0.49, 49, 13.99, 17.64, 203, id="dark-for-three-frames"),
        pytest.param(4, 0.5, 0.94, 64, 15.98, 19.42, 34, id="other-lights"),
        pytest.param(6, 1.0, 0.42, 56, 16.25, 18.81, 515, id="one-dead-flash"),
    ],
)
@pytest.mark.campaign
def test_flashes_beside_a_break_are_complete_only_where_they_fired(
    lights: int,
    shutter: float,
    readout: float,
    frames: int,
    stops: float,
    begins: float,
    seed: int,
    make_plan: PlanMaker,
) -> None:
    plan = make_plan(height_px=48, width_px=12, lights=tuple("abcde"[:lights]), shutter=shutter, readout=readout)
    fired, profiles = broken_off(plan, seed, frames=frames, stops=stops, begins=begins)
    timing = timing_from_rows(plan, np.arange(frames), profiles)
    off, period_s = off_rows(plan, timing, fired, frames), plan.camera.frame_period_s
    assert off.max() < max(0.1, 4 * timing.phase_error_rows)
    inside = [one for one in fired if one.lights and 2 < one.start_s / period_s < frames - 3]
    assert len(off) > len(inside) - 6 * period_s / (plan.cycle_s / len(plan.cycle_slots))


@pytest.mark.parametrize(
    ("lights", "shutter", "readout", "frames", "stops", "many"),
    [
        pytest.param(3, 1.0, 0.3, 64, 13.9, 14, id="near-the-beginning"),
        pytest.param(4, 0.25, 1.0, 52, 25.14, 21, id="in-the-middle"),
        pytest.param(3, 0.5, 1.0, 63, 41.6, 19, id="near-the-end"),
    ],
)
@pytest.mark.parametrize("rest", [-0.6, 0.0, 0.04, 0.15])
@pytest.mark.campaign
def test_a_strobe_that_moves_by_many_frames_and_a_little_started_again(
    rest: float,
    lights: int,
    shutter: float,
    readout: float,
    frames: int,
    stops: float,
    many: int,
    make_plan: PlanMaker,
) -> None:
    plan = make_plan(height_px=48, width_px=12, lights=tuple("abcde"[:lights]), shutter=shutter, readout=readout)
    period_s, cycle_s = plan.camera.frame_period_s, plan.cycle_s * (1 + PPM * 1e-6)
    before, _ = broken_off(plan, 3, frames=frames, stops=stops, begins=frames + 9.0)
    first_s = next(one.start_s for one in before if one.slot == plan.cycle_slots[0])
    begins_s = first_s - many * period_s + rest * plan.shortest_flash_s
    begins_s += cycle_s * np.ceil(((stops + 0.5) * period_s - begins_s) / cycle_s)
    fired, profiles = broken_off(plan, 3, frames=frames, stops=stops, begins=begins_s / period_s)
    timing = timing_from_rows(plan, np.arange(frames), profiles)
    assert off_rows(plan, timing, fired, frames).max() < 4 * timing.phase_error_rows < 0.8
    if rest:
        assert not timing.dropped_frames
        own_s = np.array([one.start_s for one in fired])
        complete_s = np.array([one.start_s for one in timing.flashes if one.complete and one.lights])
        assert np.abs(complete_s[:, None] - own_s).min(axis=1).max() < 0.02 * plan.shortest_flash_s
    else:
        assert [hole.count for hole in timing.dropped_frames] == [many]


@pytest.mark.parametrize(("frames", "stops"), [(36, 30.2), (36, 33.2), (60, 30.2)])
def test_a_strobe_that_stops_within_a_frame_leaves_no_missing_frames(
    frames: int, stops: float, make_plan: PlanMaker
) -> None:
    plan = make_plan(height_px=48, width_px=12, lights=tuple("abcd"))
    _, profiles = broken_off(plan, 3, frames=frames, stops=stops, begins=frames + 9.0)
    timing = timing_from_rows(plan, np.arange(frames), profiles)
    assert not timing.dropped_frames
    assert not timing.repeated_frames
    last_s = max(one.start_s for one in timing.flashes if one.complete and one.lights)
    assert (stops - 3) * plan.camera.frame_period_s < last_s < stops * plan.camera.frame_period_s
    assert any("it had not begun or had stopped" in note for note in timing.notes)
