"""Plans keep the rolling rule for both clocks at their worst, wishes become flashes, and dangers are named."""

import io
import itertools
import re
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from rich.console import Console

from psvideo.capture.cautions import shoot_cautions
from psvideo.capture.planning import Shoot, make_plan, plan_shoot
from psvideo.capture.request import CameraWish, Limits, ShootRequest, choose_camera
from psvideo.capture.tables import shoot_report
from psvideo.capture.wish import LONG_MARKER, longest_flash
from psvideo.cli.options.capture import ShootWords
from psvideo.cli.options.shoot_words import parse_request
from psvideo.cli.spelling import spelled
from psvideo.errors import UsageError
from psvideo.formats.plan_toml import format_plan, parse_plan
from psvideo.model.camera import Camera
from psvideo.model.cost.in_step import dark_s_out_of_step, never_shown
from psvideo.model.cost.motion_cost import motion_cost
from psvideo.model.cost.shoot_figures import shoot_figures
from psvideo.model.plan import Plan
from psvideo.model.rows.shutter import row_weights
from psvideo.runs.capture_plan import capture_plan
from psvideo.strobe.link.boards import BOARDS


def words(**given_words: object) -> ShootWords:
    usual = {"fps": "100", "size": "64x48", "readout": "9ms", "lights": "key,left,right", "flash": "0.8ms"}
    return ShootWords(**{**usual, **given_words})  # type: ignore[arg-type]


def planned(**given_words: object) -> Shoot:
    return plan_shoot(parse_request(words(**given_words)))


def kinds(shoot: Shoot) -> set[str]:
    return {caution.kind for caution in shoot.cautions}


def text_of(shoot: Shoot, kind: str) -> str:
    return " ".join(caution.text for caution in shoot.cautions if caution.kind == kind)


def table_text(shoot: Shoot) -> str:
    console = Console(file=io.StringIO(), width=200)
    with console.capture() as shown:
        console.print(*shoot_report(shoot, preset=None))
    return shown.get()


ANY_REQUEST = st.builds(
    words,
    fps=st.sampled_from(["24", "23.976", "60", "119.88", "240", "77.7"]),
    readout=st.sampled_from(["0", "1ms", "4ms", "-3.5ms", "unknown"]),
    shutter=st.floats(20, 360),
    lights=st.sampled_from(["key", "key,left", "key,left,right", "a,b,c,d,e,f,g,h"]),
    flash=st.sampled_from(["20us", "150us", "1/9000s"]),
    marker=st.sampled_from(["dark", "long", "none"]),
    mode=st.sampled_from(["rolling", "half-rate"]),
    power=st.sampled_from(["1", "0.25", "50%"]),
    camera_clock_ppm=st.floats(0, 4000),
    strobe_clock_ppm=st.one_of(st.floats(0, 4000).map(str), st.just("unknown")),
    black=st.one_of(st.none(), st.floats(0, 255)),
    white=st.one_of(st.none(), st.floats(256, 65535)),
    cfa=st.sampled_from([None, "RGGB", "gbrg"]),
)


@given(ANY_REQUEST)
@settings(max_examples=150, deadline=None)
def test_a_plan_is_the_same_when_it_is_read_back(request_words: ShootWords) -> None:
    plan = plan_shoot(parse_request(request_words)).plan
    assert parse_plan(format_plan(plan)) == plan


@given(ANY_REQUEST)
@settings(max_examples=150, deadline=None)
def test_no_row_can_hold_two_flashes_with_both_clocks_at_their_worst(request_words: ShootWords) -> None:
    plan = plan_shoot(parse_request(request_words)).plan
    camera_ppm = request_words.camera_clock_ppm
    is_known = request_words.strobe_clock_ppm != "unknown"
    strobe_ppm = float(request_words.strobe_clock_ppm) if is_known else 10_000 - camera_ppm
    shortest_dark_s = plan.dark_s * (1 - strobe_ppm * 1e-6)
    longest_exposure_s = plan.camera.exposure_s * (1 + camera_ppm * 1e-6)
    assert shortest_dark_s >= longest_exposure_s * (1 - 1e-12)


