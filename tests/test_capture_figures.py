"""The figures of a shoot: the paper's equations fall out of them, and counting by hand agrees."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from psvideo.capture.drawing.timeline import timeline
from psvideo.model.camera import Camera
from psvideo.model.cost.rows_of_flashes import dark_row_move_px, frames_per_flash, mixed_share, row_shares
from psvideo.model.cost.shoot_figures import shoot_figures
from psvideo.model.plan import Mode, Plan, PlannedFlash


def paper_plan(
    *durations_s: float,
    fps: float = 60,
    rows: int = 1080,
    readout: float = 1.0,
    shutter: float = 1.0,
    mode: Mode = "rolling",
    margin_s: float = 0.0,
    dark_slot_s: float | None = None,
    dark_every: int = 1,
) -> Plan:
    """The paper's case unless said: 360 degrees, readout as long as the frame, dark time = exposure."""
    period_s = 1 / fps
    exposure_s = shutter * period_s
    camera = Camera(
        width_px=1920,
        height_px=rows,
        fps=Fraction(fps).limit_denominator(10_000),
        exposure_s=exposure_s,
        readout_s=readout * period_s,
    )
    flashes = tuple(
        PlannedFlash(lights={f"light{index}": 1.0}, duration_s=duration_s)
        for index, duration_s in enumerate(durations_s)
    )
    if dark_slot_s is not None:
        flashes += (PlannedFlash(lights={}, duration_s=dark_slot_s),)
    dark_s = exposure_s + margin_s if mode == "rolling" else 2 * period_s - max(durations_s)
    return Plan(camera=camera, flashes=flashes, dark_s=dark_s, mode=mode, dark_every=dark_every)


def test_equations_1_5_and_6_give_the_paper_s_numbers() -> None:
    plan = paper_plan(200e-6)
    figures = shoot_figures(plan)
    assert figures.cycle_s == pytest.approx(200e-6 + 1 / 60)
    assert figures.flash_rate_hz == pytest.approx(59.29, abs=0.005)
    assert 60 - figures.flash_rate_hz == pytest.approx(0.71, abs=0.005)
    assert figures.flash_rate_hz == pytest.approx(60 / (1 + 200e-6 * 60))
    assert figures.result_rate_hz == figures.flash_rate_hz


def test_equation_14_gives_the_wait_after_each_flash_of_its_own_length() -> None:
    starts_s = paper_plan(0.001, 0.003).train(0, 4).start_s
    assert np.diff(starts_s) == pytest.approx([0.001 + 1 / 60, 0.003 + 1 / 60, 0.001 + 1 / 60])


@given(st.floats(1e-5, 5e-3), st.floats(1e-5, 5e-3), st.sampled_from([24.0, 60.0, 120.0]))
def test_equation_15_is_the_mean_rate_of_two_durations(one_s: float, other_s: float, fps: float) -> None:
    figures = shoot_figures(paper_plan(one_s, other_s, fps=fps))
    assert figures.flash_rate_hz == pytest.approx(fps / (1 + (one_s + other_s) / (2 / fps)))
    assert figures.result_rate_hz == pytest.approx(figures.flash_rate_hz / 2)


def test_equation_13_is_the_dark_row_s_move() -> None:
    plan = paper_plan(200e-6)
    assert dark_row_move_px(plan, 0) == pytest.approx(200e-6 * 60 * 1080)
    upwards = paper_plan(200e-6, readout=-1.0)
    assert dark_row_move_px(upwards, 0) == pytest.approx(-200e-6 * 60 * 1080)


@pytest.mark.parametrize("readout", [1.0, 0.6, -0.8])
def test_the_dark_row_moves_as_far_as_the_darkest_row_of_consecutive_frames(readout: float) -> None:
    plan = paper_plan(0.4e-3, rows=2000, readout=readout)
    phase_s = 3e-3 if readout > 0 else 12e-3
    first, second = (_middle_of_gap(plan, frame, phase_s) for frame in (0, 1))
    assert second - first == pytest.approx(dark_row_move_px(plan, 0), abs=2)


