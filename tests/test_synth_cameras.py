"""Several virtual cameras before one scene and one strobe: the same flashes of the same things, on several clocks."""

import json
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from psvideo.cli.app import main
from psvideo.errors import PsvideoError, UsageError
from psvideo.synth.shoot import shoot

SCENE = """
schema = "psvideo-scene/1"
name = "ball"
frames = 24
[camera]
name = "A"
width_px = 40
height_px = 30
fps = 100
shutter_deg = 360.0
readout_s = 0.008
width_m = 2.0
[[other_camera]]
name = "B"
starts_s = 0.05
clock_offset_ppm = -20.0
[[other_camera]]
name = "C"
fps = 125
exposure_s = 0.007
readout_s = -0.006
starts_s = -0.04
beside_m = [0.25, 0.0, 0.0]
dropped = [5]
[strobe]
flash_s = 0.001
dark_s = 0.0102
clock_offset_ppm = 60.0
drift_ppm_per_s = 8.0
[[light]]
name = "key"
direction = [0.3, 0.3, 0.9]
[[light]]
name = "left"
direction = [-0.4, 0.1, 0.9]
[[object]]
mesh = "sphere"
albedo = { pattern = "checker", colour = 0.8, second = 0.3, size_m = 0.3 }
motion = { spin_deg_per_s = 90.0 }
"""
PPM = {"A": 60.0, "B": -20.0, "C": 60.0}


@pytest.fixture(scope="module")
def clips(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("cameras")
    scene = folder / "scene.toml"
    scene.write_text(SCENE)
    for name in PPM:
        assert main(["synth", str(scene), "--camera", name, "-o", str(folder / name), "-q"]) == 0
    return {name: folder / name for name in PPM}


def flashes(clip: Path, ppm: float) -> dict[int, dict[str, object]]:
    """Return a clip's true flashes by the strobe's microseconds since the cycle of its phase began."""
    phase_s = json.loads((clip / "truth" / "scene.json").read_text())["phase_s"]
    found = {}
    for flash in json.loads((clip / "truth" / "timing.json").read_text())["flashes"]:
        strobe_s = (flash["start_s"] - phase_s) / (1 + 1e-6 * ppm)
        strobe_s -= 0.5e-6 * 8.0 * strobe_s**2
        found[round(1e6 * strobe_s)] = flash
    return found


def plate(clip: Path, flash: dict[str, object]) -> np.ndarray:
    with OpenEXR.File(str(clip / "truth" / str(flash["plate"]))) as file:
        return np.asarray(file.channels()["RGB"].pixels)


@pytest.mark.parametrize("name", ["B", "C"])
def test_cameras_see_the_same_flashes_of_the_same_lights(clips: dict[str, Path], name: str) -> None:
    one, other = (flashes(clips[camera], PPM[camera]) for camera in ("A", name))
    shared = sorted(set(one) & set(other))
    assert len(shared) > 8
    assert [one[at]["light"] for at in shared] == [other[at]["light"] for at in shared]
    assert shared == [at for at in sorted(one) if min(other) <= at <= max(other)]


def test_a_later_clip_shows_things_as_they_have_moved_by_then(clips: dict[str, Path]) -> None:
    one, other = (flashes(clips[camera], PPM[camera]) for camera in "AB")
    both = [at for at in set(one) & set(other) if one[at].get("plate") and other[at].get("plate")]
    same = [np.abs(plate(clips["A"], one[at]) - plate(clips["B"], other[at])).max() for at in both]
    first, last = (plate(clips["A"], one[at]) for at in (min(both), max(both)))
    assert max(same) < 0.01 < np.abs(first - last).max()


def test_a_camera_that_stands_beside_the_first_sees_things_on_the_other_side(clips: dict[str, Path]) -> None:
    one, other = (flashes(clips[camera], PPM[camera]) for camera in "AC")
    at = next(at for at in set(one) & set(other) if one[at].get("plate") and other[at].get("plate"))
    first, beside = plate(clips["A"], one[at]), plate(clips["C"], other[at])
    assert np.allclose(first[:, 5:], beside[:, :-5], atol=1e-3)  # 0.25 m of 2 m that 40 px are wide


def test_a_camera_differs_in_what_its_table_says(clips: dict[str, Path]) -> None:
    plan = (clips["C"] / "plan.toml").read_text()
    assert 'name = "C"' in plan
    assert "readout_s = -0.006" in plan
    assert len(list((clips["C"] / "frames").iterdir())) == 23


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("dark_s = 0.0102", "", "strobe.dark_s is left out"),
        ("dark_s = 0.0102", "dark_s = 0.0102\njitter_s = 1e-6", "strobe.jitter_s is drawn anew .*expected 0"),
        ("dark_s = 0.0102", 'dark_s = 0.0102\nmode = "half-rate"', "strobe.mode is 'half-rate'"),
        ("exposure_s = 0.007", "exposure_s = 0.07", "other_camera 'C': exposure_s is 0.07, longer than the frame"),
        ("dropped = [5]", "dropped = [500]", "other_camera 'C': output.dropped names frame 500"),
        ("dropped = [5]", "droped = [5]", r"unknown key 'other_camera\[2\].droped'.*dropped"),
    ],
)
def test_what_cannot_be_filmed_is_one_paragraph(tmp_path: Path, old: str, new: str, message: str) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE.replace(old, new))
    with pytest.raises(PsvideoError, match=message) as fault:
        shoot(scene, tmp_path / "clip", camera="C")
    assert "\n" not in str(fault.value)
    assert not (tmp_path / "clip").exists()


@pytest.mark.parametrize(
    ("claimed", "said"), [("0.0079", "readout_s = -0.006"), ('"unknown"', 'readout_s = "unknown"')]
)
def test_what_the_plan_claims_of_the_first_camera_is_not_said_of_one_with_figures_of_its_own(
    tmp_path: Path, claimed: str, said: str
) -> None:
    """A camera of 25 frames a second had a plan that said 120, and the first one's readout."""
    scene, claims = tmp_path / "scene.toml", f"[plan]\nfps = 99\nreadout_s = {claimed}\n"
    scene.write_text(SCENE.replace("frames = 24", "frames = 2").replace("dropped = [5]", "") + claims)
    plans = {}
    for name in ("B", "C"):
        shoot(scene, tmp_path / name, camera=name)
        plans[name] = (tmp_path / name / "plan.toml").read_text()
    assert "fps = 99" in plans["B"]
    assert f"readout_s = {claimed}" in plans["B"]
    assert "fps = 125" in plans["C"]
    assert said in plans["C"]


def test_a_camera_that_the_scene_does_not_have_is_named_with_those_it_has(tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE)
    with pytest.raises(UsageError, match=r"has no camera 'D'; expected one of: A, B, C\."):
        shoot(scene, tmp_path / "clip", camera="D")