@pytest.mark.parametrize("clock_ppm", [-100.0, 0.0, 100.0])
def test_row_weights_find_no_row_with_two_flashes_within_the_clocks_tolerance(clock_ppm: float) -> None:
    plan = planned(readout="10ms").plan
    train = plan.train(-2, 30)
    rate = 1 + clock_ppm * 1e-6
    weights = row_weights(plan.camera, train.start_s * rate + 1.7e-3, train.duration_s * rate, frames=range(0, 25))
    assert np.count_nonzero(weights > 1e-12, axis=0).max() == 1


def test_a_dark_slot_comes_about_twice_a_second_and_never_in_the_flicker_range() -> None:
    for fps in ("24", "50", "119.88", "480"):
        figures = planned(fps=fps, readout="0.9ms", flash="0.1ms").figures
        assert 1.3 < figures.dark_slot_rate_hz <= 2.0


@pytest.mark.parametrize("lights", ["a", "a,b", "a,b,c", "a,b,c,d,e", ",".join(f"l{n}" for n in range(130))])
@pytest.mark.parametrize("fps", ["500", "600", "1000"])
def test_every_board_plays_the_plan_of_a_fast_camera_whose_cycle_is_as_long_as_it_may_be(fps: str, lights: str) -> None:
    fast = {"fps": fps, "readout": "0.9ms", "flash": "0.1ms", "lights": lights}
    plan = planned(**fast).plan
    count = len(plan.lights)
    round_s = sum(plan.flashes[slot].duration_s + plan.dark_s for slot in plan.lit_slots)
    for board in BOARDS.values():
        assert len(plan.cycle_slots) <= board.steps
    longer = replace(plan, dark_every=plan.dark_every + 1)
    assert plan.dark_every * round_s > 0.5 or len(longer.cycle_slots) > min(board.steps for board in BOARDS.values())
    most = (min(board.steps for board in BOARDS.values()) - 1) // count
    assert planned(**fast, dark_every=most).plan.dark_every == most
    with pytest.raises(UsageError, match=f"`dark_every` {most + 1}: .* flashes .*Give {most}"):
        planned(**fast, dark_every=most + 1)


@pytest.mark.parametrize("dark", ["30s", "1e300s"])
def test_a_cycle_that_no_board_plays_is_refused(dark: str) -> None:
    with pytest.raises(UsageError, match=r"no board plays more than 60 s\. Give a shorter `dark_s`"):
        planned(dark=dark)


@pytest.mark.parametrize(("dark_slot", "most"), [(None, 38), ("0.4s", 38), ("0.001ms", 38)])
def test_a_cycle_that_is_advised_is_played_with_its_dark_slot(dark_slot: str | None, most: int) -> None:
    slow = {"fps": "2", "readout": "300ms", "flash": "10ms", "dark_slot": dark_slot}
    longest = planned(**slow, dark_every=most).plan
    assert longest.cycle_s <= 60 < replace(longest, dark_every=most + 1).cycle_s
    with pytest.raises(UsageError, match=f"Give {most} or fewer") as refused:
        planned(**slow, dark_every=most + 1)
    assert f"in {replace(longest, dark_every=most + 1).cycle_s:.3g} s" in str(refused.value)


def test_dark_slots_that_a_fast_cameras_board_cannot_make_rarer_are_warned_of() -> None:
    figures = planned(fps="1000", readout="0.9ms", flash="0.1ms")
    assert 3.0 < figures.figures.dark_slot_rate_hz < 4.0
    assert "up to what a board holds" in text_of(figures, "flicker")