def _middle_of_gap(plan: Plan, frame: int, phase_s: float) -> float:
    """Return the row of a frame that received the least light, counted by overlapping intervals."""
    camera, train = plan.camera, plan.train(-3, 8)
    opens_s = frame * camera.frame_period_s + camera.row_offsets_s()
    light_s = sum(
        np.clip(
            np.minimum(opens_s + camera.exposure_s, start_s + phase_s + length_s)
            - np.maximum(opens_s, start_s + phase_s),
            0,
            None,
        )
        for start_s, length_s in zip(train.start_s, train.duration_s, strict=True)
    )
    return float(np.argmin(light_s))


@pytest.mark.parametrize(
    ("readout", "shutter", "durations_s", "dark_every"),
    [
        (0.98, 1.0, (2e-3, 1e-3, 0.5e-3), None),
        (0.98, 0.5, (3e-3, 3e-3), None),
        (-0.7, 0.5, (2e-3, 1e-3, 0.5e-3), None),
        (0.6, 0.2, (2e-3, 1e-3, 0.5e-3), None),
        (0.98, 1.0, (2e-3, 1e-3, 0.5e-3), 1),
        (0.98, 0.5, (2e-3, 1e-3, 0.5e-3), 1),
        (-0.7, 0.2, (1e-3, 1e-3), 2),
        (0.98, 0.5, (1e-3,), 1),
    ],
)
def test_the_dark_row_moves_to_the_nearest_one_of_the_next_frame(
    readout: float, shutter: float, durations_s: tuple[float, ...], dark_every: int | None
) -> None:
    """Held against the dark rows of the drawn timeline, at start phases all over a cycle."""
    plan = paper_plan(*durations_s, shutter=shutter, readout=readout, margin_s=2e-6)
    if dark_every:
        plan = replace(plan, flashes=(*plan.flashes, PlannedFlash(lights={}, duration_s=1e-3)), dark_every=dark_every)
    seen = _moves_seen(plan)
    for slot in range(len(plan.flashes)):
        move_px, least_px = dark_row_move_px(plan, slot), min(seen.get(slot, []), default=None, key=abs)
        assert (move_px is None) == (least_px is None), (slot, move_px, least_px)
        assert move_px == pytest.approx(least_px, abs=1e-6)


def _moves_seen(plan: Plan) -> dict[int, list[float]]:
    """Return how far dark rows lie from each other in consecutive frames, by the slot that follows the first one."""
    camera, seen = plan.camera, dict[int, list[float]]()
    slot_of = {light: slot for slot, flash in enumerate(plan.flashes) for light in flash.lit}
    for phase_s in np.arange(0.0, plan.cycle_s, camera.frame_period_s / 11.3):
        drawn = timeline(plan, phase_s=float(phase_s), frames=2)
        frame, later = drawn.frames[-2:]
        for row in frame.dark_rows:
            opens_s = frame.index * camera.frame_period_s + camera.row_time_s * (
                row - (0 if camera.row_time_s > 0 else camera.height_px)
            )
            following = next(flash for flash in drawn.flashes if flash.start_s > opens_s + camera.exposure_s)
            seen.setdefault(slot_of[following.label], []).extend(other - row for other in later.dark_rows)
    return seen


def test_a_dark_row_that_no_two_frames_show_does_not_move() -> None:
    """The next one lies a frame's height away, up and down."""
    plan = paper_plan(8e-3, 8e-3, 8e-3, fps=120, readout=0.95)
    assert [slot.dark_row_move_px for slot in shoot_figures(plan).slots] == [None] * 3


