"""A strobe that stops during a clip, or begins late, or restarts: each part is timed by itself."""

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from numpy.typing import NDArray
from row_means import rows_of

from psvideo.errors import NoStrobeError, PsvideoError
from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.model.timing import DroppedFrames, Flash, Timing
from psvideo.sync.find import timing_from_rows
from psvideo.sync.flashes_seen import flashes_seen
from psvideo.sync.joined import Chapter, joined
from psvideo.sync.restarted import recut
from psvideo.sync.rowfit.beat import Beat, FoundClock
from psvideo.sync.rowfit.coarse.seed import first_guess
from psvideo.sync.rowfit.fit import ClipFit, find
from psvideo.sync.rowfit.moved_at_breaks import TICKS, moved
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.restarts import may_restart
from psvideo.sync.rowfit.strobed import least_frames, shows_strobe
from psvideo.sync.rowfit.tracking.steps_ahead import Twins, steps_ahead
from psvideo.sync.rowfit.unlit import still
from psvideo.sync.unbroken import unbroken
from psvideo.sync.verdict.believed import convincing
from psvideo.synth import Exposure, MainsSwing, Noise, TrueClock, expose

PlanMaker = Callable[..., Plan]
FRAMES, BREAK = 120, 63
PHASE_S = 0.0123


@pytest.fixture
def plan(make_plan: PlanMaker) -> Plan:
    return make_plan(height_px=48, width_px=12)


def shot_of(plan: Plan, phase_s: float = PHASE_S, *, frames: int = FRAMES, alike: bool = False) -> Exposure:
    rng = np.random.default_rng(5)
    plates = {slot: (0.2 + 0.5 * rng.random((48, 12))).astype(np.float32) for slot in plan.lit_slots}
    if alike:
        plates = dict.fromkeys(plates, plates[plan.lit_slots[0]])
    clock = TrueClock(phase_s=phase_s, offset_ppm=80.0)
    return expose(plates, plan, frames=frames, clock=clock, ambient=0.02, noise=Noise(full_well_e=2e5, read_e=5))


def with_restart(
    plan: Plan, late_s: float, *, alike: bool = False, cut: int = BREAK
) -> tuple[tuple[Exposure, Exposure], Doubles]:
    """Return a strobe's shots before and after it waits for some time, and the row means of both in one clip."""
    before, after = shot_of(plan, alike=alike), shot_of(plan, PHASE_S + late_s, alike=alike)
    frames = np.concatenate([before.frames[:cut], after.frames[cut:]])
    return (before, after), frames.mean(axis=2, dtype=np.float64)


def off_s(
    timing: Timing, shots: tuple[Exposure, Exposure], period_s: float, *, cut: int = BREAK
) -> NDArray[np.float64]:
    """Return by how much complete flashes are off those of the part they lie in, and by light, shape (flash,)."""
    off = []
    for flash in timing.flashes:
        if flash.complete:
            true = shots[flash.start_s > cut * period_s].flashes
            same = [one.start_s for one in true if dict(one.lights) == dict(flash.lights)]
            off.append(np.abs(np.array(same) - flash.start_s).min())
    return np.array(off)


@pytest.mark.parametrize("share", [0.37, 1.0, pytest.param(2.6, marks=pytest.mark.campaign)])
def test_a_strobe_that_begins_anew_is_timed_before_and_after(share: float, plan: Plan) -> None:
    pitch_s = plan.cycle_s / len(plan.cycle_slots)
    shots, profiles = with_restart(plan, share * pitch_s)
    timing = timing_from_rows(plan, np.arange(FRAMES), profiles)
    off = off_s(timing, shots, plan.camera.frame_period_s)
    assert off.max() < 0.05 * plan.camera.row_time_s
    assert len(off) > 0.9 * FRAMES * plan.camera.frame_period_s / pitch_s - 4
    assert timing.order == "marker"
    assert timing.dropped_frames == ()
    assert any("started again" in note for note in timing.notes)
    assert [flash.index for flash in timing.flashes] == list(range(len(timing.flashes)))


