"""psvideo capture-plan as people use it: what it writes, prints and refuses."""

import json
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner, Result

from psvideo.cli.commands.capture_plan import capture_plan
from psvideo.cli.spelling import spelled
from psvideo.errors import PsvideoError, UsageError
from psvideo.formats.plan_toml import parse_plan, read_plan

APP = typer.Typer()
APP.command()(capture_plan)
README = ["--camera", "Sony F65", "--fps", "120", "--lights", "key,left,right", "--flash", "0.8ms"]


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(APP, [str(argument) for argument in arguments])


def test_the_readme_s_command_writes_a_plan_and_says_what_decides_the_shoot(tmp_path: Path) -> None:
    result = run(*README, "-o", tmp_path / "plan.toml")
    assert result.exit_code == 0
    plan = read_plan(tmp_path / "plan.toml")
    assert plan.lights == ("key", "left", "right")
    assert plan.camera.fps == 120
    for words in ("107.59 a second", "35.86", "+103.8 rows", "9.6%", "-3.4", "2-3 (3: 10%)", "2.87%", "35.9 Hz"):
        assert words in result.stdout + result.stderr, words
    assert "flicker" not in result.stdout
    assert "photosensitive" in result.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["plan.toml"]


@pytest.mark.parametrize(
    ("shutter", "flash", "words"),
    [
        ("360", "0.4ms", "put together from two frames"),
        ("180", "0.4ms", "scaled up from what one frame saw"),
        ("300", "0.6ms", "scaled up from what one frame saw"),
        ("300", "0.8ms", "scaled up from what one or two frames saw"),
        ("300", "key=0.8ms,left=0.4ms,right=0.4ms", "scaled up from what one or two frames saw"),
    ],
)
def test_partial_rows_are_put_together_from_as_many_frames_as_saw_them(shutter: str, flash: str, words: str) -> None:
    """At 240 fps the shutter is closed for 2.08 ms of a frame at 180 degrees, for 0.69 ms at 300."""
    camera = ["--size", "1920x1080", "--fps", "240", "--readout", "4.1ms", "--shutter", shutter]
    lines = run(*camera, "--lights", "key,left,right", "--flash", flash).stderr.splitlines()
    assert next(line for line in lines if line.startswith("partial rows")).rstrip().endswith(words)


def test_without_an_output_the_plan_goes_to_standard_output_alone() -> None:
    result = run(*README)
    assert parse_plan(result.stdout).lights == ("key", "left", "right")
    assert "107.59" in result.stderr


def test_machines_get_json_with_plan_figures_and_cautions(tmp_path: Path) -> None:
    data = json.loads(run(*README, "--json", "--speed", "800").stdout)
    assert parse_plan(data["plan"]).mode == "rolling"
    assert data["figures"]["slots"][0]["blur_px"] == pytest.approx(0.64)
    assert {"flicker", "readout", "fps", "three-frames", "motion"} == {caution["kind"] for caution in data["cautions"]}
    data = json.loads(run(*README, "--json", "-o", tmp_path / "plan.toml").stdout)
    assert Path(data["path"]).is_file()


def test_quiet_says_nothing_but_still_writes(tmp_path: Path) -> None:
    result = run(*README, "-q", "-o", tmp_path / "plan.toml", "--diagram", tmp_path / "plan.svg")
    assert result.output == ""
    assert sorted(path.name for path in tmp_path.iterdir()) == ["plan.svg", "plan.toml"]


def test_a_diagram_is_printed_where_it_is_asked_for(tmp_path: Path) -> None:
    assert "░" in run(*README, "-o", tmp_path / "a.toml", "--diagram", "-").stdout
    assert "░" not in run(*README, "-o", tmp_path / "b.toml").output


def test_what_exists_is_replaced_only_by_force(tmp_path: Path) -> None:
    out = tmp_path / "plan.toml"
    mine = 'schema = "psvideo-plan/1"'
    out.write_text(mine)
    refusal = run(*README, "-o", out)
    assert isinstance(refusal.exception, UsageError)
    assert "--force" in spelled(str(refusal.exception))
    assert out.read_text() == mine
    assert run(*README, "-o", out, "--force").exit_code == 0
    assert read_plan(out).camera.name == "Sony F65"


def test_a_refused_diagram_leaves_no_plan_behind(tmp_path: Path) -> None:
    result = run(*README, "-o", tmp_path / "plan.toml", "--diagram", tmp_path / "plan.gif")
    assert isinstance(result.exception, UsageError)
    assert not list(tmp_path.iterdir())


def test_a_folder_that_cannot_be_written_is_a_fault_of_the_run(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    result = run(*README, "-o", tmp_path / "file" / "plan.toml")
    assert isinstance(result.exception, PsvideoError)
    assert "plan.toml" in str(result.exception)


def test_the_cameras_are_listed_for_people_and_for_machines() -> None:
    listed = run("--list-cameras").stdout
    assert "Sony F65" in listed
    assert "global" in listed
    modes = json.loads(run("--list-cameras", "--json").stdout)["cameras"]
    assert len(modes) >= 40
    assert all(mode["source"] for mode in modes)


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["--camera", "Sony F56", "--flash", "1ms"], "Sony F65"),
        (["--camera", "F65", "--fps", "120"], "--flash 0.8ms"),
        (["--camera", "F65", "--fps", "120", "--flash", "1"], "'1'"),
        (["--camera", "F65", "--fps", "fast", "--flash", "1ms"], "'fast'"),
        (["--camera", "F65", "--fps", "120", "--readout", "9ms", "--flash", "1ms"], "9 ms"),
        (["--camera", "F65", "--fps", "120", "--flash", "1ms", "--dark", "8ms"], "8 ms"),
        (["--fps", "50", "--size", "10x10", "--flash", "1ms"], "--readout"),
    ],
)
def test_bad_numbers_get_one_paragraph_that_names_option_and_value(arguments: list[str], named: str) -> None:
    fault = run(*arguments).exception
    assert isinstance(fault, UsageError)
    assert named in spelled(str(fault))
    assert "\n" not in str(fault)


def test_a_readout_that_runs_upwards_can_be_typed(tmp_path: Path) -> None:
    out = tmp_path / "plan.toml"
    upwards = ["--fps", "50", "--size", "640x480", "--readout", "-8.1ms", "--flash", "1ms"]
    assert run(*upwards, "-o", out).exit_code == 0
    assert read_plan(out).camera.readout_s == pytest.approx(-0.0081)
