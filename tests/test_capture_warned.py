"""What capture-plan warns of, and what it does not: rows that nobody sees, strobes in step, flashes, lights, motion."""

import io
import itertools
import re
from dataclasses import replace
from fractions import Fraction
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console
from shoots_asked_for import kinds, planned, text_of, words

from psvideo.capture.cautions import shoot_cautions
from psvideo.capture.planning import Shoot, plan_shoot
from psvideo.capture.tables import shoot_report
from psvideo.cli.options.capture import ShootWords
from psvideo.cli.options.shoot_words import parse_request
from psvideo.errors import PsvideoError, UsageError
from psvideo.model.cost.in_step import dark_s_out_of_step, never_shown
from psvideo.model.cost.motion_cost import motion_cost
from psvideo.model.cost.shoot_figures import shoot_figures
from psvideo.model.plan import Plan
from psvideo.runs.capture_plan import capture_plan
from psvideo.strobe.link.boards import BOARDS, Board, capabilities
from psvideo.strobe.program import make_program
from psvideo.strobe.seizures import seizure_warning


def table_text(shoot: Shoot) -> str:
    console = Console(file=io.StringIO(), width=200)
    with console.capture() as shown:
        console.print(*shoot_report(shoot, preset=None))
    return shown.get()


def test_dark_slots_that_a_fast_cameras_board_cannot_make_rarer_are_warned_of() -> None:
    figures = planned(fps="1000", readout="0.9ms", flash="0.1ms")
    assert 3.0 < figures.figures.dark_slot_rate_hz < 4.0
    assert "up to what a board holds" in text_of(figures, "flicker")


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


@pytest.mark.parametrize("fps", ["1000", "2000"])
def test_a_code_of_dark_slots_at_over_70_a_second_flickers_at_what_it_repeats_by(fps: str) -> None:
    """Its dark slots come unevenly: the light of a cycle, as a Fourier sum, swings by some per cent from 3 to 70 Hz."""
    period_ms = 1e3 / float(fps)
    shoot = planned(fps=fps, readout=f"{0.9 * period_ms}ms", flash=f"{0.1 * period_ms}ms", marker="coded")
    plan, cycle_s = shoot.plan, shoot.plan.cycle_s
    train = plan.train(0, len(plan.cycle_slots))
    lit = np.array([not plan.flashes[slot].is_dark for slot in train.slot])
    multiples = np.arange(1, int(70 * cycle_s) + 1)
    turns = np.exp(-2j * np.pi * np.outer(multiples / cycle_s, train.start_s))
    swing = 2 * np.abs((turns * lit).sum(axis=1)) / lit.sum()
    assert swing[multiples / cycle_s >= 3].max() > 0.04
    assert shoot.figures.dark_slot_rate_hz > 70
    assert f"repeats {1 / cycle_s:.3g} times a second" in text_of(shoot, "flicker")
    assert "the pattern of dark slots" in (seizure_warning(plan) or "")


NINE = ",".join("abcdefghi")


@pytest.mark.parametrize(
    ("given_words", "said"),
    [
        ({"lights": NINE, "fps": "240", "readout": "4ms"}, "9 lights take as many lines, and boards have 8"),
        ({"lights": "a,b,c", "fps": "12000", "readout": "80us", "flash": "20us"}, "the dark time is 83.34 us"),
        ({"fps": "4", "readout": "9ms", "flash": "60ms"}, "a flash lasts 60 ms, and theirs 50 ms at most"),
        ({"lights": "a,b,c,d,e,f,g,h"}, ""),
        ({"fps": "4", "flash": "50ms"}, ""),
        ({"fps": "9998", "readout": "80us", "flash": "20us"}, ""),
        ({"lights": NINE, "mode": "synced", "readout": "0"}, ""),
    ],
)
def test_what_no_board_plays_is_warned_of_and_what_one_plays_is_not(given_words: dict[str, object], said: str) -> None:
    shoot = planned(**given_words)
    assert said in text_of(shoot, "board")
    assert ("board" in kinds(shoot)) == bool(said)
    if shoot.plan.mode != "synced":
        assert any(map(partial(plays, shoot.plan), BOARDS.values())) == (not said)


def plays(plan: Plan, board: Board) -> bool:
    try:
        return bool(make_program(plan, capabilities(board, board.first_wiring)))
    except PsvideoError:
        return False


def test_a_margin_thinner_than_the_clocks_is_warned_of_with_what_would_do() -> None:
    assert "margin" not in kinds(planned())
    thin = planned(dark="10.0005ms")
    assert "50 ppm" in text_of(thin, "margin")
    assert "at least 10.0011ms" in text_of(thin, "margin"), "10.001ms is 0.01 ppm short of the clocks' 100"
    assert "margin" not in kinds(planned(dark="10.0011ms"))


@pytest.mark.parametrize("tolerance", ["0", "100", "5000", "unknown"])
@pytest.mark.parametrize("fps", ["23.976", "24", "29.97", "59.94", "119.88", "240", "1000/3", "999"])
def test_the_dark_time_and_the_exposure_that_are_advised_do(fps: str, tolerance: str) -> None:
    """Rounded to the nearest, half of them fell short and were answered with the same advice again."""
    camera = {"fps": fps, "readout": "0", "flash": "50us", "strobe_clock_ppm": tolerance}
    for refused, why in (("dark", "at least"), ("exposure", "at most")):
        wrong = planned(**camera).plan.camera.exposure_s * (0.9 if refused == "dark" else 1.1)
        with pytest.raises(UsageError) as said:
            planned(**camera, **{refused: f"{wrong * 1e3}ms"})
        advised = re.search(rf"{why} ([\d.]+) ?(ms|s)\b", str(said.value))
        assert advised is not None
        assert "margin" not in kinds(planned(**camera, **{refused: f"{advised[1]}{advised[2]}"}))


@pytest.mark.parametrize("speed", [600, 700, 1700])
def test_the_flash_that_is_advised_for_sharpness_is_sharp(speed: int) -> None:
    limits = {"speed": str(speed), "max_blur": 0.8}
    advised = re.search(r"at most ([\d.]+) (ms|us)", text_of(planned(flash="2ms", **limits), "blur"))
    assert advised is not None
    assert "blur" not in kinds(planned(flash=f"{advised[1]}{advised[2]}", **limits))


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
@pytest.mark.campaign
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


def test_a_known_speed_shows_the_blur_of_a_flash_that_the_leds_decide() -> None:
    shoot = planned(flash=None, max_duty="5%", speed="800")
    assert "duty" in (shoot.chosen or "")
    assert all(slot.blur_px == pytest.approx(800 * slot.duration_s) for slot in shoot.figures.slots)
    with pytest.raises(UsageError, match="`max_blur_px` needs `speed_px_s`"):
        planned(flash=None, speed="800")