@pytest.mark.parametrize(("share", "split"), [(0.37, 15), pytest.param(0.37, 29, marks=pytest.mark.campaign)])
def test_a_frame_that_shows_both_strobes_stands_for_no_missing_frames(share: float, split: int, plan: Plan) -> None:
    """The frame of the break fitted 13 frames from its place, and moved all that came after it by as many."""
    cut = 15
    shots, profiles = with_restart(plan, share * plan.cycle_s / len(plan.cycle_slots), cut=cut)
    profiles = profiles[:72].copy()
    profiles[cut, :split] = shots[0].frames[cut, :split].mean(axis=1)
    timing = timing_from_rows(plan, np.arange(72), profiles)
    assert timing.dropped_frames == ()
    assert timing.repeated_frames == ()
    assert off_s(timing, shots, plan.camera.frame_period_s, cut=cut).max() < 0.05 * plan.camera.row_time_s
    assert sum("started again" in note for note in timing.notes) == 1
    assert not any("No strobe like the plan's" in note for note in timing.notes)


def test_without_a_marker_lights_keep_their_names_over_a_restart(make_plan: PlanMaker) -> None:
    plan = make_plan(height_px=48, width_px=12, dark=False)
    pitch_s = plan.cycle_s / len(plan.cycle_slots)
    shots, profiles = with_restart(plan, 1.4 * pitch_s)
    first = next(flash for flash in shots[0].flashes if flash.start_s > plan.camera.frame_period_s)
    (light,) = first.lights
    timing = timing_from_rows(plan, np.arange(FRAMES), profiles, first_light=light)
    assert off_s(timing, shots, plan.camera.frame_period_s).max() < 0.05 * plan.camera.row_time_s
    assert timing.order == "given"


def test_lights_that_look_alike_are_not_named_over_a_restart(make_plan: PlanMaker) -> None:
    plan = make_plan(height_px=48, width_px=12, dark=False)
    pitch_s = plan.cycle_s / len(plan.cycle_slots)
    shots, profiles = with_restart(plan, 1.34 * pitch_s, alike=True)
    first = next(flash for flash in shots[0].flashes if flash.start_s > plan.camera.frame_period_s)
    (light,) = first.lights
    timing = timing_from_rows(plan, np.arange(FRAMES), profiles, first_light=light)
    assert any("started again" in note for note in timing.notes)
    assert timing.order == "guess"


@pytest.mark.parametrize("cut", [BREAK - 5, BREAK + 5])
def test_a_cut_moves_to_where_the_strobe_of_the_part_that_is_found_ends(cut: int, plan: Plan) -> None:
    _, profiles = with_restart(plan, 0.37 * plan.cycle_s / len(plan.cycle_slots))
    rows = rows_of(plan, profiles)
    found = slice(0, cut) if cut < BREAK else slice(cut, FRAMES)
    parts = [(one, find(plan, rows.take(one).one_window()) if one == found else None) for one in halves(cut)]
    assert recut(plan, rows, parts) == halves(BREAK)


def halves(cut: int) -> list[slice]:
    return [slice(0, cut), slice(cut, FRAMES)]


def test_what_one_part_of_a_clip_lacks_puts_the_flashes_of_the_next_later(plan: Plan) -> None:
    period_s = plan.camera.frame_period_s

    def timing(start_s: float, error_s: float, dropped: tuple[DroppedFrames, ...]) -> Timing:
        flash = Flash(index=0, slot=0, lights={"key": 1.0}, start_s=start_s, duration_s=0.0008, complete=True)
        return Timing(
            clip="clip",
            frame_period_s=period_s,
            exposure_s=period_s,
            row_time_s=plan.camera.row_time_s,
            clock_offset_ppm=0.0,
            phase_error_rows=error_s / plan.camera.row_time_s,
            phase_error_s=error_s,
            order="marker",
            flashes=(flash,),
            dropped_frames=dropped,
        )

    first = Chapter(first=0, last=40, more=3, timing=timing(0.1, 2e-6, (DroppedFrames(after=7, count=3),)))
    second = Chapter(first=41, last=80, more=0, timing=timing(0.5, 1e-6, ()))
    both = joined([first, second], (DroppedFrames(after=90, count=2),))
    assert [(flash.index, flash.start_s) for flash in both.flashes] == [(0, 0.1), (1, 0.5 + 3 * period_s)]
    assert both.phase_error_s == 2e-6
    assert both.dropped_frames == (DroppedFrames(after=7, count=3), DroppedFrames(after=90, count=2))


