"""A sensor that saturates below the largest code of its curve: said, with the code to write into the plan."""

import re
import tracemalloc
from pathlib import Path

import cv2
import numpy as np
import pytest
from lit_ball import LIT_BALL
from numpy.typing import NDArray

import psvideo as ps
from psvideo.cli.app import main
from psvideo.clip import read_frames
from psvideo.report.judge.of_saturation import below_black, brightest, hidden_saturation
from psvideo.report.observe.hidden_level import rising_samples
from psvideo.runs.steps.levels import levels_of
from psvideo.runs.steps.saturation import saturation_of
from psvideo.synth.shoot import shoot

WHITE = 52_000
"""The code at which the virtual sensor saturates, of 65,535."""
SCENE = f"""
schema = "psvideo-scene/1"
name = "sphere"
frames = 24
seed = 3
[camera]
width_px = 96
height_px = 72
fps = 100
shutter_deg = 360.0
readout_s = 0.01
width_m = 1.6
transfer = "slog3"
bits = 16
white_level = {WHITE}
full_well_e = 20000.0
read_e = 4.0
[strobe]
flash_s = 0.001
{LIT_BALL}"""


def filmed(folder: Path, *, intensity: float) -> Path:
    """Film the ball; the plan does not say where the sensor saturates."""
    (folder / "scene.toml").write_text(
        SCENE.replace("[[light]]", f"[[light]]\nintensity = {intensity}"), encoding="utf-8"
    )
    shoot(folder / "scene.toml", folder / "clip")
    plan = folder / "clip" / "plan.toml"
    said = plan.read_text(encoding="utf-8")
    assert f"white_level = {WHITE}" in said
    plan.write_text(re.sub(r"white_level = .*\n", "", said), encoding="utf-8")
    return folder / "clip"