@pytest.mark.parametrize("readout", [1.0, 0.9, 0.5, 0.0, -0.7])
@pytest.mark.parametrize("shutter", [1.0, 0.5])
@pytest.mark.parametrize("duration_s", [0.2e-3, 1.5e-3, 4e-3])
def test_the_frames_that_a_flash_touches_are_those_found_by_counting(
    readout: float, shutter: float, duration_s: float
) -> None:
    plan = paper_plan(duration_s, rows=50, readout=readout, shutter=shutter)
    camera = plan.camera
    counts = []
    phases_s = (np.arange(500) + 0.5) / 500 * camera.frame_period_s
    for start_s in phases_s:
        touched = 0
        for frame in range(-4, 5):
            opens_s = frame * camera.frame_period_s + camera.row_offsets_s()
            touched += bool(np.any((opens_s < start_s + duration_s) & (opens_s + camera.exposure_s > start_s)))
        counts.append(touched)
    fewest, most, share = frames_per_flash(plan, duration_s) or (0, 0, 0.0)
    assert (min(counts), max(counts)) == (fewest, most)
    assert np.mean(np.array(counts) == most) == pytest.approx(share, abs=0.005)


def test_three_frames_are_impossible_where_the_readout_leaves_room_for_the_flash() -> None:
    plan = paper_plan(1e-3, readout=0.9, rows=1000)
    limit_s = plan.camera.frame_period_s - plan.camera.readout_s + plan.camera.row_time_s  # type: ignore[operator]
    assert frames_per_flash(plan, limit_s) == (2, 2, 1.0)
    assert frames_per_flash(plan, limit_s * 1.01)[1] == 3  # type: ignore[index]


@pytest.mark.parametrize("divisor", [2, 5, 12])
def test_equation_11_never_lights_three_frames_if_the_first_flash_starts_with_a_frame(divisor: int) -> None:
    plan = paper_plan(1 / 60 / divisor)
    camera, train = plan.camera, plan.train(0, 5 * divisor)
    last_row_s = camera.readout_s - camera.row_time_s  # type: ignore[operator]
    for start_s, length_s in zip(train.start_s, train.duration_s, strict=True):
        frames = [
            frame
            for frame in range(-2, 6 * divisor)
            if frame / 60 < start_s + length_s - 1e-9 and frame / 60 + last_row_s + camera.exposure_s > start_s + 1e-9
        ]
        assert len(frames) <= 2


@given(st.floats(0.05, 1.0), st.floats(0.01, 1.2))
def test_row_shares_agree_with_counting_over_phases(shutter: float, flash: float) -> None:
    duration_s = flash * shutter / 60
    plan = paper_plan(duration_s, shutter=shutter)
    exposure_s, period_s = plan.camera.exposure_s, 1 / 60
    starts_s = (np.arange(4000) + 0.5) / 4000 * period_s
    opens_s = np.arange(-3, 4)[:, None] * period_s
    seen_s = np.minimum(opens_s + exposure_s, starts_s + duration_s) - np.maximum(opens_s, starts_s)
    best = np.clip(seen_s, 0, None).max(axis=0)
    whole, missing = np.mean(best > duration_s * (1 - 1e-9)), np.mean(best <= 0)
    partial, unseen = row_shares(plan, duration_s)
    assert unseen == pytest.approx(missing, abs=0.002)
    assert partial == pytest.approx(1 - whole - missing, abs=0.002)


def test_light_blur_and_duty_of_unequal_flashes() -> None:
    plan = paper_plan(1 / 600, 1 / 1200)
    figures = shoot_figures(plan, speed_px_s=600)
    assert [slot.light_share for slot in figures.slots] == pytest.approx([0.1, 0.05])
    assert [slot.stops for slot in figures.slots] == pytest.approx([np.log2(10), np.log2(20)])
    assert [slot.blur_px for slot in figures.slots] == pytest.approx([1.0, 0.5])
    round_s = 2 / 60 + 1 / 600 + 1 / 1200
    assert [light.duty for light in figures.lights] == pytest.approx([1 / 600 / round_s, 1 / 1200 / round_s])
    assert figures.motion_per_round_px == pytest.approx(600 * round_s)
    assert figures.motion_per_flash_px == pytest.approx(300 * round_s)


