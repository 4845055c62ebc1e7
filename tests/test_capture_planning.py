"""Plans that keep the rolling rule for both clocks at their worst, and what is planned for each mode and wish."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shoots_asked_for import kinds, planned, text_of, words

from psvideo.capture.cautions import shoot_cautions
from psvideo.capture.planning import plan_shoot
from psvideo.capture.request import CameraWish, choose_camera
from psvideo.capture.wish import LONG_MARKER
from psvideo.cli.options.capture import ShootWords
from psvideo.cli.options.shoot_words import parse_request
from psvideo.errors import UsageError
from psvideo.formats.plan_toml import format_plan, parse_plan
from psvideo.model.cost.shoot_figures import shoot_figures
from psvideo.model.plan import Plan
from psvideo.model.rows.shutter import row_weights

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


def stays_when_read_back(request_words: ShootWords) -> None:
    plan = plan_shoot(parse_request(request_words)).plan
    assert parse_plan(format_plan(plan)) == plan


@pytest.mark.parametrize("examples", [40, pytest.param(150, marks=pytest.mark.campaign)])
def test_a_plan_is_the_same_when_it_is_read_back(examples: int) -> None:
    settings(max_examples=examples, deadline=None)(given(ANY_REQUEST)(stays_when_read_back))()


@given(ANY_REQUEST)
@settings(max_examples=150, deadline=None)
@pytest.mark.campaign
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


def test_a_plan_of_somebody_else_can_be_judged_without_its_request() -> None:
    plan = planned().plan
    short = Plan(camera=plan.camera, flashes=plan.flashes, dark_s=0.0098, dark_every=plan.dark_every)
    cautions = shoot_cautions(short, shoot_figures(short))
    assert "margin" in {caution.kind for caution in cautions}