def test_the_marker_is_a_dark_slot_a_longer_first_flash_or_nothing() -> None:
    dark = planned(dark_slot="0.1ms").plan
    assert [flash.is_dark for flash in dark.flashes] == [False, False, False, True]
    assert dark.flashes[3].duration_s == 1e-4
    assert planned().plan.flashes[3].duration_s == 8e-4
    long = planned(marker="long")
    assert [flash.duration_s for flash in long.plan.flashes] == pytest.approx([LONG_MARKER * 8e-4, 8e-4, 8e-4])
    assert (len(planned(marker="none").plan.flashes), long.plan.dark_every) == (3, 1)
    assert "marker" in kinds(planned(marker="none"))
    assert "marker" not in kinds(planned(marker="none", flash="key=1ms,left=0.5ms,right=0.5ms")), "lengths mark it"
    assert "marker" in kinds(planned(marker="long", flash="key=0.5ms,left=0.75ms,right=0.75ms")), "all alike in the end"
    assert "ambient" in kinds(long)


@given(st.floats(0.1, 10), st.floats(50, 50_000), st.sampled_from(["dark", "long"]))
def test_the_largest_blur_becomes_the_longest_flash_that_keeps_it(blur_px: float, speed: float, marker: str) -> None:
    shoot = planned(flash=None, max_blur=blur_px, speed=str(speed), marker=marker)
    longest_px = max(slot.blur_px or 0 for slot in shoot.figures.slots)
    assert longest_px <= blur_px * (1 + 1e-9)
    if shoot.chosen and "blur" in shoot.chosen:
        assert longest_px >= 0.98 * blur_px


@given(st.floats(0.002, 0.2), st.integers(1, 8), st.sampled_from(["none", "long"]))
def test_the_largest_duty_is_kept_and_used_up(duty: float, count: int, marker: str) -> None:
    lights = ",".join(f"l{index}" for index in range(count))
    shoot = planned(flash=None, max_duty=str(duty), lights=lights, marker=marker)
    most = max(light.duty for light in shoot.figures.lights)
    assert most <= duty * (1 + 1e-9)
    if "duty" in (shoot.chosen or ""):
        assert most >= 0.98 * duty
    assert "duty" not in kinds(shoot)


@pytest.mark.parametrize("duty", [0.004, 0.012, 0.03, 0.3])
@pytest.mark.parametrize("count", [1, 3, 8])
@pytest.mark.parametrize("mode", ["rolling", "half-rate", "synced"])
@pytest.mark.parametrize(
    "marker",
    [
        {"marker": "long"},
        {"marker": "none"},
        {"marker": "dark", "dark_every": 1},
        {"marker": "dark", "dark_every": 3},
        {"marker": "dark", "dark_every": 1, "dark_slot": "0.3ms"},
        {"marker": "dark", "dark_every": 2, "dark_slot": "4ms"},
    ],
)
def test_the_largest_duty_counts_dark_slots_and_holds_in_every_mode(
    duty: float, count: int, mode: str, marker: dict[str, object]
) -> None:
    lights = ",".join(f"l{index}" for index in range(count))
    shoot = planned(flash=None, max_duty=str(duty), lights=lights, readout="1ms", mode=mode, **marker)
    most = max(light.duty for light in shoot.figures.lights)
    assert most <= duty * (1 + 1e-9)
    if "duty" in (shoot.chosen or ""):
        assert most >= 0.98 * duty
    assert "duty" not in kinds(shoot)


def test_the_longest_pulse_holds_for_the_long_marker_too() -> None:
    shoot = planned(flash=None, max_pulse="1ms", marker="long")
    assert max(slot.duration_s for slot in shoot.figures.slots) == pytest.approx(1e-3, rel=0.01)
    assert max(slot.duration_s for slot in shoot.figures.slots) <= 1e-3
    assert "longest pulse of 1 ms" in (shoot.chosen or "")


def test_a_slow_subject_does_not_get_a_flash_that_ruins_the_rate() -> None:
    shoot = planned(flash=None, max_blur=100, speed="1")
    assert shoot.figures.flash_rate_hz > 78
    assert "rate" in (shoot.chosen or "")


def test_wishes_that_exclude_each_other_are_explained_with_the_numbers() -> None:
    with pytest.raises(UsageError) as refusal:
        planned(flash=None, max_blur=1, speed="20000", max_stops=5)
    for figure in ("50 us", "7.6 stops", "--max-stops 5", "0.3125 ms", "6.25 px"):
        assert figure in spelled(str(refusal.value))
    assert planned(flash=None, max_blur=1, speed="20000", max_stops=8).chosen