def test_thirty_frames_that_are_missing_are_one_hole(plan: Plan) -> None:
    keep = np.delete(np.arange(160), np.arange(60, 90))
    profiles = shot_of(plan, frames=160).frames.mean(axis=2, dtype=np.float64)[keep]
    timing = timing_from_rows(plan, np.arange(len(keep)), profiles)
    assert timing.dropped_frames == (DroppedFrames(after=59, count=30),)
    assert not any("The strobe started again" in note for note in timing.notes)
    assert sum("as if 30 frames were missing" in note and "may look the same" in note for note in timing.notes) == 1


@pytest.mark.campaign
def test_where_the_strobe_seems_to_start_again_missing_frames_are_named_too(plan: Plan) -> None:
    keep = np.delete(np.arange(170), np.arange(60, 110))
    profiles = shot_of(plan, frames=170).frames.mean(axis=2, dtype=np.float64)[keep]
    timing = timing_from_rows(plan, np.arange(len(keep)), profiles)
    assert timing.dropped_frames == ()
    [note] = [note for note in timing.notes if "strobe started again" in note]
    assert "Many frames that are missing there" in note


def test_frames_that_are_missing_are_no_restart(plan: Plan) -> None:
    keep = np.delete(np.arange(FRAMES), [31, 62, 63, 64])
    profiles = shot_of(plan).frames.mean(axis=2, dtype=np.float64)[keep]
    timing = timing_from_rows(plan, np.arange(len(keep)), profiles)
    assert [(hole.after, hole.count) for hole in timing.dropped_frames] == [(30, 1), (60, 3)]
    assert not any("started again" in note for note in timing.notes)


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
    rows = rows_of(plan, np.random.default_rng(0).random((5, 4)))
    late = moved(rows, 0.25 * rows.period_s)
    np.testing.assert_allclose(
        late.frame_start_s - rows.frame_start_s, 0.25 * rows.period_s, atol=rows.period_s / TICKS
    )


def other_picture(kind: str, count: int) -> Doubles:
    """Return the row means of frames that no strobe lights, shape (frame, row)."""
    rng = np.random.default_rng(2)
    if kind == "noise":
        return 0.3 + 0.1 * rng.random((count, 48))
    if kind == "flicker":
        return np.repeat(0.3 + 0.1 * rng.random((count, 1)), 48, axis=1)
    if kind == "dark":  # but not as dark as rows are between flashes
        return 0.03 + 2e-4 * rng.standard_normal((count, 48))
    if kind == "bright":
        return 0.4 + 0.2 * rng.random(48) + 1e-3 * rng.standard_normal((count, 48))
    assert kind == "moving"
    swing = 1 + 0.3 * np.sin(np.arange(count)[:, None] / 7)
    return (0.1 + 0.3 * rng.random(48)) * swing * (1 + 0.002 * rng.standard_normal((count, 48)))


ENDS = {"stops": ("noise", "moving"), "begins late": ("bright",)}
"""What is tried at either end of a take; the other end, and what is like these, is tried in campaigns."""


