"""Timing found in movies that were re-timed: frames left out or repeated in a pattern, holes at the very ends."""

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
from numpy.typing import NDArray

from psvideo.errors import PsvideoError
from psvideo.model.plan import Plan
from psvideo.model.timing import DroppedFrames, Timing, places_in_time
from psvideo.sync.find import timing_from_rows
from psvideo.sync.rowfit.coarse import seed as seed_module
from psvideo.sync.rowfit.coarse import seed_choice
from psvideo.sync.rowfit.coarse.retime import Numbering, regular_step, twins
from psvideo.sync.rowfit.coarse.seed_choice import find_seed, other_seeds
from psvideo.sync.rowfit.fit import find
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.tracking.course import followed, memory_frames
from psvideo.sync.rowfit.tracking.track import track
from psvideo.sync.verdict.believed import convincing
from psvideo.sync.verdict.refusal import clock_too_far
from psvideo.synth import Exposure, Noise, TrueClock, expose

PlanMaker = Callable[..., Plan]
NOISE = Noise(full_well_e=20_000, read_e=8)
FRAMES = 80


@pytest.fixture
def plan(make_plan: PlanMaker) -> Plan:
    return make_plan(height_px=96, width_px=12)


def shot_of(plan: Plan, frames: int, ppm: float = 40.0) -> Exposure:
    """A wall of noise, another one under each light."""
    rng = np.random.default_rng(3)
    shape = (plan.camera.height_px, plan.camera.width_px)
    plates = {slot: (0.2 + 0.5 * rng.random(shape)).astype(np.float32) for slot in plan.lit_slots}
    clock = TrueClock(phase_s=0.0123, offset_ppm=ppm)
    return expose(plates, plan, frames=frames, clock=clock, noise=NOISE, bits=12)


def profiles_of(plan: Plan, shot: Exposure) -> Profiles:
    """Return the shot's row profiles as they are laid out for fitting."""
    return Profiles(
        value=shot.frames.mean(axis=2, dtype=np.float64),
        index=np.arange(len(shot.frames)),
        period_s=plan.camera.frame_period_s,
        place=np.arange(float(plan.camera.height_px)),
        window_start=np.zeros(1, np.int64),
    )


def pattern(step: str, lead: int = 0, frames: int = FRAMES) -> NDArray[np.int64]:
    """Return which moments a clip shows that goes on by ``step`` moments a frame."""
    ratio = Fraction(step)
    return (np.arange(frames) * ratio.numerator + lead) // ratio.denominator


def retimed(plan: Plan, shown: NDArray[np.int64], *, ppm: float = 40.0, recoded: float = 0.0) -> Timing:
    """Time a clip that shows these moments of a longer one; ``recoded`` is what encoding adds, in rows' deviations."""
    profiles = shot_of(plan, int(shown.max()) + 1, ppm).frames[shown].mean(axis=2, dtype=np.float64)
    noise = np.random.default_rng(1).standard_normal(profiles.shape)
    return timing_from_rows(plan, np.arange(len(shown)), profiles + recoded * profiles.std() * noise)


def rms_rows(timing: Timing, plan: Plan, frames: int) -> float:
    """Return the RMS distance of the flashes found from the nearest true ones with the same lights, in rows."""
    true = shot_of(plan, frames).flashes
    error_s = [
        min(abs(one.start_s - flash.start_s) for one in true if dict(one.lights) == dict(flash.lights))
        for flash in timing.flashes
    ]
    return float(np.sqrt(np.mean(np.square(error_s)))) / plan.camera.row_time_s


MORE_LEFT_OUT = (("4/3", 1), ("18/17", 0), ("5/2", 1))
MORE_REPEATED = (("4/5", 0.0), ("2/5", 0.015))


def assert_placed(timing: Timing, shown: NDArray[np.int64]) -> None:
    """Every frame is at its own place in time, and those that show a moment again are called repeated."""
    assert timing.repeated_frames == tuple(int(n) for n in np.flatnonzero(np.diff(shown) == 0) + 1)
    places = places_in_time(timing, range(len(shown)))
    assert places == {n: shown[n] - shown[0] for n in range(len(shown)) if n not in timing.repeated_frames}


