"""A plan keeps within what was asked of blur, duty and pulses, and what no board plays or cannot be is refused."""

from dataclasses import replace
from fractions import Fraction

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from shoots_asked_for import kinds, planned

from psvideo.capture.planning import make_plan
from psvideo.capture.request import Limits, ShootRequest
from psvideo.capture.wish import longest_flash
from psvideo.cli.spelling import spelled
from psvideo.errors import UsageError
from psvideo.model.camera import Camera
from psvideo.model.cost.shoot_figures import shoot_figures
from psvideo.strobe.link.boards import BOARDS


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
