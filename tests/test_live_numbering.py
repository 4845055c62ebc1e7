"""Frames by their numbers and by their places in time: what the live timing says of both holds together."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from live_shots import LIVE_ROWS, apart_rows, shoot, taken

from psvideo.live.chain import Chain
from psvideo.live.followed_timing import followed_timing
from psvideo.model.plan import Plan
from psvideo.model.timing import places_in_time
from psvideo.synth import TrueClock

PlanMaker = Callable[..., Plan]
FIRST = 1001


def hold_together(plan: Plan, course: list[int], *, dark: int = 0) -> Chain:
    """Film a strobe and take the frames that a course names, after some dark ones: every frame of the file is placed
    where it was, seen from the flashes of the same file."""
    shot = shoot(plan, frames=max(course) + 1)
    shape = plan.camera.height_px, plan.camera.width_px
    nothing = np.random.default_rng(1).normal(0, 1e-4, (dark, *shape)).astype(np.float32)
    chain = taken(Chain(plan=plan), [*nothing, *(shot.frames[at] for at in course)])
    assert chain.state == "locked"
    timing = followed_timing(chain, clip="clip", first_number=FIRST)
    numbers = range(FIRST, FIRST + dark + len(course))
    places = places_in_time(timing, list(numbers))
    late = {places[number] - at for number, at in zip(numbers[dark:], course, strict=True) if number in places}
    assert len(late) == 1
    true_s = np.array([flash.start_s for flash in shot.flashes]) + late.pop() * plan.camera.frame_period_s
    whole = replace(timing, flashes=tuple(one for one in timing.flashes if one.complete))
    assert len(whole.flashes) > 0.8 * len(shot.flashes)
    assert np.abs(apart_rows(whole, true_s, plan)).max() < LIVE_ROWS
    return chain


@pytest.mark.parametrize("again", [(20,), (35,), (12, 30), (20, 20)])
def test_a_frame_that_the_finder_sees_twice_is_repeated_in_the_timing_and_delays_nothing(
    make_plan: PlanMaker, again: tuple[int, ...]
) -> None:
    plan = make_plan(width_px=8, height_px=96)
    course = sorted([*range(110), *again])
    chain = hold_together(plan, course)
    twice = [number for number in range(1, len(course)) if course[number] == course[number - 1]]
    timing = followed_timing(chain, clip="clip", first_number=FIRST)
    assert timing.repeated_frames == tuple(number + FIRST for number in twice)
    assert timing.dropped_frames == ()
    assert chain.lost_frames == 0


@pytest.mark.parametrize("dark", [5, 12])
def test_dark_frames_before_the_strobe_starts_are_counted_alike_by_numbers_and_by_flashes(
    make_plan: PlanMaker, dark: int
) -> None:
    hold_together(make_plan(width_px=8, height_px=96), list(range(110)), dark=dark)


@pytest.mark.parametrize("again", [(70,), (71, 90), (70, 70), (80, 80, 80)])
def test_a_frame_that_a_camera_repeats_after_the_lock_is_recognised_and_costs_no_new_lock(
    make_plan: PlanMaker, again: tuple[int, ...]
) -> None:
    course = sorted([*range(130), *again])
    chain = hold_together(make_plan(width_px=8, height_px=96), course)
    twice = [number for number in range(1, len(course)) if course[number] == course[number - 1]]
    timing = followed_timing(chain, clip="clip", first_number=FIRST)
    assert timing.repeated_frames == tuple(number + FIRST for number in twice)
    assert (timing.dropped_frames, chain.lost_frames, len(chain.followed)) == ((), 0, 1)


@pytest.mark.parametrize("instead", [(70,), (70, 71), (60, 90)])
def test_a_frame_that_is_sent_again_instead_of_one_that_was_lost_is_repeated_and_that_one_missing(
    make_plan: PlanMaker, instead: tuple[int, ...]
) -> None:
    """A grabber that lost a frame hands out the one before it a second time, and counts on."""
    course = list(range(130))
    for at in instead:
        course[at] = course[at - 1]
    chain = hold_together(make_plan(width_px=8, height_px=96), course)
    timing = followed_timing(chain, clip="clip", first_number=FIRST)
    assert timing.repeated_frames == tuple(at + FIRST for at in instead)
    assert (chain.lost_frames, len(chain.followed)) == (len(instead), 1)


def test_a_camera_that_hangs_and_sends_one_picture_for_ever_is_lost(make_plan: PlanMaker) -> None:
    plan = make_plan(width_px=8, height_px=96)
    frames = list(shoot(plan, frames=100).frames)
    assert taken(Chain(plan=plan), [*frames, *[frames[-1]] * 60]).state == "lost"


def test_a_repeated_frame_and_missing_ones_are_told_apart(make_plan: PlanMaker) -> None:
    course = [at for at in sorted([*range(140), 15]) if at not in (60, 90)]
    chain = hold_together(make_plan(width_px=8, height_px=96), course)
    assert chain.lost_frames == 2
    timing = followed_timing(chain, clip="clip", first_number=FIRST)
    assert timing.repeated_frames == (FIRST + 16,)
    assert [hole.after for hole in timing.dropped_frames] == [FIRST + 60, FIRST + 89]


@pytest.mark.parametrize(("dark", "noise"), [(40, 1e-4), (40, 0.0), (100, 0.0), (3, 1e-4)])
def test_no_flash_is_listed_while_the_strobe_stands_still(make_plan: PlanMaker, dark: int, noise: float) -> None:
    """It stops, nothing is lit for a while, and it starts again; frames that are all the same are nothing seen, too."""
    plan = make_plan(width_px=8, height_px=96)
    shape = plan.camera.height_px, plan.camera.width_px
    before, after = shoot(plan, frames=100), shoot(plan, frames=110, clock=TrueClock(phase_s=0.0353, offset_ppm=-20.0))
    nothing = noise * np.random.default_rng(1).normal(0, 1, (dark, *shape)).astype(np.float32)
    chain = taken(Chain(plan=plan), [*before.frames, *nothing, *after.frames])
    assert (chain.state, len(chain.followed)) == ("locked", 2)
    timing = followed_timing(chain, clip="clip", first_number=0)
    numbers = range(100 + dark + 110)
    places = places_in_time(timing, list(numbers))
    begins_s = (places[numbers[-1]] - 109) * plan.camera.frame_period_s
    true_s = [flash.start_s for flash in before.flashes if flash.complete]
    true_s += [flash.start_s + begins_s for flash in after.flashes]
    whole = replace(timing, flashes=tuple(one for one in timing.flashes if one.complete))
    assert np.abs(apart_rows(whole, np.array(true_s), plan)).max() < LIVE_ROWS
    assert len(whole.flashes) > len(true_s) - 12
