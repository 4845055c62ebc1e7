"""The report's first lines say of every spoilt take what to change on set, and call a good one usable."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from coarse_ball import COARSE_BALL
from filmed import filmed

from psvideo.cli.app import main

SPHERE = (Path(__file__).resolve().parents[1] / "data_synth" / "sphere.toml").read_text()
FIVE = """
[[light]]
name = "low"
direction = [0.6, -0.3, 0.8]

[[light]]
name = "rim"
direction = [-0.3, -0.6, 0.8]

[[object]]
mesh = "sphere"
"""
PAINT = 'albedo = { pattern = "noise", colour = [0.8, 0.7, 0.6], second = [0.4, 0.45, 0.5], size_m = 0.15 }'
THREE_LIGHTS = SPHERE.replace("frames = 12", "frames = 21").replace(
    "readout_s = 0.01\n", "readout_s = 0.01\nfull_well_e = 20000.0\nread_e = 5.0\n"
)
FIVE_LIGHTS = THREE_LIGHTS.replace('\n[[object]]\nmesh = "sphere"\n', FIVE).replace("albedo = 0.8", PAINT)
MOVING = FIVE_LIGHTS.replace('mesh = "sphere"', f'mesh = "{COARSE_BALL}"')
NAMES = ("key", "left", "top", "low", "rim")


def strength(scene: str, light: str, intensity: float) -> str:
    return scene.replace(f'name = "{light}"\n', f'name = "{light}"\nintensity = {intensity}\n')


def all_strengths(scene: str, intensity: float) -> str:
    for name in NAMES:
        scene = strength(scene, name, intensity)
    return scene


SCENES = {
    "good": FIVE_LIGHTS,
    "three": THREE_LIGHTS,
    "dark": all_strengths(FIVE_LIGHTS, 0.05),
    "bright": all_strengths(FIVE_LIGHTS, 2.4),
    "key_clips": strength(FIVE_LIGHTS, "key", 2.5),
    "weak": strength(FIVE_LIGHTS, "left", 0.06),
    "dead": strength(FIVE_LIGHTS, "left", 0.0001),
    "ambient": FIVE_LIGHTS + "\n[ambient]\nlevel = 0.25\n",
    "sun": FIVE_LIGHTS + "\n[ambient]\nlevel = 0.7\n",
    "spinning": MOVING + "motion = { spin_deg_per_s = 200.0, axis = [0.0, 1.0, 0.0] }\n",
    "passing": MOVING + "motion = { velocity_m_per_s = [1.2, 0.0, 0.0] }\n",
    "dropped": FIVE_LIGHTS.replace("frames = 21", "frames = 30") + "\n[output]\ndropped = [9, 10]\n",
    "cut": FIVE_LIGHTS.replace("flash_s = 0.001", "flash_s = 0.001\ndark_s = 0.007"),
    "half_open": FIVE_LIGHTS.replace("shutter_deg = 360.0", "shutter_deg = 180.0"),
    "noisy": all_strengths(FIVE_LIGHTS, 0.15).replace("full_well_e = 20000.0", "full_well_e = 1500.0"),
    "noisier": all_strengths(FIVE_LIGHTS, 0.12).replace("full_well_e = 20000.0", "full_well_e = 1500.0"),
}


def run(*arguments: object) -> int:
    return main([str(argument) for argument in arguments])


@pytest.fixture(scope="module")
def shot(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Film one of the scenes, once."""
    return filmed(tmp_path_factory.mktemp("shoots"), SCENES)


@pytest.fixture(scope="module")
def reported(shot: Callable[[str], Path], tmp_path_factory: pytest.TempPathFactory) -> Callable[..., dict[str, Any]]:
    """Solve one of the clips, once, and give report.json."""
    folder = tmp_path_factory.mktemp("out")

    def report(name: str) -> dict[str, Any]:
        if not (folder / name).is_dir():
            clip = shot(name)
            assert run("normals", clip, "--rig", clip / "rig.toml", "-o", folder / name, "--no-preview", "-q") == 0
        found: dict[str, Any] = json.loads((folder / name / "report.json").read_text())
        return found

    return report


def said(report: dict[str, Any], subject: str) -> dict[str, str]:
    """Return the first line on a subject that is not good."""
    return next(line for line in report["judgements"] if line["subject"] == subject and line["grade"] != "good")