def test_a_row_receives_no_more_than_its_exposure_holds() -> None:
    """Below 360 degrees, and synced, a flash may be longer than the exposure."""
    camera = Camera(width_px=4, height_px=4, fps=Fraction(100), exposure_s=0.005, readout_s=0.0)
    plan = Plan(camera=camera, flashes=paper_plan(20e-3).flashes, dark_s=0.0, mode="synced")
    slot = shoot_figures(plan).slots[0]
    assert (slot.light_share, slot.stops) == (1.0, 0.0)


@pytest.mark.parametrize(("exposure_s", "dark_s"), [(0.010, 0.005), (0.010, 0.009), (0.008, 0.001), (0.010, 0.010)])
def test_rows_that_hold_two_flashes_are_counted_as_their_shutter_sees_them(exposure_s: float, dark_s: float) -> None:
    """Held against flashes laid over exposures that begin anywhere in the cycle."""
    camera = Camera(width_px=4, height_px=4, fps=Fraction(100), exposure_s=exposure_s, readout_s=0.01)
    for dark_slot_s in (None, 1e-3):
        plan = replace(paper_plan(1e-3, 1e-3, 1e-3, dark_slot_s=dark_slot_s), camera=camera, dark_s=dark_s)
        if dark_slot_s and exposure_s > 2 * dark_s + dark_slot_s:
            continue  # sees flashes on both sides of the dark slot, too
        train = plan.train(-20, 60)
        is_lit = np.array([not plan.flashes[slot].is_dark for slot in train.slot])
        opens_s = np.linspace(0, plan.cycle_s, 4000, endpoint=False)[:, None]
        seen = (train.start_s + train.duration_s > opens_s) & (train.start_s < opens_s + exposure_s) & is_lit
        truth = float((seen.sum(axis=1) > 1).mean())
        assert mixed_share(plan, exposure_s=exposure_s, dark_s=dark_s) == pytest.approx(truth, abs=0.002)


def test_flashes_without_a_dark_time_have_no_margin() -> None:
    assert shoot_figures(replace(paper_plan(1e-3), dark_s=0.0)).margin_ppm is None


def test_rare_dark_slots_cost_their_share_of_the_rate() -> None:
    never = shoot_figures(paper_plan(1e-3, 1e-3, 1e-3))
    always = shoot_figures(paper_plan(1e-3, 1e-3, 1e-3, dark_slot_s=1e-3))
    rarely = shoot_figures(paper_plan(1e-3, 1e-3, 1e-3, dark_slot_s=1e-3, dark_every=10))
    assert always.result_rate_hz == pytest.approx(never.result_rate_hz * 3 / 4)
    assert rarely.result_rate_hz == pytest.approx(never.result_rate_hz * 30 / 31)
    assert rarely.dark_slot_rate_hz == pytest.approx(rarely.result_rate_hz / 10)
    assert rarely.lights[0].rate_hz == pytest.approx(rarely.result_rate_hz)


def test_half_rate_lights_every_other_frame_and_the_dark_row_stays() -> None:
    figures = shoot_figures(paper_plan(1e-3, mode="half-rate"))
    assert figures.flash_rate_hz == pytest.approx(30)
    assert figures.slots[0].dark_row_move_px == pytest.approx(0, abs=1e-6)


def test_the_margin_is_how_much_faster_the_strobe_may_run() -> None:
    assert shoot_figures(paper_plan(1e-3)).margin_ppm == pytest.approx(0, abs=1e-6)
    plan = paper_plan(1e-3, margin_s=1e-5)
    margin_ppm = shoot_figures(plan).margin_ppm or 0.0
    assert plan.dark_s * (1 - margin_ppm * 1e-6) == pytest.approx(plan.camera.exposure_s)


def test_what_hangs_on_an_unknown_readout_is_left_out() -> None:
    plan = paper_plan(1e-3)
    unknown = Plan(
        camera=Camera(width_px=4, height_px=4, fps=Fraction(60), exposure_s=1 / 60, readout_s=None),
        flashes=plan.flashes,
        dark_s=plan.dark_s,
    )
    slot = shoot_figures(unknown).slots[0]
    assert (slot.frames_max, slot.dark_row_move_px) == (None, None)
    assert slot.partial_row_share == pytest.approx(60e-3)