@pytest.mark.parametrize(
    ("given_words", "named"),
    [
        ({"flash": None}, "--max-blur"),
        ({"flash": None, "max_blur": 1}, "--speed"),
        ({"max_blur": -1.0}, "--max-blur"),
        ({"flash": "11ms"}, "longer than the exposure"),
        ({"flash": "11ms", "dark": "12ms"}, "longer than the exposure"),
        ({"dark": "9.9ms"}, "two flashes"),
        ({"mode": "synced", "dark": "12ms"}, "--dark"),
        ({"mode": "half-rate", "dark": "9ms"}, "two flashes"),
        ({"shutter": 400.0}, "--shutter"),
        ({"shutter": 0.0}, "--shutter"),
        ({"shutter": 180.0, "exposure": "5ms"}, "--exposure"),
        ({"exposure": "11ms"}, "frame period"),
        ({"readout": "11ms"}, "impossible"),
        ({"readout": "-11ms"}, "impossible"),
        ({"mode": "rolling-rate"}, "half-rate"),
        ({"marker": "bright"}, "dark, coded, long, none"),
        ({"dark_every": 0}, "--dark-every"),
        ({"dark_every": 30_000}, "Give 79"),
        ({"fps": "2", "dark_every": 41}, "in 62.1 s, and boards hold 240 flashes and play 60 s at most. Give 39 or"),
        ({"black": float("nan")}, "--black nan: expected a code value"),
        ({"white": float("inf")}, "--white inf: expected a code value"),
        ({"marker": "none", "dark_slot": "1ms"}, "--dark-slot"),
        ({"black": 512.0, "white": 512.0}, "--black"),
        ({"cfa": "RGBG"}, "RGGB"),
        ({"transfer": "slog33"}, "slog3"),
        ({"strobe_clock_ppm": "-5"}, "--strobe-clock-ppm"),
        ({"strobe_clock_ppm": "good"}, "unknown"),
        ({"camera_clock_ppm": 9000.0, "strobe_clock_ppm": "2000"}, "10000"),
        ({"camera_clock_ppm": float("nan")}, "--camera-clock-ppm"),
        ({"fps": None}, "--fps"),
        ({"size": None}, "--size"),
        ({"readout": None}, "--readout"),
    ],
)
def test_what_cannot_be_is_refused_by_name_with_exit_status_2(given_words: dict[str, object], named: str) -> None:
    with pytest.raises(UsageError) as refusal:
        planned(**given_words)
    assert named in spelled(str(refusal.value))
    assert "\n" not in str(refusal.value)
    assert refusal.value.exit_status == 2


def test_a_preset_fills_in_what_was_left_out_and_an_own_readout_wins() -> None:
    wish = CameraWish(name="f65", fps=Fraction(120))
    camera, preset = choose_camera(wish, mode="rolling")
    assert (camera.name, camera.width_px) == ("Sony F65", 1920)
    assert camera.readout_s == pytest.approx(1 / 120, rel=1e-4)
    assert preset is not None
    measured, none = choose_camera(CameraWish(name="f65", fps=Fraction(120), readout_s=0.0081), mode="rolling")
    assert (measured.readout_s, none) == (0.0081, None)
    unknown, _ = choose_camera(CameraWish(name="f65", fps=Fraction(120), readout_known=False), mode="rolling")
    assert unknown.readout_s is None
    own, _ = choose_camera(
        CameraWish(name="My Camera", fps=Fraction(50), size_px=(640, 480), readout_s=0.0), mode="rolling"
    )
    assert (own.name, own.readout_s) == ("My Camera", 0.0)


def test_a_plan_for_a_trigger_needs_no_readout_and_no_marker() -> None:
    shoot = planned(mode="synced", readout=None)
    assert [flash.is_dark for flash in shoot.plan.flashes] == [False] * 3
    assert shoot.figures.flash_rate_hz == pytest.approx(100)
    assert "marker" not in kinds(shoot)
    unequal = planned(mode="synced", readout=None, flash="key=1ms,left=2ms,right=3ms").figures
    assert unequal.flash_rate_hz == pytest.approx(100)
    assert [light.duty for light in unequal.lights] == pytest.approx([0.1 / 3, 0.2 / 3, 0.3 / 3])
    assert "synced" in kinds(planned(mode="synced", readout="9.5ms"))
    assert "synced" not in kinds(shoot)


