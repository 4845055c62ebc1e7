"""The live clock: followed frame by frame, held against the offline sync of the same frames and against the truth."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest
from live_shots import LIVE_ROWS, apart_rows, plates_of, profiles_of, shoot, taken
from memory_frame import MemoryFrame

from psvideo.errors import UsageError
from psvideo.formats.timing_json import parse_timing, timing_record
from psvideo.live.chain import Chain
from psvideo.live.following.catching_up import caught_up
from psvideo.live.following.follow import Follower, State
from psvideo.live.following.frame_places import Hole
from psvideo.live.following.history import timing_of
from psvideo.live.following.light_names import guess_words, order_of
from psvideo.live.following.lock import check_followed, frames_to_lock, lock
from psvideo.live.following.phase_filter import Measured, smoothed
from psvideo.live.incoming.live_frame import LiveFrame
from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.model.timing import Timing
from psvideo.sync.find import timing_from_rows
from psvideo.synth import TrueClock
from psvideo.synth.lamps.true_flashes import TrueFlash

PlanMaker = Callable[..., Plan]


@dataclass(frozen=True, kw_only=True)
class Followed:
    """What following a clip came to: the follower at its end, and every change of its state with its frame."""

    follower: Follower
    states: list[tuple[int, State]]

    @property
    def timing(self) -> Timing:
        return timing_of([self.follower], clip="clip")


def followed(plan: Plan, values: Doubles) -> Followed:
    first = frames_to_lock(plan)
    follower = caught_up(plan, lock(plan, np.arange(first), values[:first]), list(values[:first]))
    states = [(first, follower.state)]
    for number in range(first, len(values)):
        follower.add(number, values[number])
        if follower.state != states[-1][1]:
            states.append((number, follower.state))
    return Followed(follower=follower, states=states)


def switched_off(plan: Plan, slot: int, at_s: float) -> Callable[[TrueFlash], np.ndarray | None]:
    plates = plates_of(plan)

    def plate(flash: TrueFlash) -> np.ndarray | None:
        gone = flash.slot == slot and flash.start_s > at_s
        return None if flash.is_dark else plates[flash.slot] * np.float32(not gone)

    return plate


@pytest.mark.parametrize("what", ["drift", "drops", "gain", "switched off"])
def test_live_agrees_with_offline_and_truth(make_plan: PlanMaker, what: str) -> None:
    plan = make_plan(lights=("key", "left", "right", "top"), width_px=8, height_px=96)
    shot = {
        "drift": lambda: shoot(plan, clock=TrueClock(phase_s=0.0123, offset_ppm=30.0, drift_ppm_per_s=2.0)),
        "drops": lambda: shoot(plan, dropped=[80, 81, 82, 120]),
        "gain": lambda: shoot(plan, gain=[1.0] * 90 + [0.5] * 60),
        "switched off": lambda: shoot(plan, plates=switched_off(plan, 1, 0.7)),
    }[what]()
    values = profiles_of(shot)
    found = followed(plan, values)
    assert found.follower.state == "locked"
    assert found.timing.order == "marker"
    assert np.abs(apart_rows(found.timing, np.array([flash.start_s for flash in shot.flashes]), plan)).max() < LIVE_ROWS
    offline = timing_from_rows(plan, np.arange(len(values)), values)
    assert np.abs(apart_rows(found.timing, offline.start_s, plan)).max() < LIVE_ROWS
    names = {round(flash.start_s / plan.dark_s): flash.lights for flash in offline.flashes}
    assert all(names[round(flash.start_s / plan.dark_s)] == flash.lights for flash in found.timing.flashes)
    assert sum(hole.count for hole in found.follower.places.holes) == (4 if what == "drops" else 0)


@pytest.mark.parametrize("what", ["strobe restarted", "lens covered"])
def test_a_lost_lock_is_said_within_a_few_frames(make_plan: PlanMaker, what: str) -> None:
    plan = make_plan(width_px=8, height_px=96)
    before = profiles_of(shoot(plan, frames=100))
    if what == "strobe restarted":
        after = profiles_of(shoot(plan, frames=60, clock=TrueClock(phase_s=0.0293, offset_ppm=30.0)))
    else:
        after = np.random.default_rng(1).normal(0, 1e-4, (60, plan.camera.height_px))
    found = followed(plan, np.concatenate([before, after]))
    doubted = next(number for number, state in found.states if state == "unsure")
    lost = next(number for number, state in found.states if state == "lost")
    assert 100 <= doubted < 106
    assert lost < 135


def test_a_strobe_that_was_started_again_is_found_again(make_plan: PlanMaker) -> None:
    plan = make_plan(width_px=8, height_px=96)
    again = shoot(plan, frames=100, clock=TrueClock(phase_s=0.0353, offset_ppm=-20.0))
    chain = Chain(plan=plan)
    states: list[tuple[int, State]] = []
    for index, image in enumerate([*shoot(plan, frames=90).frames, *again.frames]):
        chain.take(LiveFrame(index=index, coded=MemoryFrame(index, image).coded, came_s=0.0))
        if not states or states[-1][1] != chain.state:
            states.append((index, chain.state))
    assert [state for _, state in states] == ["seeking", "locked", "unsure", "lost", "locked"]
    assert states[-1][0] < 90 + 24 + 48 + 16, "what came since the loss is enough to look in"
    timing = timing_of(chain.followed, clip="clip")
    later = replace(timing, flashes=tuple(one for one in timing.flashes if one.start_s > 1.25))
    true_s = np.array([flash.start_s for flash in again.flashes]) + 90 * plan.camera.frame_period_s
    assert len(later.flashes) > 20
    assert np.abs(apart_rows(later, true_s, plan)).max() < LIVE_ROWS


def test_frames_that_the_lock_or_the_follower_finds_missing_are_counted_and_keep_their_places_after_a_restart(
    make_plan: PlanMaker,
) -> None:
    """One frame is missing in the frames of the first lock, one later, and then the strobe starts again."""
    plan = make_plan(width_px=8, height_px=96)
    period_s, missing = plan.camera.frame_period_s, (20, 65)
    again = shoot(plan, frames=110, clock=TrueClock(phase_s=0.0353, offset_ppm=-20.0))
    shot = [*shoot(plan, frames=90).frames, *again.frames]
    chain = Chain(plan=plan)
    for index, image in enumerate(image for at, image in enumerate(shot) if at not in missing):
        chain.take(LiveFrame(index=index, coded=MemoryFrame(index, image).coded, came_s=0.0))
    assert len(chain.followed) == 2
    assert chain.state == "locked"
    assert [hole for one in chain.followed for hole in one.places.holes] == [
        Hole(before=20, count=1),
        Hole(before=64, count=1),
    ]
    assert chain.lost_frames == 2
    assert chain.followed[-1].span is not None
    assert chain.followed[-1].span[1] == len(shot) - 1
    timing = timing_of(chain.followed, clip="clip")
    later = replace(timing, flashes=tuple(one for one in timing.flashes if one.start_s > 1.3))
    true_s = np.array([flash.start_s for flash in again.flashes]) + 90 * period_s
    assert len(later.flashes) > 20
    assert np.abs(apart_rows(later, true_s, plan)).max() < LIVE_ROWS


def test_the_smoothed_clock_is_better_than_the_filtered_one() -> None:
    at_s = np.arange(200) / 15.0
    true_s = 5e-7 * at_s**2
    rng = np.random.default_rng(0)
    points = [
        Measured(at_s=t, late_s=late + noise, error_s=1e-6)
        for t, late, noise in zip(at_s.tolist(), true_s.tolist(), rng.normal(0, 1e-6, 200).tolist(), strict=True)
    ]
    off = smoothed(points) - true_s
    assert np.sqrt(np.mean(off**2)) < 0.3e-6


def test_a_synced_plan_is_refused_in_one_paragraph(make_plan: PlanMaker) -> None:
    with pytest.raises(UsageError, match="Record the take"):
        check_followed(make_plan(mode="synced"))


UNMARKED = {"lights": ("key", "left", "right", "top"), "dark": False, "width_px": 8, "height_px": 96}


def test_names_after_a_second_lock_are_a_guess_and_said_to_be(make_plan: PlanMaker) -> None:
    plan = make_plan(**UNMARKED)
    before = shoot(plan, frames=90)
    named = next(flash for flash in before.flashes if flash.start_s > 0).lights
    first_light = next(iter(named))
    chain = taken(Chain(plan=plan, first_light=first_light), list(before.frames))
    known = timing_of(chain.followed, clip="clip", first_light=first_light)
    assert (known.order, known.order_note) == ("given", "")
    again = shoot(plan, frames=110, clock=TrueClock(phase_s=0.0353, offset_ppm=-20.0))
    chain = taken(Chain(plan=plan, first_light=first_light), [*before.frames, *again.frames])
    assert len(chain.followed) == 2
    timing = timing_of(chain.followed, clip="clip", first_light=first_light)
    assert timing.order == "guess"
    assert timing.order_note == guess_words(chain.followed, first_light=first_light)
    assert "found again at" in timing.order_note
    assert "`first_light` speaks of the first frames alone" in timing.order_note
    assert parse_timing(timing_record(timing), source="timing.json").order_note == timing.order_note


@pytest.mark.parametrize("first_light", ["key", None])
def test_names_after_a_first_search_that_failed_are_a_guess_and_said_to_be(
    make_plan: PlanMaker, first_light: str | None
) -> None:
    plan = make_plan(**UNMARKED)
    dark = np.zeros((plan.camera.height_px, plan.camera.width_px), np.float32)
    chain = taken(Chain(plan=plan, first_light=first_light), [*[dark] * 100, *shoot(plan, frames=90).frames])
    assert chain.state == "locked"
    assert order_of(chain.followed) == "guess"
    said = guess_words(chain.followed, first_light=first_light)
    assert ("was found in later ones" if first_light else "the picture shows no marker") in said


def test_a_light_that_never_fires_is_what_hides_a_marker_and_no_other_plan_is_asked_for(make_plan: PlanMaker) -> None:
    plan = make_plan(lights=("key", "left", "right", "top"), width_px=8, height_px=96)
    plates = {slot: plate * (slot != plan.lit_slots[1]) for slot, plate in plates_of(plan).items()}
    chain = taken(Chain(plan=plan), list(shoot(plan, frames=110, plates=plates).frames))
    assert order_of(chain.followed) == "guess"
    said = guess_words(chain.followed, first_light=None)
    assert "see that every light fires" in said
    assert "Flash a plan" not in said


def test_names_that_a_marker_shows_are_no_guess_however_often_the_strobe_is_found(make_plan: PlanMaker) -> None:
    plan = make_plan(width_px=8, height_px=96)
    again = shoot(plan, frames=110, clock=TrueClock(phase_s=0.0353, offset_ppm=-20.0))
    chain = taken(Chain(plan=plan), [*shoot(plan, frames=90).frames, *again.frames])
    assert len(chain.followed) == 2
    assert order_of(chain.followed) == "marker"
    assert not guess_words(chain.followed, first_light=None)


def is_lost_and_found_again(plan: Plan, again: TrueClock, *, missing: int) -> None:
    """Frames are missing, then the strobe starts again: nothing of either is taken for the other."""
    period_s = plan.camera.frame_period_s
    before, after = shoot(plan, frames=110), shoot(plan, frames=120, clock=again)
    chain = taken(Chain(plan=plan), [*before.frames[:80], *before.frames[80 + missing :], *after.frames])
    assert chain.state == "locked"
    assert len(chain.followed) == 2
    assert chain.lost_frames == missing
    holes = [hole for one in chain.followed for hole in one.places.holes]
    assert holes == ([Hole(before=80, count=missing)] if missing else [])
    timing = timing_of(chain.followed, clip="clip")
    whole = replace(timing, flashes=tuple(one for one in timing.flashes if one.complete))
    true_s = [flash.start_s for flash in before.flashes if flash.start_s < 111 * period_s]
    true_s += [flash.start_s + 110 * period_s for flash in after.flashes]
    assert sum(one.start_s > 112 * period_s for one in whole.flashes) > 60
    assert np.abs(apart_rows(whole, np.array(true_s), plan)).max() < LIVE_ROWS


@pytest.mark.parametrize(
    ("missing", "rows"),
    [(8, -0.2), *(pytest.param(*case, marks=pytest.mark.campaign) for case in ((18, 0.6), (16, 0.4)))],
)
def test_a_strobe_that_was_started_again_where_missing_frames_nearly_explain_it_is_lost_and_found_again(
    make_plan: PlanMaker, missing: int, rows: float
) -> None:
    """It starts again within a row of where it was to be some frames later."""
    plan = make_plan(width_px=8, height_px=96)
    went_on_s = 0.0123 - (110 + missing) * plan.camera.frame_period_s + rows * plan.camera.row_time_s
    clock = TrueClock(phase_s=went_on_s % (plan.cycle_s * (1 + 30e-6)), offset_ppm=30.0)
    is_lost_and_found_again(plan, clock, missing=2)


@pytest.mark.parametrize(
    ("lights", "clock", "missing"),
    [
        (3, TrueClock(phase_s=0.00959367, offset_ppm=30.04), 1),
        (3, TrueClock(phase_s=0.02754083, offset_ppm=-42.25), 4),
        (4, TrueClock(phase_s=0.00879599, offset_ppm=23.04), 0),
    ],
    ids=["six rows off", "fitted brightnesses explain it", "a hole is taken back"],
)
def test_a_strobe_that_was_started_again_is_not_the_one_from_before_though_its_flashes_lie_near(
    make_plan: PlanMaker, lights: int, clock: TrueClock, missing: int
) -> None:
    plan = make_plan(lights=("key", "left", "right", "top")[:lights], width_px=8, height_px=96)
    is_lost_and_found_again(plan, clock, missing=missing)


@pytest.mark.parametrize("covered", [30, pytest.param(60, marks=pytest.mark.campaign), 200])
def test_a_lens_that_is_covered_for_a_while_is_looked_through_again_with_one_lock(
    make_plan: PlanMaker, covered: int
) -> None:
    """What was found in frames that show the strobe no more is no lock: else one follows the other, every frame."""
    plan = make_plan(lights=("key", "left", "right", "top"), width_px=8, height_px=96)
    shot = shoot(plan, frames=200 + covered)
    shape = plan.camera.height_px, plan.camera.width_px
    dark = np.random.default_rng(1).normal(0, 1e-4, (covered, *shape)).astype(np.float32)
    chain = taken(Chain(plan=plan), [*shot.frames[:100], *dark, *shot.frames[100 + covered :]])
    assert chain.state == "locked"
    assert chain.lost_frames == 0
    assert len(chain.followed) <= 2
    timing = timing_of(chain.followed, clip="clip")
    assert sum(one.start_s > (100 + covered) * plan.camera.frame_period_s for one in timing.flashes) > 50
    assert np.abs(apart_rows(timing, np.array([flash.start_s for flash in shot.flashes]), plan)).max() < LIVE_ROWS


def test_a_strobe_that_starts_again_while_it_is_searched_for_is_followed_until_then_and_found_again(
    make_plan: PlanMaker,
) -> None:
    plan = make_plan(width_px=8, height_px=96)
    before, after = shoot(plan, frames=90), shoot(plan, frames=110, clock=TrueClock(phase_s=0.0353, offset_ppm=-20.0))
    waiting: list[Callable[[], None]] = []
    chain = Chain(plan=plan, search=waiting.append)
    searches = 0
    for index, image in enumerate([*before.frames, *after.frames]):
        chain.take(LiveFrame(index=index, coded=MemoryFrame(index, image).coded, came_s=0.0))
        if waiting and index > 90 + 40:  # the first search ends when the strobe has long started again
            searches += 1
            waiting.pop()()
    assert chain.state == "locked"
    assert (len(chain.followed), searches) == (2, 2)
    timing = timing_of(chain.followed, clip="clip")
    true_s = np.array([flash.start_s for flash in before.flashes])
    true_s = np.concatenate([true_s, [flash.start_s + 90 * plan.camera.frame_period_s for flash in after.flashes]])
    whole = replace(timing, flashes=tuple(one for one in timing.flashes if one.complete))
    assert len(whole.flashes) > 120
    assert np.abs(apart_rows(whole, true_s, plan)).max() < LIVE_ROWS
