"""A flash that never fired, a light that dies during the clip, a black frame: named, incomplete, and no plate."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from psvideo.model.plan import Plan
from psvideo.model.rows.shutter import frames_touched, row_weights
from psvideo.model.timing import Timing
from psvideo.sync.find import timing_from_rows
from psvideo.sync.flashes_seen import flashes_of_fit
from psvideo.sync.rowfit.fit import find
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.tracking.course import window_frames
from psvideo.sync.unfired import around, incomplete, unfired_of
from psvideo.synth import Exposure, Noise, TrueClock, TrueFlash, expose

PlanMaker = Callable[..., Plan]
FRAMES = 140


@pytest.fixture
def plan(make_plan: PlanMaker) -> Plan:
    return make_plan(height_px=48, width_px=12)


def shot_of(plan: Plan, dead: Callable[[TrueFlash], bool], *, fade: float = 1.0) -> Exposure:
    """Expose a scene to which some flashes give no light; at the end all give a share ``fade`` of what they gave."""
    rng = np.random.default_rng(5)
    plates = {slot: (0.2 + 0.5 * rng.random((48, 12))).astype(np.float32) for slot in plan.lit_slots}

    def plate_of(flash: TrueFlash) -> NDArray[np.float32]:
        share = 1.0 + (fade - 1.0) * flash.start_s / (FRAMES * plan.camera.frame_period_s)
        lit = flash.slot in plates and not dead(flash)
        return plates[flash.slot] * np.float32(share) if lit else np.zeros((48, 12), np.float32)

    clock = TrueClock(phase_s=0.0123, offset_ppm=80.0)
    return expose(plate_of, plan, frames=FRAMES, clock=clock, ambient=0.02, noise=Noise(full_well_e=2e4, read_e=5))


def timing_of(plan: Plan, shot: Exposure) -> Timing:
    return timing_from_rows(plan, np.arange(FRAMES), shot.frames.mean(axis=2, dtype=np.float64))


def inside(plan: Plan, shot: Exposure) -> list[TrueFlash]:
    """Return the lit flashes well within the clip."""
    period_s = plan.camera.frame_period_s
    return [one for one in shot.flashes if one.lights and 3 * period_s < one.start_s < (FRAMES - 4) * period_s]


def held_against(plan: Plan, shot: Exposure, timing: Timing) -> list[bool]:
    """Return of every such flash whether it is listed as complete; times and lights must be right."""
    listed = []
    for true in inside(plan, shot):
        near = min(timing.flashes, key=lambda one: abs(one.start_s - true.start_s))
        assert abs(near.start_s - true.start_s) < 0.05 * plan.camera.row_time_s
        assert near.slot == true.slot
        listed.append(near.complete)
    return listed


@pytest.mark.parametrize("skipped", [(41,), (60, 62), (30, 70, 97), (5, 6, 7)])
def test_flashes_that_never_fired_are_named_and_incomplete(skipped: tuple[int, ...], plan: Plan) -> None:
    shot = shot_of(plan, lambda flash: flash.index in skipped)
    timing = timing_of(plan, shot)
    assert held_against(plan, shot, timing) == [flash.index not in skipped for flash in inside(plan, shot)]
    dark = {flash.lit[0] for flash in shot.flashes if flash.index in skipped and flash.lit}
    assert {note.split(":")[0] for note in timing.notes if "never fired" in note} == dark
    assert timing.dropped_frames == ()


def held_with_holes_in_the_light(plan: Plan, skipped: tuple[int, ...]) -> None:
    """Hold that flashes that are left out are all told, and that no frame is said to be missing or repeated."""
    shot = shot_of(plan, lambda flash: flash.index in skipped)
    timing = timing_of(plan, shot)
    assert held_against(plan, shot, timing) == [flash.index not in skipped for flash in inside(plan, shot)]
    assert not timing.dropped_frames
    assert not timing.repeated_frames
    dark = {flash.lit[0] for flash in shot.flashes if flash.index in skipped and flash.lit}
    assert {note.split(":")[0] for note in timing.notes if "never fired" in note} == dark


@pytest.mark.parametrize("skipped", [(47,), (49,), (46, 47), (49, 50), (47, 49), (49, 50, 51)])
def test_beside_a_dark_slot_missing_flashes_are_no_repeated_frames_and_no_hole(
    skipped: tuple[int, ...], plan: Plan
) -> None:
    held_with_holes_in_the_light(plan, skipped)


@pytest.mark.parametrize(("lights", "skipped"), [(1, (35,)), (1, (37,)), (2, (35, 36, 37))])
def test_between_dark_slots_the_missing_flashes_of_one_light_or_two_are_no_hole(
    lights: int, skipped: tuple[int, ...], make_plan: PlanMaker
) -> None:
    plan = make_plan(height_px=48, width_px=12, lights=("a", "b")[:lights])
    held_with_holes_in_the_light(plan, skipped)


@pytest.mark.parametrize(("readout", "dead"), [(0.35, 6), (0.5, 5)])
@pytest.mark.campaign
def test_several_missing_flashes_of_lights_that_pulse_are_no_hole_and_no_other_strobe(
    readout: float, dead: int, make_plan: PlanMaker
) -> None:
    """Frames in the dark were told as holes and repeated frames, and the clip was refused."""
    plan = make_plan(height_px=48, width_px=12, readout=readout, shutter=0.5, lights=tuple("abcde"))
    wall = np.random.default_rng(5).uniform(0.1, 0.9, (6, 48, 12))

    def scene(flash: TrueFlash) -> NDArray[np.float32]:
        pulse = 1 + 0.3 * np.sin(0.23 * flash.start_s / plan.camera.frame_period_s)
        lit = flash.slot in plan.lit_slots and not 20 <= flash.index < 20 + dead
        return np.asarray(lit * pulse * wall[flash.slot], np.float32)

    clock = TrueClock(phase_s=0.0123, offset_ppm=80.0)
    shot = expose(scene, plan, frames=100, clock=clock, noise=Noise(full_well_e=2e4, read_e=5))
    timing = timing_from_rows(plan, np.arange(100), shot.frames.mean(axis=2, dtype=np.float64))
    assert not timing.dropped_frames
    assert not timing.repeated_frames
    assert not any("started again" in note for note in timing.notes)
    true_s = np.array([flash.start_s for flash in shot.flashes])
    off_s = [np.abs(true_s - one.start_s).min() for one in timing.flashes if one.complete]
    assert max(off_s) < 0.4 * timing.row_time_s
    assert max(off_s) < 3 * (timing.phase_error_s or 0.0)


@pytest.mark.parametrize("at", [52, 53])
def test_beside_a_dark_slot_a_frame_that_stands_in_for_the_next_is_repeated(at: int, plan: Plan) -> None:
    shot = shot_of(plan, lambda _: False)
    shot.frames[at] = 1.0005 * shot.frames[at - 1]
    timing = timing_of(plan, shot)
    assert timing.repeated_frames == (at,)
    assert not any("never fired" in note for note in timing.notes)


@pytest.mark.parametrize("share", [0.2, 0.5, 0.85])
def test_a_light_that_dies_is_named_from_when_it_does(share: float, plan: Plan) -> None:
    slot, from_s = plan.lit_slots[1], share * FRAMES * plan.camera.frame_period_s
    shot = shot_of(plan, lambda flash: flash.slot == slot and flash.start_s > from_s)
    timing = timing_of(plan, shot)
    fired = [flash.slot != slot or flash.start_s <= from_s for flash in inside(plan, shot)]
    assert held_against(plan, shot, timing) == fired
    [note] = [note for note in timing.notes if "never fired" in note]
    assert note.startswith(plan.flashes[slot].lit[0])
    assert not any("exposure or gain" in note for note in timing.notes)


@pytest.mark.parametrize("share", [0.3, 0.6])
def test_a_dead_light_has_no_flash_below_360_degrees_either(share: float, make_plan: PlanMaker) -> None:
    """Flashes that fall between two exposures show hardly any of themselves: those of a dead light were complete."""
    plan = make_plan(height_px=48, width_px=12, shutter=0.25, readout=0.6, dark=False)
    slot, period_s = plan.lit_slots[1], plan.camera.frame_period_s
    from_s = share * FRAMES * period_s
    shot = shot_of(plan, lambda flash: flash.slot == slot and flash.start_s > from_s)
    profiles = shot.frames.mean(axis=2, dtype=np.float64)
    timing = timing_from_rows(plan, np.arange(FRAMES), profiles)
    name = next(note.split(":")[0] for note in timing.notes if "never fired" in note)
    dead_s = np.array([one.start_s for one in shot.flashes if one.slot == slot and one.start_s > from_s])
    complete_s = np.array([one.start_s for one in timing.flashes if one.complete])
    assert np.abs(complete_s[:, None] - dead_s).min() > 5 * plan.camera.row_time_s
    fired = [one for one in inside(plan, shot) if one.slot == slot and one.start_s < from_s]
    named = [one for one in timing.flashes if one.complete and name in one.lights]
    assert len(named) >= len(fired) - 2


def test_below_360_degrees_a_flash_that_few_rows_see_is_missing_if_these_are_dark(make_plan: PlanMaker) -> None:
    plan = make_plan(height_px=48, width_px=12, shutter=0.5, readout=0.65)
    whole = inside(plan, shot_of(plan, lambda _: False))
    start_s, lasts_s = (np.array([getattr(one, name) for one in whole]) for name in ("start_s", "duration_s"))
    squared = (row_weights(plan.camera, start_s, lasts_s, frames=range(FRAMES)).sum(axis=1) ** 2).mean(axis=1)
    few = next(one.index for one, share in zip(whole, squared, strict=True) if 0.1 < share < 0.19)
    shot = shot_of(plan, lambda flash: flash.index == few)
    timing = timing_of(plan, shot)
    assert held_against(plan, shot, timing) == [flash.index != few for flash in whole]
    assert len(timing.notes) == 1
    assert "1 flash never fired" in timing.notes[0]


@pytest.mark.parametrize(("begins", "ends"), [(6.5, None), (5.2, None), (None, 133.4)])
def test_where_a_strobe_began_or_stopped_no_flash_beyond_is_complete(
    begins: float | None, ends: float | None, plan: Plan
) -> None:
    """A part of a clip with a few frames in the dark, in which several flashes in a row would have fired."""
    period_s = plan.camera.frame_period_s
    first_s, last_s = (begins or 0.0) * period_s, (ends or FRAMES) * period_s
    whole, part = (
        shot_of(plan, dead).frames.mean(axis=2, dtype=np.float64)
        for dead in (lambda _: False, lambda flash: not first_s < flash.start_s < last_s)
    )
    rows = Profiles(
        value=whole,
        index=np.arange(FRAMES),
        period_s=period_s,
        place=np.arange(48.0),
        window_start=np.zeros(1, np.int64),
    )
    found = find(plan, rows.windowed(window_frames(plan)))
    flashes = flashes_of_fit(plan, found, found.fit.beat)
    found = replace(found, rows=replace(found.rows, value=part))
    unfired = unfired_of(plan, found, flashes, breaks=(begins is not None, ends is not None))
    told = incomplete(flashes, unfired.never | unfired.beside)
    within = [flash for flash in told if first_s - 1e-5 < flash.start_s < last_s]
    beyond = [flash for flash in told if flash not in within]
    assert sum(not flash.is_dark for flash in beyond) >= 3
    assert any(flash.is_dark for flash in beyond)
    assert not any(flash.complete for flash in beyond)
    assert sum(flash.complete for flash in within) >= len(within) - 2


def test_the_first_light_is_that_of_the_first_flash_that_fired(make_plan: PlanMaker) -> None:
    """One that never fired counted as the clip's first complete one, and all lights had wrong names."""
    plan = make_plan(height_px=48, width_px=12, dark=False)
    shot = shot_of(plan, lambda flash: 2.0 < flash.start_s / plan.camera.frame_period_s < 3.1)
    profiles = shot.frames[:60].mean(axis=2, dtype=np.float64)
    timing = timing_from_rows(plan, np.arange(60), profiles, first_light="left")
    assert next(flash for flash in timing.flashes if flash.complete).lit == ("left",)