def test_lights_synced_to_the_frames_shine_while_all_rows_are_open_unless_something_limits_them() -> None:
    shoot = planned(mode="synced", readout=None, flash=None)
    assert [flash.duration_s for flash in shoot.plan.flashes] == pytest.approx([0.01] * 3)
    assert shoot.chosen == "10 ms, decided by the time in which all rows are open"
    rolling = planned(mode="synced", readout="4ms", flash=None).plan
    assert rolling.flashes[0].duration_s == pytest.approx(0.006)
    with pytest.raises(UsageError, match="Nothing says how long"):
        planned(flash=None)


def test_half_rate_keeps_two_frames_between_flashes() -> None:
    shoot = planned(mode="half-rate")
    assert shoot.plan.dark_s + 8e-4 == pytest.approx(0.02)
    assert planned(mode="half-rate", marker="none").figures.flash_rate_hz == pytest.approx(50)


def test_flicker_is_named_for_what_flickers() -> None:
    by_light = planned(fps="240", readout="4ms", flash="0.2ms", lights="a,b,c,d")
    assert "Each light" in text_of(by_light, "flicker")
    assert "whole scene" not in text_of(by_light, "flicker")
    everything = planned(fps="50", flash="1ms")
    assert "The whole scene flickers at 45.7" in text_of(everything, "flicker")
    nothing = planned(fps="480", readout="1.9ms", flash="50us")
    assert "flicker" not in kinds(nothing)
    often = planned(fps="1000", readout="0.9ms", flash="50us", dark_every=6)
    assert "Dark slots come" in text_of(often, "flicker")


def test_a_margin_thinner_than_the_clocks_is_warned_of_with_what_would_do() -> None:
    assert "margin" not in kinds(planned())
    thin = planned(dark="10.0005ms")
    assert "50 ppm" in text_of(thin, "margin")
    assert "10.001ms" in text_of(thin, "margin")
    assert "margin" not in kinds(planned(dark="10.0011ms"))


def test_limits_of_the_leds_that_a_given_flash_passes_are_named_with_what_would_fit() -> None:
    shoot = planned(flash="2ms", max_pulse="1ms", max_duty="2%", marker="none")
    assert "key, left and right" in text_of(shoot, "pulse")
    fitting = planned(flash=None, max_duty="2%", marker="none").plan.flashes[0].duration_s
    assert f"{fitting * 1e3:.3f}"[:4] in text_of(shoot, "duty")
    assert not {"pulse", "duty"} & kinds(planned(flash="0.5ms", max_pulse="1ms", max_duty="2%"))


@pytest.mark.parametrize("mode", ["rolling", "half-rate", "synced"])
@pytest.mark.parametrize("marker", [{"marker": "none"}, {"marker": "dark", "dark_every": 1}])
def test_the_flash_that_is_advised_for_a_duty_uses_it_up_in_every_mode(mode: str, marker: dict[str, object]) -> None:
    given_words = {"mode": mode, "max_duty": "8%", "readout": "0", **marker}
    advised = re.search(r"Flashes of ([\d.]+) ms", text_of(planned(flash="8ms", **given_words), "duty"))
    assert advised is not None
    fitting = planned(flash=f"{advised[1]}ms", **given_words)
    assert [light.duty for light in fitting.figures.lights] == pytest.approx([0.08] * 3, rel=1e-3)


def test_only_flashes_of_a_triggered_plan_are_called_cut() -> None:
    triggered = {"mode": "synced", "shutter": 180.0, "readout": "0", "marker": "dark", "dark_every": 1}
    assert "synced" not in kinds(planned(flash="1ms", dark_slot="4.9ms", **triggered))
    plan = planned(flash="1ms", dark_slot="4.9ms", **triggered).plan
    for slot, cut in ((3, False), (0, True)):
        flashes = list(plan.flashes)
        flashes[slot] = replace(flashes[slot], duration_s=8e-3)
        longer = replace(plan, flashes=tuple(flashes))
        cautions = shoot_cautions(longer, shoot_figures(longer))
        assert any(caution.kind == "synced" for caution in cautions) == cut


