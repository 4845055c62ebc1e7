"""What lies in lights/ for people is true: rigs that fit the boards, and a schematic that its script draws."""

import csv
import importlib.util
import re
import tomllib
from pathlib import Path
from xml.etree import ElementTree

import pytest

from psvideo.cli.app import main
from psvideo.formats.plan_toml import read_plan
from psvideo.strobe.link.boards import BOARDS

LIGHTS = Path(__file__).resolve().parents[1] / "lights"
RIGS = ("head_ring", "dome")


@pytest.mark.parametrize("rig", RIGS)
@pytest.mark.parametrize("board", BOARDS)
def test_the_example_rigs_fit_every_board(rig: str, board: str, capsys: pytest.CaptureFixture[str]) -> None:
    plan = LIGHTS / "rigs" / f"{rig}_plan.toml"
    lights = {light["name"] for light in tomllib.loads((LIGHTS / "rigs" / f"{rig}.toml").read_text("utf-8"))["light"]}
    assert set(read_plan(plan).lights) == lights
    assert main(["strobe", "check", str(plan), "--board", board]) == 0
    said = "".join(capsys.readouterr())
    readme = (LIGHTS / "rigs" / "README.md").read_text(encoding="utf-8")
    row = next(line for line in readme.splitlines() if line.startswith(f"| {rig} |"))
    assert all(number in said for number in re.findall(r"\d+ flashes of \d+|\d+ different ones|[\d.]+ %", row))
    assert ("5000 ppm" in said) == (board != "rp2040")


def test_the_schematic_is_what_its_script_draws() -> None:
    spec = importlib.util.spec_from_file_location("draw", LIGHTS / "wiring" / "draw.py")
    assert spec is not None
    assert spec.loader is not None
    draw = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(draw)
    svg = (LIGHTS / "wiring" / "schematic.svg").read_text(encoding="utf-8")
    assert svg == draw.schematic().svg()
    assert ElementTree.fromstring(svg).tag.endswith("svg")


def test_every_part_of_the_schematic_is_in_the_list_for_three_and_eight_channels() -> None:
    with (LIGHTS / "wiring" / "parts.csv").open(encoding="utf-8", newline="") as file:
        parts = list(csv.DictReader(file))
    svg = (LIGHTS / "wiring" / "schematic.svg").read_text(encoding="utf-8")
    named = {name for name in re.findall(r">\s*([A-Z]\d)[ab]?\b", svg) if name != "X0"}
    assert named == {part["reference"] for part in parts} - {""}
    for part in parts:
        assert None not in part
        assert 1 <= int(part["for 3 channels"]) <= int(part["for 8 channels"]), part
