"""The order of the lights through whole commands: from the rig where it can be, by the user, or called a guess."""

import json
from pathlib import Path

import pytest

from psvideo.cli.app import main

SCENE = """schema = "psvideo-scene/1"
name = "ball"
frames = {frames}
seed = 3

[camera]
width_px = 80
height_px = 60
fps = 100
shutter_deg = {shutter}
readout_s = 0.01
width_m = 1.6

[strobe]
clock_offset_ppm = 40.0
phase_s = {phase_s}
flash = [{flashes}]

{lights}
[[object]]
mesh = "sphere"
albedo = 0.8
"""
DIRECTIONS = {
    "a": (0.6, 0.0, 0.8),
    "b": (0.3, 0.5, 0.8),
    "c": (-0.6, 0.2, 0.8),
    "d": (-0.2, -0.2, 0.9),
    "e": (0.3, -0.7, 0.7),
}


def shoot(folder: Path, names: str, *, phase_s: float = 0.0, frames: int = 20, shutter: float = 360.0) -> Path:
    """A ball under some of the lights, one after the other, without any marker."""
    scene = folder / "scene.toml"
    text = SCENE.format(
        frames=frames,
        shutter=shutter,
        phase_s=phase_s,
        flashes=", ".join(f"{{lights = {{{name} = 1.0}}, duration_s = 0.001}}" for name in names),
        lights="\n".join(f'[[light]]\nname = "{name}"\ndirection = {list(DIRECTIONS[name])}' for name in names),
    )
    scene.write_text(text)
    assert main(["synth", str(scene), "-o", str(folder / "clip"), "-q"]) == 0
    return folder / "clip"


@pytest.fixture(scope="module")
def five(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Five lights that lie irregularly; the clip begins in the middle of the cycle."""
    return shoot(tmp_path_factory.mktemp("five"), "abcde", phase_s=0.0242)


@pytest.fixture(scope="module")
def three(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return shoot(tmp_path_factory.mktemp("three"), "abc", frames=14)


def names_of(timing: Path) -> list[list[str]]:
    return [list(flash["lights"]) for flash in json.loads(timing.read_text())["flashes"]]


def run(*arguments: object) -> int:
    return main([str(argument) for argument in arguments])


def test_sync_takes_the_order_from_the_rig(five: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("sync", five, "-o", tmp_path / "guess.json") == 0
    assert json.loads((tmp_path / "guess.json").read_text())["order"] == "guess"
    assert "order_note" not in json.loads((tmp_path / "guess.json").read_text())
    capsys.readouterr()
    assert run("sync", five, "--rig", five / "rig.toml", "-o", tmp_path / "reported.json") == 0
    assert "found from the rig's directions" in capsys.readouterr().out
    reported = json.loads((tmp_path / "reported.json").read_text())
    assert reported["order"] == "rig"
    assert "in the next best" in reported["order_note"]
    assert names_of(tmp_path / "reported.json") == names_of(five / "truth" / "timing.json")


@pytest.mark.parametrize("shutter", [150.0, 90.0])
def test_below_360_degrees_the_next_cycles_lend_the_rows_by_which_the_rig_gives_the_order(
    shutter: float, tmp_path: Path
) -> None:
    clip = shoot(tmp_path, "abcde", phase_s=0.0242, frames=40, shutter=shutter)
    assert run("sync", clip, "--rig", clip / "rig.toml", "-o", tmp_path / "timing.json", "-q") == 0
    assert json.loads((tmp_path / "timing.json").read_text())["order"] == "rig"
    assert names_of(tmp_path / "timing.json") == names_of(clip / "truth" / "timing.json")


def test_split_and_normals_put_right_a_timing_that_was_named_wrongly(five: Path, tmp_path: Path) -> None:
    true = names_of(five / "truth" / "timing.json")
    assert run("sync", five, "-o", tmp_path / "timing.json", "-q") == 0
    wrong = json.loads((tmp_path / "timing.json").read_text())
    for flash in wrong["flashes"]:
        flash["slot"] = (flash["slot"] + 3) % 5
        flash["lights"] = {"abcde"[flash["slot"]]: 1.0}
    (tmp_path / "timing.json").write_text(json.dumps(wrong))
    options = ("--timing", tmp_path / "timing.json", "--rig", five / "rig.toml", "-q")
    assert run("split", five, "-o", tmp_path / "plates", *options) == 0
    assert run("normals", five, "-o", tmp_path / "out", *options) == 0
    for folder in ("plates", "out"):
        assert names_of(tmp_path / folder / "timing.json") == true
        assert json.loads((tmp_path / folder / "timing.json").read_text())["order"] == "rig"
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["order"] == "rig"
    assert report["verdict"].startswith("This take is usable")
    assert "in the next best" in report["order_note"]
    assert "The rig shows the order" in (tmp_path / "out" / "report.html").read_text()


def test_the_user_s_word_goes_before_the_rig_s(five: Path, tmp_path: Path) -> None:
    first = names_of(five / "truth" / "timing.json")
    complete = next(
        n
        for n, flash in enumerate(json.loads((five / "truth" / "timing.json").read_text())["flashes"])
        if flash["complete"]
    )
    other = next(name for name in "abcde" if name != first[complete][0])
    options = ("--first-light", other, "--rig", five / "rig.toml", "-q")
    assert run("sync", five, "-o", tmp_path / "timing.json", *options) == 0
    timing = json.loads((tmp_path / "timing.json").read_text())
    assert timing["order"] == "given"
    assert names_of(tmp_path / "timing.json")[complete] == [other]
    assert run("sync", five, "-o", tmp_path / "guess.json", "-q") == 0
    assert run("split", five, "-o", tmp_path / "plates", "--timing", tmp_path / "guess.json", *options) == 0
    assert names_of(tmp_path / "plates" / "timing.json") == names_of(tmp_path / "timing.json")


def test_three_lights_stay_a_guess_and_every_place_says_why(
    three: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("normals", three, "--rig", three / "rig.toml", "-o", tmp_path / "out") == 0
    said = capsys.readouterr().out
    why = "any picture fits any order of 3 flashes"
    assert "GUESS" in said
    assert why in said
    timing = json.loads((tmp_path / "out" / "timing.json").read_text())
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert timing["order"] == report["order"] == "guess"
    assert why in timing["order_note"]
    assert why in report["order_note"]
    assert any(why in finding for finding in report["findings"])
    assert why in (tmp_path / "out" / "report.html").read_text()
    assert report["verdict"].startswith("This take is doubtful")


def test_a_first_light_that_a_timing_cannot_have_is_refused(
    three: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("sync", three, "-o", tmp_path / "timing.json", "-q") == 0
    command = ("split", three, "-o", tmp_path / "plates", "--timing", tmp_path / "timing.json")
    assert run(*command, "--first-light", "lamp") == 2
    assert "lamp" in capsys.readouterr().err
    assert not (tmp_path / "plates").exists()