@pytest.mark.parametrize("name", ["good", "three"])
def test_a_good_take_is_called_usable_and_every_line_good(reported: Callable[..., dict[str, Any]], name: str) -> None:
    report = reported(name)
    assert report["verdict"] == "This take is usable."
    assert report["usable"]
    assert report["findings"] == []
    assert {line["grade"] for line in report["judgements"]} <= {"good", "unknown"}


LIKE_OTHERS = {"sun", "passing", "noisier"}
"""Worse than another take in the table, or moving in another way: campaigns look at them too."""
SPOILT = [
    ("dark", "usable, with reservations", "exposure", r"4\.[4-8] stops below.*Open the aperture by about 4 stops"),
    ("bright", "not usable as it is: clipping", "clipping", r"Every light clips.*Close the aperture by about 1"),
    ("key_clips", "usable, with reservations", "clipping", r"'key' is clipped in [34]\d .*lights on \d %.*(40|45) %"),
    ("weak", "usable, with reservations", "lights", r"'left' is weak: [67] %"),
    ("dead", "doubtful: see below", "lights", r"'left' gives no light"),
    ("ambient", "usable, with reservations", "ambient", r"3\d % of the signal.*Cover windows"),
    ("sun", "not usable as it is: ambient", "ambient", r"5\d % of the signal"),
    ("spinning", "usable, with reservations", "motion", r"picture moves, by up to 1\.\d px from flash to flash"),
    ("passing", "usable, with reservations", "motion", r"by up to 1\.[34] px from flash to flash"),
    ("dropped", "usable, with reservations", "frames", r"2 frames are missing \(2 after number 9\)"),
    ("cut", "not usable as it is: rows", "rows", r"dark time of 7 ms is shorter.*plates are cut.*at least 10 ms"),
    ("half_open", "usable, with reservations", "rows", r"180 degrees only.*other rounds.*Shoot at 360 degrees"),
    ("noisy", "usable, with reservations", "validity", r"reach [89]\d %.*error is too large. Give more light"),
    ("noisier", "not usable as it is: validity", "validity", r"reach 8\d %.* (9|1[0-2]) % of .*Give more light"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("name", "verdict", "subject", "words"),
    [pytest.param(*case, marks=pytest.mark.campaign if case[0] in LIKE_OTHERS else ()) for case in SPOILT],
)
def test_the_first_lines_say_what_spoils_a_take_and_what_to_change(
    reported: Callable[..., dict[str, Any]], name: str, verdict: str, subject: str, words: str
) -> None:
    report = reported(name)
    assert verdict in report["verdict"]
    assert report["usable"] == ("not usable" not in verdict)
    line = said(report, subject)
    assert re.search(words, f"{line['found']} {line['advice']}")
    assert f"{line['found']} {line['advice']}".strip() in report["findings"]
    others = {one["subject"] for one in report["judgements"] if one["grade"] in ("bad", "doubtful")} - {subject}
    assert others <= {"order", "validity", "clipping", "noise", "accuracy"}, "no other thing is blamed"


def test_the_power_that_is_advised_no_longer_clips(reported: Callable[..., dict[str, Any]]) -> None:
    line = said(reported("key_clips"), "clipping")
    power = float(re.findall(r"(\d+) %", line["advice"])[0]) / 100
    assert 0.6 < power * 2.5 * 0.8 < 1.05, "the brightest paint under the key at that power, of saturation"


def test_the_histograms_of_a_known_scene_lie_where_its_light_is(reported: Callable[..., dict[str, Any]]) -> None:
    for row in reported("three")["exposure"]:
        stops = row["stops_below_saturation"]
        assert stops["p99_5"] == pytest.approx(np.log2(0.8 * 0.8), abs=0.1), "albedo 0.8 under intensity 0.8, head on"
        assert sum(row["shares_by_quarter_stop"]) == pytest.approx(1, abs=1e-3)
        assert row["clipped_share"] == 0


@pytest.mark.parametrize(
    ("name", "spoil", "words"),
    [
        ("three", "flip", "cannot be those of one surface"),
        ("good", "flip", "cannot be those of one surface"),
        ("good", "swap", "The rig does not fit the plates"),
        ("good", "strong", "with other strengths it would: 'key' (4[89]|5[0-2]) % of what the rig says"),
    ],
)
def test_a_wrong_rig_is_not_believed(
    shot: Callable[[str], Path], tmp_path: Path, name: str, spoil: str, words: str
) -> None:
    clip = shot(name)
    rig = (clip / "rig.toml").read_text()
    if spoil == "flip":
        rig = re.sub(r"(direction = \[[^,]*), ([^,]*),", lambda found: f"{found[1]}, {-float(found[2])},", rig)
    elif spoil == "swap":
        rig = rig.replace('"key"', '"@"').replace('"left"', '"key"').replace('"@"', '"left"')
    else:
        rig = re.sub(r"intensity = .*", "intensity = 1.6", rig, count=1)
    (tmp_path / "rig.toml").write_text(rig)
    assert run("normals", clip, "--rig", tmp_path / "rig.toml", "-o", tmp_path / "out", "-q") == 0
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert "usable." not in report["verdict"]
    assert any(re.search(words, line["found"]) for line in report["judgements"] if line["subject"] == "rig")


def test_photographs_named_in_another_order_than_the_rig_are_separated_from_those_in_order(
    shared_data: Path, tmp_path: Path
) -> None:
    cat = shared_data / "uw_psm" / "cat"
    flashes = "".join(f'[[strobe.flash]]\nlights = {{ "L{n}" = 1.0 }}\n' for n in range(12))
    plan = tmp_path / "plan.toml"
    plan.write_text(
        'schema = "psvideo-plan/1"\n[camera]\nwidth_px = 512\nheight_px = 340\nfps = 1\n'
        f'[strobe]\nmode = "synced"\n{flashes}'
    )
    mixed = tmp_path / "cat"
    mixed.mkdir()
    for number, file in enumerate(sorted(cat.glob("cat.[0-9]*.png"))):  # 0, 1, 10, 11, 2 …
        (mixed / f"cat.{number}.png").symlink_to(file)
    said: list[str] = []
    usable: list[bool] = []
    for clip in (cat, mixed):
        out = tmp_path / f"out{len(said)}"
        rig, mask = shared_data / "uw_psm" / "lights.txt", cat / "cat.mask.png"
        assert run("normals", clip, "--plan", plan, "--rig", rig, "--mask", mask, "-o", out, "-q") == 0
        report = json.loads((out / "report.json").read_text())
        usable.append(report["usable"])
        said.append(" ".join(line["found"] for line in report["judgements"] if line["subject"] in ("rig", "accuracy")))
    assert usable[0]
    assert "they are a few degrees off" in said[0], "the directions are known to be so"
    order = re.compile("does not fit the plates|cannot be those of one surface")
    assert not order.search(said[0])
    assert len(order.findall(said[1])) == 2


@pytest.mark.parametrize("name", ["plain", "ambient"])
def test_clips_of_another_simulator_are_usable(shared_data: Path, tmp_path: Path, name: str) -> None:
    clip = shared_data / "clips" / name
    assert run("normals", clip, "--rig", clip / "rig.toml", "-o", tmp_path / "out", "-q") == 0
    assert json.loads((tmp_path / "out" / "report.json").read_text())["verdict"] == "This take is usable."


def test_a_page_asks_for_nothing_and_shows_all(shot: Callable[[str], Path], tmp_path: Path) -> None:
    clip = shot("dropped")
    command = ("normals", clip, "--rig", clip / "rig.toml", "-o", tmp_path / "out", "-q")
    assert run(*command) == 0
    page = (tmp_path / "out" / "report.html").read_text()
    assert not re.search(r"(src|href)=\"(?!data:)|url\(|@import|<script", page)
    assert not re.search(r"\bnan\b|\binf\b", page)
    body = page[page.index("<h1>") :]
    assert body.index("with reservations") < body.index("2 frames are missing") < body.index("<h2>")
    for words in ("What was shot", "Phase locked", "key", "half of the subject below", "Over time", "SHA-256"):
        assert words in body
    assert f"psvideo {' '.join(map(str, command))}" in body
    assert body.count("<svg") == 5 + 4, "a histogram per light, and four charts over time"
    assert body.count("<img") >= 2, "one round, and the worst instants"


def test_split_reports_too_without_a_rig(shot: Callable[[str], Path], tmp_path: Path) -> None:
    assert run("split", shot("key_clips"), "-o", tmp_path / "plates", "-q") == 0
    report = json.loads((tmp_path / "plates" / "report.json").read_text())
    assert report["kind"] == "split"
    assert "'key' is clipped" in said(report, "clipping")["found"]
    assert report["instants"][0]["valid_share"] is None
    assert "<svg" in (tmp_path / "plates" / "report.html").read_text()
