"""Several takes calibrated in one go: a rig for each, and a report that begins with what is wrong."""

import json
import re
from collections.abc import Mapping
from pathlib import Path

import cv2
import numpy as np
import pytest
from angles import angles_deg
from bench.mirror_scene import Ball, Lamp, Lens, photograph

from psvideo.cli.app import main
from psvideo.formats.rig_toml import read_rig
from psvideo.report.rigs_report import LightOfTake, RigResult, worst_rigs_first
from psvideo.report.stood_still import changes

DIRECTIONS = {"key": (0.3, 0.4, 0.87), "left": (-0.5, 0.2, 0.84), "low": (0.1, -0.4, 0.9)}
MOVED = (0.5, 0.4, 0.77)
BALL = Ball(centre=(0.0, 0.0, -0.45), radius_m=0.05)
LENS = Lens(width=200, height=200, focal=600.0)


def angle_deg(one: tuple[float, float, float], other: tuple[float, float, float]) -> float:
    return float(angles_deg(one, other))


def filmed(folder: Path, directions: Mapping[str, tuple[float, float, float]]) -> str:
    folder.mkdir()
    for n, (name, direction) in enumerate(directions.items()):
        picture = photograph(LENS, [BALL], [Lamp(direction=direction)], noise=0.002, seed=n)
        cv2.imwrite(str(folder / f"{name}.png"), np.round(picture * 65535).astype(np.uint16))
    return str(folder)


def test_every_take_gets_its_rig_and_the_report_begins_with_what_is_wrong(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    takes = [filmed(tmp_path / name, DIRECTIONS) for name in ("take1", "take2")]
    takes.append(filmed(tmp_path / "take3", DIRECTIONS | {"key": MOVED}))
    (tmp_path / "take4").mkdir()
    for name in DIRECTIONS:
        cv2.imwrite(str(tmp_path / "take4" / f"{name}.png"), np.full((100, 140, 3), 30, np.uint8))
    words = ["calibrate", "mirror-sphere", *takes, str(tmp_path / "take4"), "--focal-px", "600", "--each"]
    assert main([*words, "-o", str(tmp_path / "rigs"), "--json"]) == 1
    found = json.loads(capsys.readouterr().out)
    assert found == json.loads((tmp_path / "rigs" / "report.json").read_text(encoding="utf-8"))
    assert [Path(one["take"]).name for one in found["takes"]][:2] == ["take4", "take3"]
    assert "no sphere" in found["takes"][0]["fault"]
    moved = [[words for words in one["findings"] if "stands" in words] for one in found["takes"]]
    assert [len(one) for one in moved] == [0, 1, 0, 0]
    said = re.match(r"Light 'key' stands ([\d.]+) degrees .* stood in take1", moved[1][0])
    assert said is not None
    assert float(said[1]) == pytest.approx(angle_deg(DIRECTIONS["key"], MOVED), abs=0.3)
    assert {light.name for light in read_rig(tmp_path / "rigs" / "take2.toml").lights} == set(DIRECTIONS)
    page = (tmp_path / "rigs" / "report.html").read_text(encoding="utf-8")
    assert re.findall(r"<th><a [^>]*>(\w+)</a></th>", page)[:2] == ["take4", "take3"]
    assert 'href="take3.png"' in page
    assert main([*words, "-o", str(tmp_path / "rigs")]) == 2, "rigs are not replaced without --force"
    assert main([*words, "-o", str(tmp_path / "rig.toml")]) == 2, "every take gets a rig of its own"


def measured(take: str, turned_deg: float, error_deg: float, intensity: float = 1.0) -> RigResult:
    angle = np.radians(turned_deg)
    light = LightOfTake(
        name="key",
        direction=(float(np.sin(angle)), 0.0, float(np.cos(angle))),
        error_deg=error_deg,
        intensity=intensity,
        intensity_error=0.01,
    )
    return RigResult(take=Path(take), rig=Path(f"{take}.toml"), lights=(light,))


def test_a_light_that_was_knocked_is_named_once_and_one_that_creeps_once_it_shows() -> None:
    knocked = changes([measured(f"t{n}", 0.0 if n < 3 else 4.0, 0.3) for n in range(6)])
    assert [len(one.findings) for one in knocked] == [0, 0, 0, 1, 0, 0]
    creeps = changes([measured(f"t{n}", 0.3 * n, 0.3) for n in range(10)])
    assert [len(one.findings) for one in creeps] == [0, 0, 0, 0, 0, 1, 0, 0, 0, 0]
    assert "1.5 degrees" in creeps[5].findings[0]


def test_chance_alone_moves_no_light() -> None:
    rng = np.random.default_rng(5)
    said = 0
    for _ in range(200):
        rigs = [measured(f"t{n}", float(rng.normal(0, 0.3)), 0.3, 1 + float(rng.normal(0, 0.01))) for n in range(5)]
        said += sum(len(one.findings) for one in changes(rigs))
    assert said < 12, "of 800 comparisons of directions 0.1 by chance, of as many of intensities 2.2"


def test_a_light_that_dims_is_named_and_takes_without_lights_come_before_uncertain_ones() -> None:
    dimmed = changes([measured("t0", 0, 0.3), measured("t1", 0, 0.3, 0.9)])
    assert "0.9 times as bright" in dimmed[1].findings[0]
    lacking = RigResult(take=Path("t2"), rig=Path("t2.toml"), lights=(LightOfTake(name="key", missing=True),))
    failed = RigResult(take=Path("t3"), rig=Path("t3.toml"), fault="No sphere.")
    order = worst_rigs_first([*dimmed, lacking, failed, measured("t4", 0, 2.0)])
    assert [one.take.name for one in order] == ["t3", "t2", "t1", "t4", "t0"]