@pytest.mark.parametrize(
    ("step", "lead"),
    [("6/5", 0), ("12/11", 5), *(pytest.param(*one, marks=pytest.mark.campaign) for one in MORE_LEFT_OUT)],
)
def test_frames_left_out_in_a_pattern_are_numbered_and_bridged(step: str, lead: int, plan: Plan) -> None:
    shown = pattern(step, lead)
    timing = retimed(plan, shown)
    assert_placed(timing, shown)
    assert rms_rows(timing, plan, int(shown.max()) + 1) < 0.05
    assert timing.order == "marker"
    assert any("by leaving frames out" in note for note in timing.notes)


def test_frames_left_out_in_a_pattern_are_bridged_behind_a_global_shutter(make_plan: PlanMaker) -> None:
    """It was refused, as missing frames explain any strobe there: but not by a rule."""
    plan = make_plan(height_px=48, width_px=12, readout=0.0)
    shown = pattern("6/5", 0)
    timing = retimed(plan, shown)
    assert_placed(timing, shown)
    assert timing.order == "marker"


def test_a_clip_of_every_second_frame_is_found_and_said(plan: Plan) -> None:
    timing = retimed(plan, pattern("2"))
    assert_placed(timing, pattern("2"))
    assert any("fps in the plan is 2 times too high" in note for note in timing.notes)


@pytest.mark.parametrize(
    ("step", "recoded"),
    [("2", 0.0), pytest.param("5/2", 0.0, marks=pytest.mark.campaign), ("6/5", 0.0), ("2/5", 0.015)],
)
def test_what_a_rule_leaves_out_or_repeats_breaks_no_take_off(step: str, recoded: float, plan: Plan) -> None:
    """Beside a frame that is missing by chance a strobe may have stopped; where all do by one rule, it did not."""
    timing = retimed(plan, pattern(step), recoded=recoded)
    assert np.mean([flash.complete for flash in timing.flashes]) > 0.8


@pytest.mark.parametrize(
    ("step", "recoded"),
    [("4/5", 0.015), ("9/10", 0.015), *(pytest.param(*one, marks=pytest.mark.campaign) for one in MORE_REPEATED)],
)
def test_frames_repeated_in_a_pattern_are_numbered(step: str, recoded: float, plan: Plan) -> None:
    shown = pattern(step)
    timing = retimed(plan, shown, recoded=recoded)
    assert_placed(timing, shown)
    assert rms_rows(timing, plan, int(shown.max()) + 1) < 0.05
    rate = float(plan.camera.fps)
    made = f"made {rate / float(Fraction(step)):.6g} frames a second from {rate:.6g}; repeated ones are left out"
    assert any(made in note for note in timing.notes)


def test_frames_that_others_stand_in_for_again_and_again_are_repeated_and_missing(plan: Plan) -> None:
    shown = np.arange(FRAMES)
    shown[4::5] = shown[3::5]
    timing = retimed(plan, shown, recoded=0.015)
    assert_placed(timing, shown)
    assert timing.dropped_frames == tuple(DroppedFrames(after=n, count=1) for n in range(4, FRAMES - 1, 5))


def test_a_pattern_with_a_hole_of_its_own_is_followed(plan: Plan) -> None:
    shown = pattern("6/5", frames=120)
    shown[70:] += 2
    assert_placed(retimed(plan, shown), shown)


@pytest.mark.campaign
def test_an_unknown_clock_and_readout_do_not_hide_a_pattern(make_plan: PlanMaker) -> None:
    plan = make_plan(height_px=80, width_px=12, readout=0.7, clock_tolerance_ppm=10_000)
    unknown = replace(plan, clock_tolerance_ppm=None, camera=replace(plan.camera, readout_s=None))
    shown = pattern("6/5", 2)
    profiles = shot_of(plan, int(shown.max()) + 1, 6000.0).frames[shown].mean(axis=2, dtype=np.float64)
    timing = timing_from_rows(unknown, np.arange(len(shown)), profiles)
    assert_placed(timing, shown)
    assert timing.clock_offset_ppm == pytest.approx(6000.0, abs=2.0)


def test_frames_missing_all_over_without_a_pattern_are_found(plan: Plan) -> None:
    """Twelve of a hundred, at random: hardly a stretch of four cycles is whole.

    Where holes lie close together, a frame or two between them may be placed wrongly; the flashes are not.
    """
    shown = np.sort(np.random.default_rng(1).choice(200, 176, replace=False))
    shown = shown - shown[0]
    timing = retimed(plan, shown)
    places = places_in_time(timing, range(len(shown)))
    assert sum(places[n] == shown[n] for n in places) >= len(shown) - 5
    assert rms_rows(timing, plan, 200) < 0.05