def test_missing_rows_that_round_to_none_are_not_spoken_of() -> None:
    """At 324 degrees a row is blind for 1 ms of 10: hardly longer than the flash."""
    dust = planned(shutter=324.0, flash="0.9999ms")
    assert 0 < dust.figures.missing_row_share < 1e-4
    assert "blind" not in kinds(dust)
    assert "missing rows" not in table_text(dust)
    some = planned(shutter=324.0, flash="0.94ms")
    assert "1% of the rows" in text_of(some, "blind")
    assert "missing rows" in table_text(some)


def test_rows_that_no_frame_sees_are_warned_of() -> None:
    shoot = planned(shutter=180.0)
    assert shoot.figures.missing_row_share == pytest.approx(0.5 - 0.08)
    assert "42%" in text_of(shoot, "blind")
    assert "blind" not in kinds(planned())


def test_rows_that_other_rounds_show_are_not_called_holes() -> None:
    assert "come from the rounds before and after" in text_of(planned(shutter=180.0), "blind")


def test_a_strobe_in_step_with_the_frames_is_warned_of_with_a_dark_time_that_is_not() -> None:
    """Three flashes of 2.5 ms and a dark slot, 5 ms apart, last three frames of 10 ms."""
    in_step = {"shutter": 180.0, "flash": "2.5ms", "dark": "5ms", "dark_every": 1}
    shoot = planned(**in_step)
    assert "every 3 frames" in text_of(shoot, "in-step")
    assert "come from the rounds before" not in text_of(shoot, "blind")
    better = re.search(r"`dark_s` to ([\d.]+ms)", text_of(shoot, "in-step").replace(" ms", "ms"))
    assert better is not None
    assert "in-step" not in kinds(planned(**{**in_step, "dark": better[1]}))
    assert "in-step" not in kinds(planned(**{**in_step, "shutter": 360.0, "dark": "12.5ms"}))


def test_a_slow_camera_that_only_films_long_is_not_said_to_be_in_step() -> None:
    """At 1 frame a second ten rounds do not show every row, and sixty do: the rounds drift past the frames."""
    slow = planned(fps="1", readout="900ms", shutter=170.0, flash="10ms", dark_every=1)
    assert never_shown(slow.plan, lasts_s=10.0) > 0.1
    assert never_shown(slow.plan, lasts_s=100.0) == 0
    assert "in-step" not in kinds(slow)


@pytest.mark.parametrize(("drift", "said"), [(0.0, "however long the take"), (20e-6, "in a take of 10 s")])
def test_a_strobe_that_slowly_drifts_is_in_step_for_a_take_and_not_for_ever(drift: float, said: str) -> None:
    dark = f"{9 * (1 + drift)}ms"
    shoot = planned(shutter=180.0, flash="1ms", dark=dark, marker="none")
    assert (never_shown(shoot.plan, lasts_s=10_000.0) > 0) == (drift == 0)
    assert said in text_of(shoot, "in-step")


def test_a_half_rate_strobe_in_step_is_not_told_to_leave_half_rate_for_another_dark_time() -> None:
    shoot = planned(shutter=180.0, flash="1ms", mode="half-rate", dark_every=1)
    assert "or `mode` to rolling" in text_of(shoot, "in-step")
    assert "dark_s" not in text_of(shoot, "in-step")
    assert dark_s_out_of_step(shoot.plan) is None
    assert "in-step" not in kinds(planned(shutter=180.0, flash="1ms", dark_every=1))