@pytest.mark.parametrize(
    ("kind", "first"),
    [
        pytest.param(
            kind, end == "begins late", id=f"{kind}-{end}", marks=() if kind in ENDS[end] else pytest.mark.campaign
        )
        for kind in ("noise", "flicker", "dark", "bright", "moving")
        for end in ENDS
    ],
)
def test_only_frames_that_the_strobe_lights_have_flashes(kind: str, first: bool, plan: Plan) -> None:
    strobed, count, period_s = shot_of(plan, frames=72), 40, plan.camera.frame_period_s
    profiles, without = strobed.frames.mean(axis=2, dtype=np.float64), other_picture(kind, count)
    timing = timing_from_rows(
        plan, np.arange(72 + count), np.concatenate([without, profiles] if first else [profiles, without])
    )
    true_s = np.array([flash.start_s for flash in strobed.flashes]) + first * count * period_s
    complete_s = np.array([flash.start_s for flash in timing.flashes if flash.complete])
    assert np.abs(true_s[:, None] - complete_s).min(axis=0).max() < 0.05 * plan.camera.row_time_s
    assert len(complete_s) >= 72 * period_s / (plan.cycle_s / len(plan.cycle_slots)) - 4
    assert true_s.min() - period_s < timing.start_s.min()
    assert timing.start_s.max() < true_s.max() + 2 * period_s
    begin, end = (0, count - 1) if first else (72, 71 + count)
    assert any(f"No strobe like the plan's is found in frames {begin} to {end}" in note for note in timing.notes)
    assert not any("started again" in note for note in timing.notes)


def test_the_first_light_is_that_of_the_first_part_that_is_found(make_plan: PlanMaker, plan: Plan) -> None:
    lit_at_first = other_picture("bright", 40)
    unmarked = make_plan(height_px=48, width_px=12, dark=False)
    profiles = np.concatenate([lit_at_first, shot_of(unmarked, frames=72).frames.mean(axis=2, dtype=np.float64)])
    named = timing_from_rows(unmarked, np.arange(112), profiles, first_light="left")
    first = next(flash for flash in named.flashes if flash.complete)
    assert (named.order, first.lit) == ("given", ("left",))

    shot = shot_of(plan, frames=72)
    profiles = np.concatenate([lit_at_first, shot.frames.mean(axis=2, dtype=np.float64)])
    [third] = [flash for flash in shot.flashes if flash.lit and flash.start_s > 0][2].lit
    with pytest.raises(PsvideoError, match=f"`first_light` {third} does not fit the footage: by the cycle's marker"):
        timing_from_rows(plan, np.arange(112), profiles, first_light=third)


@pytest.mark.parametrize("count", [30, pytest.param(100, marks=pytest.mark.campaign)])
def test_a_picture_that_freezes_ends_the_strobe(count: int, plan: Plan) -> None:
    strobed = shot_of(plan, frames=72)
    profiles = strobed.frames.mean(axis=2, dtype=np.float64)
    timing = timing_from_rows(
        plan, np.arange(72 + count), np.concatenate([profiles, np.tile(profiles[-1], (count, 1))])
    )
    assert any(f"No strobe like the plan's is found in frames 71 to {71 + count}" in one for one in timing.notes)
    assert max(flash.start_s for flash in timing.flashes) < 72 * plan.camera.frame_period_s


def test_frames_show_a_strobe_at_any_place_in_its_cycle_or_none(plan: Plan) -> None:
    camera = plan.camera
    beat = Beat(
        clock=FoundClock(phase_s=0.0, offset_ppm=0.0), row_time_s=camera.row_time_s, exposure_s=camera.exposure_s
    )
    count = least_frames(plan)
    lit = rows_of(plan, shot_of(plan, frames=count).frames.mean(axis=2, dtype=np.float64))
    assert shows_strobe(plan, lit, beat)
    for kind in ("noise", "flicker", "dark", "bright", "moving"):
        assert not shows_strobe(plan, rows_of(plan, other_picture(kind, count)), beat)