@pytest.mark.parametrize("count", [1, 2])
@pytest.mark.parametrize("gone", [1, 2])
@pytest.mark.parametrize("end", ["first", "last"])
@pytest.mark.campaign
def test_a_hole_beside_the_very_last_or_first_frames_is_found(end: str, gone: int, count: int, plan: Plan) -> None:
    shown = np.arange(FRAMES)
    shown[-count if end == "last" else count :] += gone
    timing = retimed(plan, shown)
    assert_placed(timing, shown)
    assert rms_rows(timing, plan, int(shown.max()) + 1) < 0.05


@pytest.mark.parametrize(
    ("count", "gone"),
    [
        pytest.param(count, gone, marks=() if (count, gone) in ((1, 2), (4, 3)) else pytest.mark.campaign)
        for count in (1, 2, 3, 4, 5)
        for gone in (2, 3)
    ],
)
@pytest.mark.parametrize("end", ["first", "last"])
def test_a_hole_after_a_few_frames_of_a_short_clip_is_found(end: str, count: int, gone: int, plan: Plan) -> None:
    """Frames at wrong places would spoil the brightnesses by which all others are judged."""
    shown = np.arange(26)
    shown[-count if end == "last" else count :] += gone
    timing = retimed(plan, shown)
    assert_placed(timing, shown)
    assert rms_rows(timing, plan, int(shown.max()) + 1) < 0.05


@pytest.mark.parametrize("end", ["first", "last"])
def test_an_end_that_fits_no_place_gives_no_whole_flash(end: str, plan: Plan) -> None:
    """The frame there belongs to another take."""
    profiles = shot_of(plan, FRAMES).frames.mean(axis=2, dtype=np.float64)
    profiles[0 if end == "first" else -1] = profiles[30:36].mean(axis=0)[::-1]
    timing = timing_from_rows(plan, np.arange(FRAMES), profiles)
    assert any(f"The {end} frame" in note for note in timing.notes)
    cut_s = plan.camera.frame_period_s * (1 if end == "first" else FRAMES - 1)
    inside = [flash.start_s > cut_s - 1e-9 if end == "first" else flash.start_s < cut_s for flash in timing.flashes]
    whole = [flash.complete for flash in timing.flashes]
    assert all(good or not one for one, good in zip(whole, inside, strict=True))
    clean = timing_from_rows(plan, np.arange(FRAMES), shot_of(plan, FRAMES).frames.mean(axis=2, dtype=np.float64))
    assert sum(whole) < sum(flash.complete for flash in clean.flashes)
    assert not clean.notes


