"""psvideo strobe as a user runs it, and its log as sync reads it."""

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from psvideo.cli.app import main
from psvideo.errors import PsvideoError, UsageError
from psvideo.formats.plan_toml import format_plan, read_plan
from psvideo.model.plan import Plan, PlannedFlash
from psvideo.runs.strobe.run import run as play
from psvideo.strobe.as_played import as_played
from psvideo.strobe.confirmed import is_confirmed, remember, state_folder
from psvideo.strobe.runlog import format_log, plan_sha256, read_log
from psvideo.strobe.seizures import Rate, flash_rates, seizure_warning

RIGS = Path(__file__).resolve().parents[1] / "lights" / "rigs"
SCENES = Path(__file__).resolve().parents[1] / "data_synth"


def run(*arguments: object) -> int:
    return main([str(argument) for argument in arguments])


@pytest.fixture
def plan_file(tmp_path: Path) -> Path:
    return Path(shutil.copy(RIGS / "head_ring_plan.toml", tmp_path / "plan.toml"))


@pytest.fixture(autouse=True)
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Keep what is remembered away from the user's own folder."""
    folder = tmp_path / "state"
    monkeypatch.setattr("psvideo.strobe.confirmed.state_folder", lambda: folder)
    return folder


def test_an_emulated_run_needs_no_board_and_leaves_a_log(plan_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = plan_file.with_name("strobe.json")
    assert run("strobe", "run", plan_file, "--port", "emulated", "--rounds", "5", "--log", log, "--line", "left=7") == 0
    said = capsys.readouterr()
    assert "Played 1 whole cycle of 19 rounds." in said.out
    assert "FLASHING LIGHT" not in said.err, "an emulated board flashes nothing"
    found = read_log(log)
    assert (found.cycles, found.ended, found.board, found.wiring) == (1, "done", "atmega328p", "gated")
    assert found.lines == {"key": 0, "left": 7, "right": 1}
    assert found.plan_sha256 == plan_sha256(plan_file)
    assert str(plan_file.parent) not in log.read_text()
    assert run("strobe", "run", plan_file, "--port", "emulated", "--rounds", "1", "--log", log) == 2
    assert "exists already" in capsys.readouterr().err


def test_machines_get_the_log(plan_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ("--port", "emulated", "--board", "rp2040", "--seconds", "0.3", "--json", "-q")
    assert run("strobe", "run", plan_file, *arguments) == 0
    said = capsys.readouterr()
    record = json.loads(said.out)
    assert (record["schema"], record["tick_ps"], record["wiring"]) == ("psvideo-strobe/1", 8000, "direct")
    assert said.err == ""


def test_the_table_of_boards_says_who_plays_a_plan(plan_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("strobe", "check", plan_file, "--json") == 0
    rows = json.loads(capsys.readouterr().out)["boards"]
    assert {(row["board"], row["wiring"]): row["plays"] for row in rows} == {
        ("atmega328p", "gated"): True,
        ("atmega328p", "direct"): False,
        ("atmega2560", "gated"): True,
        ("atmega2560", "direct"): True,
        ("rp2040", "direct"): True,
    }


def test_a_check_shows_ticks_wiring_and_what_to_beware_of(plan_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("strobe", "check", plan_file, "--board", "atmega328p") == 0
    said = capsys.readouterr()
    assert "flash 1: key at 1, 0.8 ms = 1600 ticks" in said.out
    assert "may be 5000 ppm off, and the dark time leaves a margin of 100 ppm" in said.err
    assert "between 3 and 70 Hz" in said.err
    assert run("strobe", "check", plan_file, "--board", "rp2040") == 0
    assert "ppm off" not in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "status", "says"),
    [
        (["--board", "uno"], 2, "--board uno"),
        (["--wiring", "gate"], 2, "did you mean 'gated'"),
        (["--board", "rp2040", "--wiring", "gated"], 2, "direct wiring only"),
        (["--line", "key"], 2, "such as key=0"),
        (["--line", "key=-1"], 2, "such as key=0"),
        (["--line", "kye=1", "--board", "rp2040"], 2, "did you mean 'key'"),
        (["--line", "key=1", "--line", "key=2"], 2, "wired to line 1 already"),
        (["--line", "key=1,left"], 2, "--line key=1,left: expected a light's name and a line's number"),
        (["--line", "kye=1"], 2, "the plan has no such light: did you mean 'key'"),
        (["--board", "atmega328p", "--wiring", "direct"], 1, "3 lights and this board has 2 lines"),
        (["--port", "/dev/ttyNOT0"], 1, "no such port"),
        (["--port", __file__], 1, "is no serial port, or one that does not answer; psvideo strobe list shows"),
    ],
)
def test_wrong_usage_and_plans_that_do_not_fit_are_one_paragraph(
    plan_file: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], status: int, says: str
) -> None:
    assert run("strobe", "check", plan_file, *arguments) == status
    said = capsys.readouterr().err
    assert says in said
    assert said.count("\n") == 1


def test_several_lights_are_wired_in_one_word_as_durations_are_given(
    plan_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("strobe", "check", plan_file, "--board", "rp2040", "--line", "key=5,left=2") == 0
    assert "key on line 5, left on line 2" in capsys.readouterr().out


def test_times_that_cannot_be_are_refused(plan_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    base = ("strobe", "run", plan_file, "--port", "emulated")
    assert run(*base, "--seconds", "1", "--rounds", "1") == 2
    assert "one of the two" in capsys.readouterr().err
    assert run(*base, "--seconds", "0") == 2
    assert run(*base, "--rounds", "0") == 2
    assert run(*base, "--rounds", "1", "--board", "mega") == 2
    assert run("strobe", "run", plan_file, "--port", "/dev/ttyNOT0", "--board", "rp2040", "--yes") == 2
    assert "says itself what it is" in capsys.readouterr().err


def test_nothing_flashes_unless_the_warning_was_confirmed(
    plan_file: Path, capsys: pytest.CaptureFixture[str], state: Path
) -> None:
    assert run("strobe", "run", plan_file, "--port", "/dev/ttyNOT0") == 2
    said = capsys.readouterr().err
    assert "35.8 Hz" in said
    assert "--yes" in said
    assert run("strobe", "run", plan_file, "--port", "/dev/ttyNOT0", "--yes") == 1
    assert "no such port" in capsys.readouterr().err
    assert remember(plan_sha256(plan_file), folder=state)
    assert run("strobe", "run", plan_file, "--port", "/dev/ttyNOT0") == 1
    plan_file.write_text(plan_file.read_text().replace("0.0008", "0.0009"))
    assert run("strobe", "run", plan_file, "--port", "/dev/ttyNOT0") == 2


def test_a_run_asks_its_caller_with_the_warning_and_remembers_a_yes(plan_file: Path, state: Path) -> None:
    asked: list[str] = []

    def yes(warning: str) -> bool:
        asked.append(warning)
        return True

    def no(warning: str) -> bool:
        return not yes(warning)

    with pytest.raises(UsageError, match=r"35\.8 Hz.*give `yes` when everybody has been warned"):
        play(plan_file, port="/dev/ttyNOT0")
    with pytest.raises(PsvideoError, match="Not confirmed, so nothing flashed"):
        play(plan_file, port="/dev/ttyNOT0", confirm=no)
    assert not is_confirmed(plan_sha256(plan_file), folder=state)
    for _ in range(2):
        with pytest.raises(PsvideoError, match="no such port"):
            play(plan_file, port="/dev/ttyNOT0", confirm=yes)
    assert is_confirmed(plan_sha256(plan_file), folder=state)
    assert len(asked) == 2, "once yes, it is not asked again"
    assert all("FLASHING LIGHT" in warning for warning in asked)


def test_what_was_confirmed_is_remembered_plan_by_plan(tmp_path: Path) -> None:
    folder = tmp_path / "deep" / "state"
    assert not is_confirmed("a", folder=folder)
    assert remember("a", folder=folder)
    assert remember("b", folder=folder)
    assert is_confirmed("a", folder=folder)
    assert is_confirmed("b", folder=folder)
    assert not is_confirmed("c", folder=folder)
    (tmp_path / "file").write_text("")
    assert not remember("a", folder=tmp_path / "file")
    assert state_folder().name == "psvideo"


def test_a_flash_rate_that_is_dangerous_is_named_light_by_light(make_plan: Callable[..., Plan]) -> None:
    plan = make_plan(dark=False)
    rates = {rate.what: rate.hz for rate in flash_rates(plan)}
    assert rates["all flashes together"] == pytest.approx(3 * rates["light key"])
    warning = seizure_warning(plan)
    assert warning is not None
    assert "light key, light left, light right at 36.5 Hz" in warning
    assert "all flashes together at 109.4 Hz" in warning
    assert seizure_warning(make_plan(lights=("key",), dark=False)) is None


@pytest.mark.parametrize(("hz", "dangerous"), [(2.9, False), (3.0, True), (68.0, True), (70.0, True), (70.1, False)])
def test_rates_from_3_to_70_a_second_are_dangerous(hz: float, dangerous: bool) -> None:
    """IEEE 1789-2015."""
    assert Rate(what="a light", hz=hz).is_dangerous == dangerous


def test_a_synced_plan_is_refused_with_the_reason(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "plan.toml"
    path.write_text(
        'schema = "psvideo-plan/1"\n[camera]\nwidth_px = 8\nheight_px = 8\nfps = 10\n[strobe]\nmode = "synced"\n'
        "[[strobe.flash]]\nlights = { key = 1.0 }\nduration_s = 0.001\n"
    )
    assert run("strobe", "run", path, "--port", "emulated", "--rounds", "1") == 1
    assert "no wire from the camera" in capsys.readouterr().err


def test_ports_are_listed_without_being_opened(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("strobe", "list") == 0
    capsys.readouterr()
    assert run("strobe", "list", "--json") == 0
    assert isinstance(json.loads(capsys.readouterr().out)["ports"], list)


def test_an_emulated_board_can_be_stopped(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("strobe", "stop", "--port", "emulated") == 0
    assert "dark, idle, interlock closed" in capsys.readouterr().out


@pytest.fixture
def clip(tmp_path: Path) -> Path:
    """A clip whose strobe ran 4,000 ppm slow, as a ceramic resonator may, under a plan that expects crystals."""
    scene = (SCENES / "sphere.toml").read_text().replace("= 160", "= 40").replace("= 120", "= 60")
    scene = scene.replace("frames = 12", "frames = 40")
    scene = scene.replace("clock_offset_ppm = 40.0", "clock_offset_ppm = 4000.0\ndark_s = 0.0101003")
    (tmp_path / "scene.toml").write_text(scene)
    assert run("synth", tmp_path / "scene.toml", "-o", tmp_path / "clip", "-q") == 0
    return tmp_path / "clip"


def test_sync_starts_from_what_the_log_says(clip: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("sync", clip) == 0
    assert "more than the 100 ppm of the plan" in capsys.readouterr().err
    plan = clip / "plan.toml"
    assert run("strobe", "run", plan, "--port", "emulated", "--rounds", 1, "--log", clip / "strobe.json", "-q") == 0
    assert run("sync", clip, "-v", "--json") == 0
    said = capsys.readouterr()
    assert "more than" not in said.err
    assert "strobe.json: times as atmega328p played them" in said.err
    rounded = 0.0111005 / 0.0111003
    assert json.loads(said.out)["clock_offset_ppm"] == pytest.approx((1.004 / rounded - 1) * 1e6, abs=1)
    assert run("info", clip) == 0
    assert run("info", clip / "strobe.json") == 0
    assert "it is the log of the plan.toml beside it" in capsys.readouterr().out


def test_the_log_of_another_plan_is_warned_of_and_not_used(clip: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plan = clip / "plan.toml"
    assert run("strobe", "run", plan, "--port", "emulated", "--rounds", 1, "--log", clip / "strobe.json", "-q") == 0
    played = plan.read_text()
    assert "dark_s = 0.0101003" in played
    plan.write_text(played.replace("dark_s = 0.0101003", "dark_s = 0.0101013"))
    capsys.readouterr()
    assert run("sync", clip) == 0
    said = capsys.readouterr().err
    assert "strobe.json is the log of another plan than plan.toml" in said
    assert "more than the 100 ppm of the plan" in said


def test_a_plan_as_played_has_the_board_s_times_and_powers(
    tmp_path: Path, make_plan: Callable[..., Plan], capsys: pytest.CaptureFixture[str]
) -> None:
    path, log = tmp_path / "plan.toml", tmp_path / "strobe.json"
    flashes = (PlannedFlash(lights={"key": 0.371}, duration_s=0.00080013), PlannedFlash(lights={}, duration_s=0.001))
    asked = make_plan(lights=("key",))
    path.write_text(format_plan(Plan(camera=asked.camera, flashes=flashes, dark_s=0.00900011)))
    assert as_played(read_plan(path), path).plan == read_plan(path)
    assert run("strobe", "run", path, "--port", "emulated", "--rounds", 1, "--log", log, "-q") == 0
    played = as_played(read_plan(path), path).plan
    assert played.flashes[0].duration_s == pytest.approx(0.0008, abs=1e-12)
    assert played.flashes[0].lights["key"] == pytest.approx(0.37, abs=1e-12)
    assert played.dark_s == pytest.approx(0.009, abs=1e-12)
    assert played.clock_tolerance_ppm == 5100


def test_a_plan_whose_camera_was_put_right_keeps_its_log_and_one_that_asks_for_other_ticks_does_not(
    tmp_path: Path, make_plan: Callable[..., Plan]
) -> None:
    """Remarks advise to write what was found of the camera into the plan that the strobe played."""
    path, log = tmp_path / "plan.toml", tmp_path / "strobe.json"
    asked = make_plan(lights=("key", "fill"))
    flashes = (
        PlannedFlash(lights={"key": 0.371, "fill": 0.0}, duration_s=0.0008),
        PlannedFlash(lights={"key": 0.0, "fill": 1.0}, duration_s=0.0008),
        PlannedFlash(lights={"key": 0.0, "fill": 0.0}, duration_s=0.0008),
    )
    plan = Plan(camera=asked.camera, flashes=flashes, dark_s=0.009)
    path.write_text(format_plan(plan))
    assert run("strobe", "run", path, "--port", "emulated", "--rounds", 1, "--log", log, "-q") == 0
    plan = read_plan(path)

    def warned(changed: Plan) -> bool:
        path.write_text(format_plan(changed))
        return as_played(read_plan(path), path).warning is not None

    assert not warned(plan)
    assert not warned(replace(plan, camera=replace(plan.camera, readout_s=0.9 * (plan.camera.readout_s or 0.01))))
    assert warned(replace(plan, dark_s=plan.dark_s + 1e-6))
    assert warned(replace(plan, flashes=tuple(replace(flash, duration_s=0.000802) for flash in flashes)))
    dimmer = replace(flashes[0], lights={"key": 0.38, "fill": 0.0})
    assert warned(replace(plan, flashes=(dimmer, *flashes[1:])))
    assert warned(replace(plan, dark_every=2)), "the same flashes in another cycle"


@pytest.mark.parametrize("ticks", [1600, 1601, 2003])
def test_a_flash_of_full_and_part_power_in_any_number_of_ticks_keeps_its_log(
    tmp_path: Path, make_plan: Callable[..., Plan], ticks: int
) -> None:
    """Bursts that do not divide a flash evenly are one tick longer than the flash divided by their number."""
    path, log = tmp_path / "plan.toml", tmp_path / "strobe.json"
    asked, slot_s = make_plan(lights=("key", "fill")), ticks * 0.5e-6
    flashes = (
        PlannedFlash(lights={"key": 1.0, "fill": 0.5}, duration_s=slot_s),
        PlannedFlash(lights={}, duration_s=slot_s),
    )
    plan = Plan(camera=asked.camera, flashes=flashes, dark_s=0.0101)
    path.write_text(format_plan(plan))
    direct = ("--wiring", "direct", "--rounds", 1, "--log", log, "-q")
    assert run("strobe", "run", path, "--port", "emulated", *direct) == 0
    assert read_log(log).flashes[0].duration_ticks == ticks
    right = replace(plan, camera=replace(plan.camera, readout_s=0.9 * (plan.camera.readout_s or 0.01)))
    path.write_text(format_plan(right))
    assert as_played(read_plan(path), path).warning is None


def test_a_log_comes_back_as_it_was_and_a_broken_one_is_named(plan_file: Path) -> None:
    log = plan_file.with_name("strobe.json")
    assert run("strobe", "run", plan_file, "--port", "emulated", "--rounds", 1, "--log", log, "-q") == 0
    assert format_log(read_log(log)) == log.read_text()
    whole = log.read_text()
    for broken, says in (
        (whole.replace('"tick_ps": 500000', '"tick_ps": 0'), "key 'tick_ps'"),
        (whole.replace("psvideo-strobe/1", "psvideo-strobe/2"), "newer"),
        (whole.replace('"check"', '"chekc"'), "key 'check'"),
        (whole[:-30], "not a JSON object"),
        ("[]", "not a JSON object"),
    ):
        log.write_text(broken)
        with pytest.raises(PsvideoError, match=says) as caught:
            read_log(log)
        assert str(log) in str(caught.value)


Edit = Callable[[dict[str, Any]], None]
"""A change to what strobe.json holds."""


def put(value: object, *keys: str | int) -> Edit:
    def edit(log: Any) -> None:
        for key in keys[:-1]:
            log = log[key]
        log[keys[-1]] = value

    return edit


@pytest.mark.parametrize("other_plan", [False, True])
@pytest.mark.parametrize(
    ("edit", "says"),
    [
        (lambda log: log["lines"].pop("key"), "lines has no key; expected every light that flashes"),
        (put(9, "lines", "key"), r"key 'lines\.key' is 9"),
        (put(-1, "lines", "key"), r"key 'lines\.key' is -1"),
        (put(0, "flashes", 0, "lit_ticks", "key"), r"key 'flashes\[1\]\.lit_ticks\.key' is 0"),
        (put(-5, "flashes", 0, "lit_ticks", "key"), r"key 'flashes\[1\]\.lit_ticks\.key' is -5"),
        (put(99_999, "flashes", 0, "lit_ticks", "key"), r"lit_ticks\.key is 99999; expected at most duration_ticks"),
        (put(10**30, "flashes", 0, "duration_ticks"), r"key 'flashes\[1\]\.duration_ticks' is 10{30}"),
        (put(10**12, "flashes", 0, "period_ticks"), r"key 'flashes\[1\]\.period_ticks' is 10{12}"),
        (put(10**9, "flashes", 0, "period_ticks"), "period_ticks is 1000000000; expected at most duration_ticks"),
        (put(10**400, "tick_ps"), "key 'tick_ps'"),
        (put(10**12, "dark_ticks"), "key 'dark_ticks' is 10{12}"),
        (put(-1, "check"), "key 'check' is -1"),
    ],
)
def test_a_log_of_what_no_board_plays_is_refused(plan_file: Path, edit: Edit, says: str, other_plan: bool) -> None:
    log = plan_file.with_name("strobe.json")
    assert run("strobe", "run", plan_file, "--port", "emulated", "--rounds", 1, "--log", log, "-q") == 0
    data = json.loads(log.read_text())
    edit(data)
    log.write_text(json.dumps(data | ({"plan_sha256": "0" * 64} if other_plan else {})))
    with pytest.raises(PsvideoError, match=says) as caught:
        as_played(read_plan(plan_file), plan_file)
    assert str(log) in str(caught.value)


def test_a_log_whose_ticks_or_check_are_not_its_plan_s_is_not_used(plan_file: Path) -> None:
    log = plan_file.with_name("strobe.json")
    assert run("strobe", "run", plan_file, "--port", "emulated", "--rounds", 1, "--log", log, "-q") == 0
    plan, whole = read_plan(plan_file), log.read_text()
    assert as_played(plan, plan_file).warning is None
    for edit in (
        put(1, "tick_ps"),
        put(0, "dark_ticks"),
        put(1, "cycle_ticks"),
        put(1, "check"),
        put(7, "lines", "key"),
    ):
        data = json.loads(whole)
        edit(data)
        log.write_text(json.dumps(data))
        found = as_played(plan, plan_file)
        assert found.plan == plan
        assert "strobe.json names the checksum of plan.toml, but its ticks or its check" in (found.warning or "")