@pytest.mark.parametrize("cut", [40, 88])
@pytest.mark.campaign
def test_a_clock_that_jumps_by_little_shows_in_the_error_and_is_told(cut: int, plan: Plan) -> None:
    shots, profiles = with_restart(plan, -0.03 * plan.cycle_s / len(plan.cycle_slots), cut=cut)
    timing = timing_from_rows(plan, np.arange(FRAMES), profiles)
    row_s = plan.camera.row_time_s
    off = np.abs(off_s(timing, shots, plan.camera.frame_period_s, cut=cut)) / row_s
    assert np.sqrt(np.mean(off**2)) > 0.05
    assert np.sqrt(np.mean(off**2)) < 2 * timing.phase_error_rows
    assert any("come early or late against all the others" in note for note in timing.notes)


@pytest.mark.parametrize(("seed", "again"), [(2, 10), (3, 10)])
def test_a_frame_that_is_repeated_early_in_a_noisy_clip_is_no_restart(
    seed: int, again: int, make_plan: PlanMaker
) -> None:
    plan = make_plan(lights=tuple("abcde"), dark=False, height_px=48, width_px=12, readout=0.25, duration_s=0.0005)
    plan = replace(plan, flashes=(replace(plan.flashes[0], duration_s=0.00075), *plan.flashes[1:]))
    rng = np.random.default_rng(seed)
    plates = {slot: (0.1 + 0.5 * rng.random((48, 12))).astype(np.float32) for slot in plan.lit_slots}
    shot = expose(
        plates,
        plan,
        frames=45,
        clock=TrueClock(phase_s=rng.uniform(0, plan.cycle_s), offset_ppm=30.0),
        ambient=0.15,
        mains=MainsSwing(hz=120, depth=0.15),
        noise=Noise(full_well_e=2000, read_e=15),
        seed=seed,
    )
    profiles = shot.frames.mean(axis=2, dtype=np.float64)
    timing = timing_from_rows(plan, np.arange(46), np.insert(profiles, again, profiles[again - 1], axis=0))
    assert timing.repeated_frames == (again,)
    assert not any("started again" in note for note in timing.notes)


def parts_of(plan: Plan, rows: Profiles, cuts: list[slice]) -> list[tuple[slice, ClipFit]]:
    return [(cut, find(plan, rows.take(cut).one_window())) for cut in cuts]


def test_parts_between_which_frames_are_missing_are_one_strobe(plan: Plan, monkeypatch: pytest.MonkeyPatch) -> None:
    """A subject that moves hid the strobe of a clip for a while: the part behind was a frame off, and sure of it."""
    shot = shot_of(plan, frames=FRAMES + 1)
    profiles = np.delete(shot.frames.mean(axis=2, dtype=np.float64), BREAK, axis=0)
    parts = parts_of(plan, rows_of(plan, profiles), [slice(0, BREAK - 9), slice(BREAK + 15, FRAMES)])
    monkeypatch.setattr("psvideo.sync.clip_parts.found_in_parts", lambda *_: parts)
    timing = timing_from_rows(plan, np.arange(FRAMES), profiles)
    assert timing.dropped_frames == (DroppedFrames(after=BREAK - 1, count=1),)
    assert off_s(timing, (shot, shot), plan.camera.frame_period_s).max() < 0.05 * plan.camera.row_time_s
    assert not any("started again" in note for note in timing.notes)


@pytest.mark.parametrize("share", [0.05, 0.37, 1.0, 2.6])
@pytest.mark.campaign
def test_parts_of_a_strobe_that_began_anew_are_not_one(share: float, plan: Plan) -> None:
    _, profiles = with_restart(plan, share * plan.cycle_s / len(plan.cycle_slots))
    rows = rows_of(plan, profiles)
    parts = parts_of(plan, rows, halves(BREAK))
    assert not unbroken(plan, find(plan, rows), parts)