def test_a_clock_within_1100_ppm_is_found_at_once_for_any_tolerance_of_the_plan(
    make_plan: PlanMaker, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A frame rate misnamed by 1.001 puts the clock 1,000 ppm off; a plan for crystals tolerates 100.

    Over a stretch as long as those of plans with many lights, short flashes slip by more than their length.
    """
    monkeypatch.setattr(seed_module, "SEED_FRAMES", 120)
    monkeypatch.setattr(seed_choice, "UNKNOWN_CLOCK_PPM", 100.0)  # the widest search finds it too, late
    plan = make_plan(height_px=160, width_px=12, duration_s=0.00025, clock_tolerance_ppm=100)
    seed = find_seed(plan, profiles_of(plan, shot_of(plan, 120, 999.0)))
    assert seed.frames == slice(0, 120)
    assert seed.share > 0.99
    timing = retimed(plan, np.arange(FRAMES), ppm=999.0)
    assert timing.clock_offset_ppm == pytest.approx(999.0, abs=1.0)
    assert timing.dropped_frames == ()
    assert any("misnamed by 1.001" in note for note in timing.notes)


def test_repeats_survive_h264(plan: Plan, tmp_path: Path) -> None:
    """A movie at 60 frames a second made from 24 by 2:3 repeats, encoded again at a rate for the web."""
    wide = replace(plan, camera=replace(plan.camera, width_px=192, height_px=160))
    shown = pattern("2/5", frames=120)
    frames = shot_of(wide, int(shown.max()) + 1).frames[shown]
    path = tmp_path / "movie.mp4"
    with av.open(str(path), "w") as movie:
        stream = movie.add_stream("libx264", rate=60, options={"crf": "23", "threads": "1"})
        stream.width, stream.height, stream.pix_fmt = 192, 160, "yuv420p"
        for frame in frames:
            grey = np.repeat(np.clip(255 * frame, 0, 255).astype(np.uint8)[:, :, None], 3, axis=2)
            movie.mux(stream.encode(av.VideoFrame.from_ndarray(grey, format="rgb24")))
        movie.mux(stream.encode())
    with av.open(str(path)) as movie:
        seen = [frame.to_ndarray(format="gray").mean(axis=1) / 255 for frame in movie.decode(video=0)]
    assert (np.diff(np.array(seen), axis=0)[shown[1:] == shown[:-1]] != 0).any()
    timing = timing_from_rows(wide, np.arange(len(seen)), np.array(seen, np.float64))
    assert_placed(timing, shown)
    assert rms_rows(timing, wide, int(shown.max()) + 1) < 0.1


def test_frames_that_merely_look_alike_are_no_twins() -> None:
    """Changes that come in all sizes hold no repeats; those far smaller than all others are."""
    rng = np.random.default_rng(2)
    steps = np.geomspace(0.03, 1.0, 50)[:, None] * rng.standard_normal((50, 200))
    value = np.cumsum(steps, axis=0)
    value[30] = value[29] + 1e-3 * rng.standard_normal(200)
    rows = Profiles(
        value=value,
        index=np.arange(50),
        period_s=0.01,
        place=np.arange(200.0),
        window_start=np.zeros(1, np.int64),
    )
    assert np.flatnonzero(twins(rows)).tolist() == [30]


@pytest.mark.parametrize("step", ["6/5", "5/2", "4/5", "2/5", "3"])
def test_the_regular_step_is_that_of_the_pattern(step: str) -> None:
    assert regular_step(pattern(step, frames=200), np.arange(200)) == Fraction(step)


def test_single_holes_are_not_called_regular() -> None:
    assert regular_step(np.r_[0:50, 51:90, 92:99], np.arange(96)) == 1


def test_a_clock_that_no_strobe_has_is_refused_by_its_number(plan: Plan) -> None:
    found = find(plan, profiles_of(plan, shot_of(plan, 48)))
    assert clock_too_far(plan, found) == ""
    clock = replace(found.fit.beat.clock, offset_ppm=-73_792.0)
    slipped = replace(found, fit=replace(found.fit, beat=replace(found.fit.beat, clock=clock)))
    assert not convincing(plan, slipped)
    words = clock_too_far(plan, slipped)
    assert "-73792 ppm" in words
    assert "8.469 ms, where the plan says 9.143 ms" in words


def test_doubled_durations_are_refused(plan: Plan) -> None:
    doubled = replace(plan, flashes=tuple(replace(one, duration_s=2 * one.duration_s) for one in plan.flashes))
    profiles = shot_of(plan, FRAMES).frames.mean(axis=2, dtype=np.float64)
    with pytest.raises(PsvideoError, match=r"flashes of 0\.8 ms"):
        timing_from_rows(doubled, np.arange(FRAMES), profiles)


@pytest.mark.campaign
def test_numberings_are_looked_for_where_nearly_all_frames_of_a_stretch_are_alike(make_plan: PlanMaker) -> None:
    plan = make_plan(height_px=24, width_px=12)
    rows = profiles_of(plan, shot_of(plan, 240))
    rows.value[80:170] = 0.003 + 1e-4 * np.random.default_rng(1).standard_normal((90, 24))
    seeds = list(other_seeds(plan, rows, find_seed(plan, rows)))
    assert seeds
    assert all(len(seed.numbering.index) > 100 for seed in seeds)


@pytest.mark.parametrize("guessed", [16, 19, 20])
def test_a_single_hole_that_was_guessed_as_a_rule_lies_where_frames_show_it(plan: Plan, guessed: int) -> None:
    """One frame of twenty left out explains a short clip in which one is missing, a frame or more from where it is."""
    true, numbered = np.delete(np.arange(37), 19), np.arange(36)
    whole = profiles_of(plan, shot_of(plan, 37))
    rows = replace(whole, value=np.ascontiguousarray(whole.value[true]), index=true)
    rule = Numbering(kept=np.ones(36, np.bool_), index=numbered + (numbered > guessed), plain=numbered)
    seed = replace(find_seed(plan, rows), numbering=rule, frames=slice(20, 36))
    course = followed(plan, replace(rows, index=numbered), seed)
    assert course.track.index.tolist() == true.tolist()


@pytest.mark.parametrize("missing", [3, pytest.param(7, marks=pytest.mark.campaign)])
def test_where_many_frames_are_missing_the_strobe_may_have_started_again(plan: Plan, missing: int) -> None:
    shot = shot_of(plan, FRAMES + missing)
    kept = np.delete(shot.frames.mean(axis=2, dtype=np.float64), slice(31, 31 + missing), axis=0)
    timing = timing_from_rows(plan, np.arange(FRAMES), kept)
    assert timing.dropped_frames == (DroppedFrames(after=30, count=missing),)
    notes = [note for note in timing.notes if "started again may look the same" in note]
    assert len(notes) == (missing > 3)
    assert all("Behind frame 30 " in note and "7 frames" in note and "58.39 ms" in note for note in notes)


@pytest.mark.parametrize("inserted", [True, False], ids=["inserted", "standing-in"])
def test_copies_are_known_though_lights_are_alike_in_every_row(inserted: bool, make_plan: PlanMaker) -> None:
    """Left and right mirror one another, so that row means tell them apart nowhere; the upper rows are in the dark. A
    flash that begins with a frame is seen by that frame alone, and a copy of the one before looks like it."""
    plan = make_plan(height_px=96, width_px=24, fps=Fraction(60), readout=0.72, duration_s=0.001, dark_every=2)
    rng = np.random.default_rng(8)
    key, left = (0.2 + 0.5 * rng.random((96, 24)).astype(np.float32) for _ in range(2))
    plates = dict(zip(plan.lit_slots, (key, left, left[:, ::-1]), strict=True))
    for plate in plates.values():
        plate[:12] = 0.0
    flash_s = plan.cycle_s / len(plan.cycle_slots)
    clock = TrueClock(phase_s=13.001 * plan.camera.frame_period_s - 12 * flash_s, offset_ppm=12.0)
    shot = expose(plates, plan, frames=50, clock=clock, noise=NOISE, bits=12)
    again = np.isin(np.arange(50), (12, 24, 37))
    frames = np.repeat(shot.frames, 1 + again, axis=0) if inserted else shot.frames[np.arange(50) - again]
    timing = timing_from_rows(plan, np.arange(len(frames)), frames.mean(axis=2, dtype=np.float64))
    assert timing.repeated_frames == ((13, 26, 40) if inserted else (12, 24, 37))
    assert timing.phase_error_rows < 0.01


def test_lights_that_are_nearly_alike_in_every_row_make_no_copies(make_plan: PlanMaker) -> None:
    """Now and then two such lights fill two frames in a row. Frames were called repeated there, and others missing."""
    plan = make_plan(height_px=96, width_px=24, fps=Fraction(60), readout=0.9, duration_s=0.0013, dark_every=2)
    rng = np.random.default_rng(8)
    key, left = (0.2 + 0.5 * rng.random((96, 24)).astype(np.float32) for _ in range(2))
    plates = dict(zip(plan.lit_slots, (key, left, 0.985 * left[:, ::-1]), strict=True))
    clock = TrueClock(phase_s=0.008, offset_ppm=12.0)
    shot = expose(plates, plan, frames=80, clock=clock, noise=NOISE, bits=12)
    timing = timing_from_rows(plan, np.arange(80), shot.frames.mean(axis=2, dtype=np.float64))
    assert (timing.repeated_frames, timing.dropped_frames) == ((), ())
    assert timing.phase_error_rows < 0.01


def test_a_copy_amid_the_frames_from_which_the_strobe_is_followed_is_known(make_plan: PlanMaker) -> None:
    """Where brightness changes so much that no frames in a row fit well, a copy among them was not looked for: a flash
    was taken for one 2 ms away, under another name."""
    plan = make_plan(lights=tuple(f"light {n}" for n in range(8)), height_px=48, width_px=12, readout=0.66)
    shot = shot_of(plan, 80)
    rows = profiles_of(plan, shot)
    beat = find_seed(plan, rows).beat
    rows.value[:] *= np.exp(0.7 * np.sin(1.3 * np.arange(80)))[:, None]
    rows.value[45] = rows.value[44]
    tracked = track(plan, rows, beat, slice(24, 48), memory=memory_frames(plan, rows))
    assert np.flatnonzero(tracked.repeated).tolist() == [45]
