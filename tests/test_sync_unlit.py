"""A strobe that starts after the camera, stops before it, or is covered for a while."""

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from bench.timing_cases import Case
from bench.timing_scenes import plan_of, textured

from psvideo.errors import NoStrobeError
from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.model.rows.shutter import frames_touched
from psvideo.sync.find import timing_from_rows
from psvideo.sync.rowfit.beat import FoundClock
from psvideo.sync.rowfit.coarse.seed import first_guess
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.quiet import loud_part
from psvideo.sync.rowfit.unlit import unlit, with_unlit
from psvideo.sync.verdict.few_kinds import comes_again, shows_the_same
from psvideo.synth import Exposure, Noise, TrueClock, TrueFlash, expose

PlanMaker = Callable[..., Plan]
FRAMES = 110


@pytest.fixture
def plan(make_plan: PlanMaker) -> Plan:
    return make_plan(height_px=48, width_px=12)


def shot_of(plan: Plan) -> Exposure:
    rng = np.random.default_rng(5)
    plates = {slot: (0.2 + 0.5 * rng.random((48, 12))).astype(np.float32) for slot in plan.lit_slots}
    clock = TrueClock(phase_s=0.0123, offset_ppm=80.0)
    return expose(plates, plan, frames=FRAMES, clock=clock, ambient=0.02, noise=Noise(full_well_e=2e5, read_e=5))


def profiles_of(shot: Exposure, dark: slice) -> Doubles:
    """Return the shot's row means with some frames that ambient light alone is in."""
    profiles: Doubles = shot.frames.mean(axis=2, dtype=np.float64)
    profiles[dark] = profiles.min(axis=0) + 2e-4 * np.random.default_rng(1).random(profiles[dark].shape)
    return profiles


def laid_out(plan: Plan, profiles: Doubles) -> Profiles:
    return Profiles(
        value=profiles,
        index=np.arange(len(profiles), dtype=np.int64),
        period_s=plan.camera.frame_period_s,
        place=np.arange(float(profiles.shape[1])),
        window_start=np.zeros(1, np.int64),
    )


@pytest.mark.parametrize("dark", [slice(0, 40), slice(60, 110), slice(40, 75)])
def test_frames_without_the_strobe_are_left_out_and_said(dark: slice, plan: Plan) -> None:
    shot = shot_of(plan)
    timing = timing_from_rows(plan, np.arange(FRAMES), profiles_of(shot, dark))
    true_s = np.array([flash.start_s for flash in shot.flashes])
    off_s = np.abs(true_s[:, None] - timing.start_s).min(axis=0)
    assert off_s.max() < 0.03 * plan.camera.row_time_s
    assert timing.dropped_frames == ()
    assert timing.repeated_frames == ()
    count = dark.stop - dark.start
    assert any(f"No flash lights {count} frames in a row, {dark.start} to {dark.stop - 1}" in n for n in timing.notes)
    assert not any("fit no place in time" in note for note in timing.notes)
    whole = [flash for flash in timing.flashes if flash.complete]
    period_s = plan.camera.frame_period_s
    lit_s = np.delete(np.arange(FRAMES), dark) * period_s
    assert len(whole) > 0.8 * len(lit_s) * period_s / (plan.cycle_s / len(plan.cycle_slots))
    start_s, duration_s = (np.array([getattr(one, name) for one in whole]) for name in ("start_s", "duration_s"))
    first, last = frames_touched(plan.camera, start_s, duration_s)
    assert not ((first < dark.stop) & (last >= dark.start)).any()