@pytest.mark.parametrize("late", [0.8, 3.3, 4.6])
@pytest.mark.campaign
def test_a_strobe_that_paused_before_a_global_shutter_is_timed_or_refused(make_plan: PlanMaker, late: float) -> None:
    """Frames show little more than which flash they saw: 29 missing frames explained a pause, with wrong names."""
    plan = make_plan(height_px=48, width_px=12, readout=0.0, lights=("key", "left", "right", "top"))
    shots, profiles = with_restart(plan, late * plan.cycle_s / len(plan.cycle_slots), cut=15)
    profiles = profiles[:52].copy()
    profiles[14:25] = 0.02
    try:
        timing = timing_from_rows(plan, np.arange(len(profiles)), profiles)
    except NoStrobeError:
        return
    assert off_s(timing, shots, plan.camera.frame_period_s, cut=20).max() < 0.1 * plan.shortest_flash_s


@pytest.mark.parametrize("seed", [23, 27, 30])
def test_frames_that_are_all_darker_are_not_missing_elsewhere(make_plan: PlanMaker, seed: int) -> None:
    """A camera that changed its gain after 13 frames was taken for one that lost 23 frames there."""
    plan = make_plan(height_px=48, width_px=12, dark=False, shutter=0.25, readout=0.84, duration_s=0.0014)
    rng, down = np.random.default_rng(seed), np.linspace(0, 1, 48)[:, None] * np.ones(12)

    def scene() -> NDArray[np.float32]:
        waves = 0.4 + 0.3 * np.sin(rng.uniform(1, 9) * down + rng.uniform(0, 6)) * rng.uniform(0.3, 1)
        return np.asarray(waves.astype(np.float32) * rng.uniform(0.4, 1), np.float32)

    plates = {slot: scene() for slot in plan.lit_slots}
    noise = Noise(full_well_e=20_000, read_e=8)
    shot = expose(plates, plan, frames=41, clock=TrueClock(phase_s=PHASE_S, offset_ppm=180.0), noise=noise, bits=12)
    profiles = shot.frames.mean(axis=2, dtype=np.float64)
    profiles[13:] *= 0.5
    profiles += np.random.default_rng(1).normal(0, 0.002, profiles.shape)
    beat = replace(first_guess(plan), clock=FoundClock(phase_s=PHASE_S, offset_ppm=180.0))
    none = Twins(alike=np.zeros(len(profiles), np.bool_), lit=np.zeros(len(profiles), np.bool_))
    extra = steps_ahead(plan, rows_of(plan, profiles), beat, slice(13, 37), slice(0, 13), none, -1)
    assert not extra.any()


@pytest.mark.parametrize("readout", [0.0, 1.0])
def test_many_missing_frames_convince_only_where_rows_see_flashes_one_after_another(
    make_plan: PlanMaker, readout: float
) -> None:
    plan = make_plan(height_px=48, width_px=12, readout=readout)
    found = find(plan, rows_of(plan, shot_of(plan, frames=52).frames.mean(axis=2, dtype=np.float64)))
    assert convincing(plan, found)
    assert convincing(plan, replace(found, steps=2, strayed=29)) == (readout > 0)
    assert convincing(plan, replace(found, steps=12, strayed=12, regular=True)), "by a rule"


def test_lights_that_are_nearly_alike_do_not_make_the_picture_stand_still(make_plan: PlanMaker) -> None:
    """The dark row stays below the picture for 24 frames, and no dark slot falls into them. Such a clip was taken to be
    frozen there; its parts were searched for minutes, and the frames behind were lost."""
    names = tuple(f"light {n}" for n in range(8))
    plan = make_plan(lights=names, height_px=48, fps=Fraction(25), readout=0.5, duration_s=0.0006, dark_every=3)
    rng = np.random.default_rng(5)
    wall = 0.2 + 0.5 * rng.random((48, 24))
    plates = {slot: (wall * (1 + 0.03 * rng.random((48, 1)))).astype(np.float32) for slot in plan.lit_slots}
    shot = expose(
        plates, plan, frames=60, clock=TrueClock(phase_s=-0.1, offset_ppm=30.0), noise=Noise(full_well_e=2e5, read_e=5)
    )
    rows = rows_of(plan, shot.frames.mean(axis=2, dtype=np.float64))
    assert still(plan, rows).sum() > 20
    assert not may_restart(plan, rows, find(plan, rows))
