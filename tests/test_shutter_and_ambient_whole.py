"""Whole runs on a standing ball: at 180 degrees, and in room light without a dark slot, it is solved as at its best."""

import json
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from lit_ball import LIT_BALL

from psvideo.cli.app import main

SCENE = """
schema = "psvideo-scene/1"
name = "ball"
frames = {frames}
seed = 3
[camera]
width_px = 96
height_px = 72
fps = 100
shutter_deg = {shutter}
readout_s = {readout}
width_m = 1.6
full_well_e = 30000
read_e = 4
[strobe]
flash_s = 0.001
clock_offset_ppm = 40.0
marker = {marker}
[ambient]
level = {ambient}
{lit_ball}"""


def picture(path: Path) -> np.ndarray:
    (channel,) = OpenEXR.File(str(path)).channels().values()
    return np.asarray(channel.pixels, np.float32)


def film(
    folder: Path,
    *,
    shutter: float = 360.0,
    readout: float = 0.01,
    marker: bool = True,
    ambient: float = 0.0,
    frames: int = 48,
) -> Path:
    scene, words = folder / "scene.toml", {"shutter": shutter, "readout": readout, "marker": str(marker).lower()}
    scene.write_text(SCENE.format(**words, ambient=ambient, frames=frames, lit_ball=LIT_BALL), encoding="utf-8")
    assert main(["synth", str(scene), "-o", str(folder / "clip"), "-q"]) == 0
    return folder / "clip"


def solved(clip: Path, *options: str) -> tuple[float, float]:
    """Return which share of the ball is valid in the worst result, and by how many degrees those normals are off."""
    flashes = json.loads((clip / "truth" / "timing.json").read_text(encoding="utf-8"))["flashes"]
    first = next(next(iter(flash["lights"])) for flash in flashes if flash["complete"] and flash["lights"])
    out = clip.parent / "out"
    words = ["normals", clip, "--rig", clip / "rig.toml", "-o", out, "-q", *options]
    words += [] if any(not flash["lights"] for flash in flashes) else ["--first-light", first]
    assert main([str(word) for word in words]) == 0
    truth = picture(clip / "truth" / "normals.exr")
    ball = np.linalg.norm(truth, axis=-1) > 0.5
    shares, errors = [], []
    for file in sorted((out / "normals").iterdir()):
        valid = picture(out / "valid" / file.name.replace("_normals.", "_valid.")) > 0.5
        turned = np.degrees(np.arccos(np.clip((picture(file) * truth).sum(axis=-1), -1, 1)))
        shares.append(float(valid[ball].mean()))
        errors.append(float(turned[valid & ball].mean()))
    return min(shares), float(np.mean(errors))


@pytest.fixture(scope="module")
def at_its_best(tmp_path_factory: pytest.TempPathFactory) -> tuple[float, float]:
    return solved(film(tmp_path_factory.mktemp("best")))


@pytest.mark.parametrize(
    ("shutter", "readout"), [(180.0, 0.01), pytest.param(90.0, 0.01, marks=pytest.mark.campaign), (90.0, 0.0025)]
)
def test_below_360_degrees_a_standing_ball_loses_nothing(
    shutter: float, readout: float, tmp_path: Path, at_its_best: tuple[float, float]
) -> None:
    """Read out quickly, half of the flashes fall between two exposures of all rows: no frame sees any of them."""
    share, error_deg = solved(film(tmp_path, shutter=shutter, readout=readout), "--aov", "age")
    assert share > at_its_best[0] - 0.02
    assert error_deg < 1.2 * at_its_best[1]
    ages = [picture(file).max() for file in sorted((tmp_path / "out" / "age").iterdir())]
    assert 0.01 < max(ages) < 0.3  # rows come from other rounds, of about 0.03 s each, and say so


def test_room_light_without_a_dark_slot_costs_hardly_more_than_with_one(tmp_path: Path) -> None:
    """Its photon noise is there either way."""
    for name in ("with", "without"):
        (tmp_path / name).mkdir()
    best_share, best_deg = solved(film(tmp_path / "with", ambient=0.03, frames=90))
    tmp_path /= "without"
    share, error_deg = solved(film(tmp_path, marker=False, ambient=0.03, frames=90))
    assert share > best_share - 0.02
    assert error_deg < 1.2 * best_deg
    report = json.loads((tmp_path / "out" / "report.json").read_text(encoding="utf-8"))
    said = next(one for one in report["judgements"] if one["subject"] == "ambient")
    assert said["grade"] == "good", said
    assert "without a dark slot" in said["found"]