def test_light_goes_on_where_it_does_on_either_side_or_among_most_of_the_nearest() -> None:
    dark, unknown = -1e-3, np.nan
    three = around(np.array([1.0, 1.0, dark, dark, dark, 1.0, 1.0]), 3)
    assert three[2:5].tolist() == [1.0, 1.0, 1.0]
    left = around(np.array([1.0, 1.0, 1.0, dark, dark, dark, dark, dark]), 3)
    assert left[3:].max() <= 0.5
    first = around(np.array([unknown, dark, dark, 1.0, 1.0, 1.0]), 3)
    assert first[1:3].tolist() == [1.0, 1.0]
    assert around(np.full(5, dark), 3).max() <= 1e-9
    assert around(np.full(5, unknown), 3).max() <= 1e-9


def test_a_subject_that_leaves_takes_the_light_of_all_and_no_flash_is_missing(plan: Plan) -> None:
    shot = shot_of(plan, lambda _: False, fade=0.02)
    timing = timing_of(plan, shot)
    assert all(held_against(plan, shot, timing))
    assert not any("never fired" in note for note in timing.notes)


@pytest.mark.parametrize(("shutter", "at"), [(1.0, 47), (1.0, 51), (0.5, 46), (0.5, 49)])
def test_a_black_frame_is_named_and_spoils_what_it_saw_and_no_light(
    shutter: float, at: int, make_plan: PlanMaker
) -> None:
    plan = make_plan(height_px=48, width_px=12, shutter=shutter)
    shot = shot_of(plan, lambda _: False)
    shot.frames[at] = 0.0
    timing = timing_of(plan, shot)
    first, last = frames_touched(plan.camera, timing.start_s, timing.duration_s)
    saw = {flash.index for flash, a, b in zip(timing.flashes, first, last, strict=True) if a <= at <= b}
    period_s = plan.camera.frame_period_s
    within = [one for one in timing.flashes if 3 * period_s < one.start_s < (FRAMES - 4) * period_s]
    assert {flash.index for flash in within if not flash.complete} == saw
    assert len(saw) >= 1
    assert any(f"Frame {at} is black" in note for note in timing.notes)
    assert not any("never fired" in note for note in timing.notes)
    assert not timing.dropped_frames
    assert not timing.repeated_frames


def test_beside_missing_flashes_those_of_which_little_was_seen_may_be_missing_too(make_plan: PlanMaker) -> None:
    """Of dead flashes that fell between two exposures some stayed complete, as those of their lights before and after
    fired."""
    plan = make_plan(height_px=48, width_px=12, shutter=0.5, readout=0.55)
    skipped = range(40, 46)
    shot = shot_of(plan, lambda flash: flash.index in skipped)
    timing = timing_of(plan, shot)
    dead_s = np.array([one.start_s for one in shot.flashes if one.index in skipped and one.lights])
    complete_s = np.array([one.start_s for one in timing.flashes if one.complete and one.lights])
    assert np.abs(complete_s[:, None] - dead_s).min() > 5 * plan.camera.row_time_s
    fired = [one for one in inside(plan, shot) if one.index not in skipped]
    assert len(complete_s) > 0.95 * len(fired)