def test_a_sensor_that_saturates_where_the_plan_does_not_say_is_named_with_its_code(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    clip = filmed(tmp_path, intensity=1.6)
    assert main(["check", str(clip)]) == 1
    said = " ".join(capsys.readouterr().out.split())
    assert "usable as it is: clipping" in said
    assert "% of the subject is clipped" not in said, "nothing is known of that"
    code = int(re.search(r"Write white_level = (\d+)", said)[1])  # type: ignore[index]
    assert WHITE - 700 < code <= WHITE  # within 0.15 stop, and not above
    assert main(["normals", str(clip), "--rig", str(clip / "rig.toml"), "-o", str(tmp_path / "out")]) == 0
    assert f"white_level = {code}" in " ".join(capsys.readouterr().err.split())
    assert main(["info", str(clip)]) == 0
    assert f"white_level = {code}" in " ".join(capsys.readouterr().out.split())
    plan = clip / "plan.toml"
    plan.write_text(plan.read_text(encoding="utf-8").replace("[camera]", f"[camera]\nwhite_level = {code}", 1))
    main(["check", str(clip)])
    assert "Every light clips" in capsys.readouterr().out


def test_light_that_is_not_clipped_ends_at_no_level(tmp_path: Path) -> None:
    clip = filmed(tmp_path, intensity=0.9)
    assert saturation_of(ps.open_take(clip)) is None


def test_a_white_level_of_other_files_is_named_and_nobody_is_told_to_open_the_aperture(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    clip = filmed(tmp_path, intensity=0.9)
    plan = clip / "plan.toml"
    told = plan.read_text(encoding="utf-8").replace('"slog3"', '"linear"')
    plan.write_text(told.replace("[camera]", f"[camera]\nwhite_level = {WHITE}", 1), encoding="utf-8")
    for frame in clip.rglob("*.png"):
        codes = cv2.imread(str(frame), cv2.IMREAD_UNCHANGED)
        assert codes is not None
        cv2.imwrite(str(frame), (codes // 256).astype(np.uint8))
    assert main(["check", str(clip)]) == 1
    said = " ".join(capsys.readouterr().out.split())
    assert "bad exposure How bright the picture is cannot be said" in said
    assert "these 8-bit files is 255: it was meant for other files" in said
    assert "Write the code at which these saturate" in said
    assert "aperture" not in said
    assert "flash longer" not in said


def test_codes_that_lie_low_in_their_files_are_not_called_dark(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Twelve bits in sixteen, without white_level: "open the aperture by 12 stops", and 59 % passed as valid."""
    clip = filmed(tmp_path, intensity=0.9)
    assert saturation_of(ps.open_take(clip)) is None
    for frame in clip.rglob("*.png"):
        codes = cv2.imread(str(frame), cv2.IMREAD_UNCHANGED)
        assert codes is not None
        cv2.imwrite(str(frame), codes // 16)
    assert main(["check", str(clip)]) == 1
    told = " ".join(capsys.readouterr().out.split())
    assert "Light lies below black" in told
    assert "write white_level = 4095" in told
    assert "aperture" not in told


@pytest.mark.parametrize("seed", range(3))
def test_black_pictures_lie_on_both_sides_of_black(tmp_path: Path, seed: int) -> None:
    clip = ps.open_take(filmed(tmp_path, intensity=0.9)).clip
    noise = np.random.default_rng(seed).normal(0, 1e-4, (6, 60, 80)).astype(np.float32)
    assert below_black(max(map(brightest, noise)), clip) is None
    assert below_black(max(map(brightest, noise - np.float32(1e-3))), clip) is not None
    lit = noise - np.float32(1e-3)
    lit[3, :20] += 0.01  # one frame is lit
    assert below_black(max(map(brightest, lit)), clip) is None


Lit = NDArray[np.float32]


def wall(strengths: tuple[float, ...], noise: float, cut: float) -> list[Lit]:
    """Samples of frames of a flat grey wall that fills the picture, one light each, and a dark one."""
    rng = np.random.default_rng(5)
    levels = 0.1 * np.array([*strengths, 0.0] * 4)[:, None, None]
    seen = np.minimum(levels, cut) * (1 + noise * rng.standard_normal((levels.size, 60, 80)))
    return [rising_samples(np.asarray(one, np.float32)) for one in seen]


def test_a_flat_wall_under_lights_of_its_own_strengths_is_not_clipped(tmp_path: Path) -> None:
    clip = ps.open_take(filmed(tmp_path, intensity=0.5)).clip
    assert hidden_saturation(wall((1.0, 0.9, 0.8), 0.01, 1.0), clip) is None
    assert hidden_saturation(wall((1.0, 0.95, 0.5), 0.01, 1.0), clip) is None
    clipped = hidden_saturation(wall((1.0, 0.9, 0.8), 0.005, 0.075), clip)
    assert clipped is not None
    assert clipped.grade == "bad"


@pytest.mark.parametrize(
    ("old", "new"), [('"slog3"', '"srgb"'), ("[camera]", f"[camera]\nwhite_level = {WHITE}")], ids=["srgb", "named"]
)
def test_nothing_is_looked_for_where_the_plan_or_the_curve_says_it(tmp_path: Path, old: str, new: str) -> None:
    clip = filmed(tmp_path, intensity=1.6)
    assert len(list(read_frames(ps.open_take(clip).clip, (1,)))) == 1
    plan = clip / "plan.toml"
    plan.write_text(plan.read_text(encoding="utf-8").replace(old, new, 1), encoding="utf-8")
    assert saturation_of(ps.open_take(clip)) is None


def test_frames_that_are_looked_at_are_held_in_light_one_at_a_time(tmp_path: Path) -> None:
    """Twelve frames and more, and three for the files' levels, were: 300 MB and 75 at 1080p."""
    take = ps.open_take(filmed(tmp_path, intensity=0.9))
    saturation_of(take)  # loads what it needs
    levels_of(take)
    tracemalloc.start()
    saturation_of(take)
    levels_of(take)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 11 * 96 * 72 * 3 * 4