def test_a_given_flash_that_breaks_a_wish_for_sharpness_or_light_is_warned_of() -> None:
    blurred = planned(flash="0.8ms", max_blur=1, speed="4000")
    assert "blurs 3.2 px at 4000 px/s, over the limit of 1 px" in text_of(blurred, "blur")
    assert "at most 0.25 ms" in text_of(blurred, "blur")
    assert "blur" not in kinds(planned(flash="0.25ms", max_blur=1, speed="4000"))
    dim = planned(flash="0.8ms", max_stops=1)
    assert "3.64 stops less: over the limit of 1. " in text_of(dim, "dim")
    assert "Flash for 5 ms and more" in text_of(dim, "dim")
    assert "dim" not in kinds(planned(flash="5ms", max_stops=1))
    with pytest.raises(UsageError, match="`max_blur_px` needs `speed_px_s`"):
        planned(flash="0.8ms", max_blur=1)


def test_advice_on_a_dim_flash_breaks_no_wish() -> None:
    assert "Flash for 5 ms and more" in text_of(planned(flash="0.1ms", max_stops=1), "dim")
    assert "Flash for 0.1562 ms and more" in text_of(planned(flash="0.1ms", max_stops=9), "dim")
    for limits in ({"max_pulse": "0.12ms"}, {"max_blur": 1, "speed": "9000"}, {"power": "1%"}):
        text = text_of(planned(flash="0.1ms", **limits), "dim")
        assert "stops less" in text
        assert "Flash for" not in text
    both = text_of(planned(flash="0.8ms", max_blur=1, speed="4000", max_stops=1), "dim")
    assert "Flash for" not in both
    assert "Allow more stops" in both


def test_dark_slots_of_a_code_are_made_rarer_by_what_a_coded_plan_accepts() -> None:
    coded = text_of(planned(fps="240", readout="4ms", flash="0.2ms", marker="coded"), "flicker")
    assert "Dark slots come" in coded
    assert "dark_every" not in coded
    assert "`marker` dark" in coded
    assert "larger `dark_every`" in text_of(planned(fps="240", readout="4ms", flash="0.2ms", dark_every=4), "flicker")


def test_two_lights_are_warned_of_before_anything_is_filmed() -> None:
    assert "Normals need three lights" in text_of(planned(lights="key,left"), "lights")
    assert "lights" not in kinds(planned())


def test_a_flash_that_leaves_no_light_is_warned_of_with_what_would_do() -> None:
    text = text_of(planned(flash="50us"), "dim")
    assert "7.6 stops less" in text
    assert "Flash for 0.1562 ms and more" in text
    assert "dim" not in kinds(planned(flash="0.2ms"))


@pytest.mark.parametrize(("third", "warned"), [([0.0, 0.6, 0.8], False), ([-0.6, 0.02, 0.8], True)])
def test_lights_that_will_stand_in_one_plane_are_warned_of(tmp_path: Path, third: list[float], warned: bool) -> None:
    places = {"key": [0.6, 0.0, 0.8], "left": [0.1, 0.0, 0.995], "right": third}
    tables = "".join(f'[[light]]\nname = "{name}"\ndirection = {at}\nintensity = 1.0\n' for name, at in places.items())
    (tmp_path / "rig.toml").write_text('schema = "psvideo-rig/1"\n' + tables, encoding="utf-8")
    shoot = capture_plan(parse_request(words()), rig=tmp_path / "rig.toml")
    said = [caution for caution in shoot.cautions if caution.kind == "rig"]
    assert [caution.level for caution in said] == ["warning" if warned else "note"]
    assert ("in one plane" in said[0].text) == warned
    directions = np.array([*places.values()])
    scaled = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    assert warned or f"is {np.linalg.cond(scaled):.2f} " in said[0].text


def test_three_frame_flashes_come_with_the_durations_of_equation_11() -> None:
    text = text_of(planned(readout="10ms", flash="0.8ms"), "three-frames")
    assert "0.8333 ms or 0.7692 ms" in text
    assert "three-frames" not in kinds(planned(readout="5ms"))


@pytest.mark.parametrize(
    ("marker", "said"),
    [("dark", "for every flash and dark slot, but only"), ("none", "for every flash, but only"), ("long", None)],
)
def test_equal_flashes_are_offered_where_flashes_may_be_equal(marker: str, said: str | None) -> None:
    text = text_of(planned(readout="10ms", flash="0.8ms", marker=marker), "three-frames")
    assert "reach into three frames" in text
    assert (said is None and "Eq. 11" not in text) or (said is not None and said in text)
    assert text == text.strip()