@pytest.mark.parametrize("late", [9, 12])
def test_a_strobe_that_begins_a_little_late_is_timed_also_where_a_frame_is_lost(late: int, plan: Plan) -> None:
    shot = shot_of(plan)
    profiles = profiles_of(shot, slice(0, late))
    profiles[57] = 0.0
    timing = timing_from_rows(plan, np.arange(FRAMES), profiles, numbers=range(1001, 1001 + FRAMES))
    true_s = np.array([flash.start_s for flash in shot.flashes])
    off_s = np.abs(true_s[:, None] - timing.start_s).min(axis=0)
    assert off_s.max() < 0.03 * plan.camera.row_time_s
    assert timing.repeated_frames == ()
    assert timing.dropped_frames == ()
    assert any(f"No flash lights {late} frames in a row, 1001 to {1000 + late}:" in note for note in timing.notes)


def test_dark_slots_and_repeated_frames_are_not_left_out(make_plan: PlanMaker) -> None:
    plan = make_plan(height_px=48, width_px=12, readout=0.2)
    profiles = shot_of(plan).frames.mean(axis=2, dtype=np.float64)
    shown_five_times = np.repeat(profiles, 5, axis=0)
    assert (np.ptp(profiles, axis=1) < 0.01).sum() > 10
    for value in (profiles, shown_five_times):
        assert not unlit(plan, laid_out(plan, value)).any()


@pytest.mark.parametrize(("dim", "share"), [(90, 0.02), (102, 0.002)])
def test_a_subject_that_is_bright_for_a_moment_leaves_no_others_out(dim: int, share: float, plan: Plan) -> None:
    profiles = shot_of(plan).frames.mean(axis=2, dtype=np.float64)
    profiles[:dim] = 0.02 + share * (profiles[:dim] - 0.02)
    assert not unlit(plan, laid_out(plan, profiles)).any()


def test_frames_left_out_keep_their_places_among_those_that_were_found(plan: Plan) -> None:
    rows = laid_out(plan, np.zeros((9, 2)))
    dark = np.array([True, True, False, False, True, True, False, False, True])
    assert with_unlit(rows, np.array([2, 3, 6, 7]), dark).tolist() == list(range(9))
    assert with_unlit(rows, np.array([2, 4, 9, 10]), dark).tolist() == [0, 1, 2, 4, 5, 6, 9, 10, 11]
    assert with_unlit(rows, np.array([2, 3, 5, 6]), dark).tolist() == [0, 1, 2, 3, 4, 4, 5, 6, 7]


def begun_late(*, light: float, frames: int, late: int, lights: int, seed: int) -> tuple[Plan, Doubles, Doubles]:
    """Return a plan, the row means of a wall under lights that begin ``late`` frames after the camera, and the times
    at which they flash or would have."""
    plan = plan_of(lights=tuple("abcdefgh"[:lights]), fps=Fraction(60), durations_s=(1 / 600,), height_px=96)

    def dim(plan: Plan, rng: np.random.Generator) -> Callable[[TrueFlash], np.ndarray]:
        plate = textured(plan, rng)
        return lambda flash: np.float32(light * (flash.start_s > late / 60)) * plate(flash)

    filmed = Case(plan=plan, scene=dim, frames=frames, ambient=0.004).film(seed)
    true_s = np.array([flash.start_s for flash in filmed.exposure.flashes if flash.lights])
    return plan, np.array([frame.image.mean(axis=1, dtype=np.float64) for frame in filmed.frames]), true_s


@pytest.mark.parametrize(("lights", "frames", "seed"), [(3, 66, 0), (3, 70, 1), (8, 76, 2)])
def test_weak_lights_that_begin_late_are_timed_by_the_frames_that_they_light(
    lights: int, frames: int, seed: int
) -> None:
    """Noise is a tenth of their light: 59 dark frames were taken for lit ones, and clips were refused, or 8 to 34 rows
    off with flashes under wrong lights."""
    plan, profiles, true_s = begun_late(light=0.02, frames=frames, late=60, lights=lights, seed=seed)
    timing = timing_from_rows(plan, np.arange(frames), profiles)
    off_s = np.abs(true_s[:, None] - [flash.start_s for flash in timing.flashes if flash.lit]).min(axis=0)
    assert np.sqrt(np.mean(off_s**2)) < 2 * (timing.phase_error_s or 0.0) < plan.camera.row_time_s
    begins_s = true_s[true_s > 1.0][:1]
    (first,), _ = frames_touched(plan.camera, begins_s, np.full(1, plan.shortest_flash_s))
    assert any(f"No flash lights {first} frames in a row, 0 to {first - 1}:" in note for note in timing.notes)