def test_a_misnamed_frame_rate_is_asked_about() -> None:
    assert "120000/1001" in text_of(planned(fps="120", readout="8ms"), "fps")
    assert "fps" not in kinds(planned(fps="119.88", readout="8ms"))
    assert "fps" not in kinds(planned(fps="100"))
    preset = plan_shoot(parse_request(ShootWords(camera="z9", fps="120", size="3840x2160", flash="0.8ms")))
    assert preset.plan.camera.fps == Fraction(120_000, 1001)
    assert "119.88" in text_of(preset, "fps")
    exact = plan_shoot(parse_request(ShootWords(camera="Sony F65", fps="120000/1001", flash="0.8ms")))
    assert exact.plan.camera.fps == Fraction(120_000, 1001)
    assert "fps" not in kinds(exact)


def test_figures_that_rest_on_little_are_called_so() -> None:
    assumed = plan_shoot(parse_request(ShootWords(camera="Sony F65", fps="120", flash="0.8ms")))
    assert "rests on little" in text_of(assumed, "readout")
    measured = plan_shoot(parse_request(ShootWords(camera="z9", fps="120", size="3840x2160", flash="0.8ms")))
    assert "readout" not in kinds(measured)


def test_what_motion_will_cost_is_said_where_the_speed_is_known() -> None:
    assert "motion" not in kinds(planned())
    assert "motion" not in kinds(planned(speed="20"))
    slow, fast = (planned(speed=speed).cautions for speed in ("100", "800"))
    levels = [next(one.level for one in cautions if one.kind == "motion") for cautions in (slow, fast)]
    assert levels == ["note", "warning"]
    assert re.search(
        r"[89]\.\d px from flash to flash: .* are lost .* degrees", text_of(planned(speed="800"), "motion")
    )
    costs = [motion_cost(step_px) for step_px in (0.0, 0.5, 1.0, 3.0, 8.0, 16.0, 40.0)]
    for before, after in itertools.pairwise(costs):
        assert before.lost <= after.lost <= after.worst_lost <= 1
        assert before.off_deg <= after.off_deg <= after.worst_off_deg
    assert costs[0].lost == costs[0].worst_off_deg == 0


def test_a_plan_of_somebody_else_can_be_judged_without_its_request() -> None:
    plan = planned().plan
    short = Plan(camera=plan.camera, flashes=plan.flashes, dark_s=0.0098, dark_every=plan.dark_every)
    cautions = shoot_cautions(short, shoot_figures(short))
    assert "margin" in {caution.kind for caution in cautions}


@given(st.floats(1e-5, 1e-2), st.floats(0.01, 1))
def test_the_chosen_flash_never_exceeds_any_bound(pulse_s: float, duty: float) -> None:
    camera = Camera(width_px=4, height_px=4, fps=Fraction(60), exposure_s=1 / 60, readout_s=0.0)
    request = ShootRequest(
        camera=camera,
        lights=("a", "b"),
        power={"a": 1.0, "b": 1.0},
        limits=Limits(max_pulse_s=pulse_s, max_duty=duty),
        marker="none",
    )
    flash_s = longest_flash(request).flash_s
    assume(flash_s > 0)
    figures = shoot_figures(make_plan(request, {"a": flash_s, "b": flash_s}))
    assert flash_s <= pulse_s * (1 + 1e-9)
    assert figures.lights[0].duty <= duty * (1 + 1e-9)


def test_a_known_speed_shows_the_blur_of_a_flash_that_the_leds_decide() -> None:
    shoot = planned(flash=None, max_duty="5%", speed="800")
    assert "duty" in (shoot.chosen or "")
    assert all(slot.blur_px == pytest.approx(800 * slot.duration_s) for slot in shoot.figures.slots)
    with pytest.raises(UsageError, match="`max_blur_px` needs `speed_px_s`"):
        planned(flash=None, speed="800")