@pytest.mark.parametrize("light", [0.004, 0.02])
@pytest.mark.parametrize(
    ("late", "frames", "said"),
    [
        (30, 36, "Frames 0 to 28 are dark .* 7 of 36 show flashes. These are few to tell 8 flashes"),
        (60, 63, "frames 0 to 58 are dark .* 4 of 63 show flashes. It takes 11 frames"),
    ],
)
def test_few_frames_behind_many_dark_ones_are_counted_and_not_said_to_come_again(
    light: float, late: int, frames: int, said: str
) -> None:
    plan, profiles, _ = begun_late(light=light, frames=frames, late=late, lights=8, seed=1)
    with pytest.raises(NoStrobeError, match=said):
        timing_from_rows(plan, np.arange(frames), profiles)


def test_frames_in_the_dark_are_no_light_that_shrinks_by_nothing() -> None:
    """Where nine tenths are dark they may be of a dark subject, and stay: "light ... by 0 %" was said of them."""
    plan, profiles, true_s = begun_late(light=1.0, frames=90, late=81, lights=3, seed=0)
    timing = timing_from_rows(plan, np.arange(90), profiles)
    found_s = np.array([flash.start_s for flash in timing.flashes if flash.lit])
    assert np.abs(true_s[:, None] - found_s).min(axis=0).max() < 0.5 * plan.camera.row_time_s
    assert timing.swing is None
    assert not any("by 0 %" in note for note in timing.notes)


def test_frames_that_noise_alone_parts_are_quiet_only_where_they_are_dark(plan: Plan) -> None:
    """Lights that are alike leave a global shutter's frames alike, too, and brighter than those that a flash splits."""
    rng = np.random.default_rng(6)
    light = np.concatenate([np.ones(20), 1 - 0.5 * rng.random(20)])[:, None]
    bright = 0.3 * light + 1e-3 * rng.standard_normal((40, 48))
    dark = 0.3 - bright
    assert loud_part(laid_out(plan, bright)) == slice(0, 40)
    assert loud_part(laid_out(plan, dark)) == slice(20, 40)
    dark[:20] += 0.02
    assert loud_part(laid_out(plan, dark)) == slice(0, 40), "another picture"


@pytest.mark.parametrize("dark", [0, 17, 30])
def test_where_noise_is_all_that_changes_nothing_is_left_out(plan: Plan, dark: int) -> None:
    """Also where one step parts the dark from the lit: either end then is noise up to the other."""
    value = np.random.default_rng(2).normal(0, 1e-3, (40, 48))
    value[dark:] += 0.3
    assert loud_part(laid_out(plan, value)) == slice(0, 40)


def test_a_picture_comes_again_where_frames_of_one_time_show_it(plan: Plan) -> None:
    """A strobe in step with the frames, with four of them a round, while the subject turns; then noise in its place."""
    rng = np.random.default_rng(7)
    pictures = rng.random((4, 48))
    turns = 1 + 0.3 * np.sin(np.arange(40)[:, None] / 9 + np.arange(48) / 20)
    steady = replace(plan, dark_s=plan.camera.frame_period_s - plan.shortest_flash_s)
    beat = replace(first_guess(steady), clock=FoundClock(phase_s=0.0, offset_ppm=0.0))
    assert shows_the_same(steady, laid_out(steady, turns * pictures[np.arange(40) % 4]), beat)
    assert comes_again(steady, laid_out(steady, turns * pictures[np.arange(40) % 4]), beat)
    assert not comes_again(steady, laid_out(steady, rng.random((40, 48))), beat)
    assert not comes_again(steady, laid_out(steady, pictures), beat), "each shows once"
