"""Whole commands on photographs that nobody here made; skipped where the captures are not on the machine."""

import csv
from pathlib import Path

import cv2
import numpy as np
import OpenEXR
import pytest
from picture_file import read_picture

from psvideo.cli.app import main


def run(*arguments: object) -> int:
    return main([str(argument) for argument in arguments])


def planes(path: Path) -> np.ndarray:
    picture: np.ndarray = OpenEXR.File(str(path)).channels()["RGB"].pixels
    return picture.astype(np.float64)


def write_stills_plan(path: Path, *, width_px: int, height_px: int, lights: int) -> None:
    flashes = "".join(f'[[strobe.flash]]\nlights = {{ "L{n}" = 1.0 }}\n' for n in range(lights))
    path.write_text(
        f'schema = "psvideo-plan/1"\n[camera]\nwidth_px = {width_px}\nheight_px = {height_px}\nfps = 1\n'
        f'[strobe]\nmode = "synced"\n{flashes}'
    )


def errors_deg(found: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Return the angles between vectors; atan2, because half floats are not of unit length."""
    cross = np.linalg.norm(np.cross(found, true), axis=-1)
    angles: np.ndarray = np.degrees(np.arctan2(cross, (found * true).sum(axis=-1)))
    return angles


@pytest.mark.parametrize("thing", ["cat", pytest.param("horse", marks=pytest.mark.campaign), "gray"])
def test_the_photographs_of_the_university_of_washington_are_solved(
    thing: str, shared_data: Path, tmp_path: Path
) -> None:
    folder = shared_data / "uw_psm"
    plan = tmp_path / "plan.toml"
    write_stills_plan(plan, width_px=512, height_px=340, lights=12)
    mask = folder / thing / f"{thing}.mask.png"
    out = tmp_path / "out"
    assert (
        run("normals", folder / thing, "--plan", plan, "--rig", folder / "lights.txt", "--mask", mask, "-o", out, "-q")
        == 0
    )
    normals = planes(out / "normals" / f"{thing}_normals.1001.exr")
    inside = read_picture(mask, cv2.IMREAD_GRAYSCALE) > 127
    solved = np.linalg.norm(normals, axis=-1) > 0.5
    assert not solved[~inside].any()
    assert solved[inside].mean() > 0.9  # what is left out lies at the outlines, where fewer than three lights reach
    if thing == "gray":  # a matte sphere: its shape is known; the lights' own errors make most of what is left
        y, x = np.mgrid[0:340, 0:512]
        nx, ny = (x - 244.5) / 108.0, -(y - 144.5) / 108.0
        inner = solved & (nx**2 + ny**2 < 0.95**2)
        true = np.stack([nx, ny, np.sqrt(np.clip(1 - nx**2 - ny**2, 0, 1))], axis=-1)
        assert errors_deg(normals, true)[inner].mean() < 5.3


def test_the_ball_of_48_lights_reaches_the_published_least_squares(shared_data: Path, tmp_path: Path) -> None:
    folder = shared_data / "diligent_ball"
    lights = list(csv.DictReader((folder / "lights.csv").read_text().splitlines()))
    stills = tmp_path / "ball"
    stills.mkdir()
    rig = 'schema = "psvideo-rig/1"\n'
    for number, light in enumerate(lights):
        (stills / f"ball_{number:03d}.png").symlink_to(folder / light["file"])
        direction = np.array([float(light[key]) for key in ("dx", "dy", "dz")])
        direction /= np.linalg.norm(direction)
        strength = [float(light[key]) for key in ("e_r", "e_g", "e_b")]
        rig += f'[[light]]\nname = "L{number}"\ndirection = {direction.tolist()}\nintensity = {strength}\n'
    (tmp_path / "rig.toml").write_text(rig)
    write_stills_plan(stills / "plan.toml", width_px=160, height_px=160, lights=len(lights))
    out = tmp_path / "out"
    mask = folder / "mask.png"
    assert run("normals", stills, "--rig", tmp_path / "rig.toml", "--mask", mask, "-o", out, "-q") == 0
    normals = planes(out / "normals" / "ball_normals.1001.exr")
    true = np.load(folder / "normal_gt.npy")
    inside = read_picture(mask, cv2.IMREAD_GRAYSCALE) > 127
    solved = inside & (np.linalg.norm(normals, axis=-1) > 0.5)
    assert solved.sum() > 0.97 * inside.sum()
    assert errors_deg(normals, true)[solved].mean() <= 4.2


BRIGHTER, USUAL = (2, 8, 11, 14), (34, 50, 75, 76, 77, 89, 92, 94)


def test_photographs_that_are_brighter_than_their_list_says_are_named_and_their_strengths_are_measured(
    shared_data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The bear's first 19 photographs are a quarter brighter than the other 77."""
    folder, stills, rig = shared_data / "diligent_photos" / "bear", tmp_path / "bear", tmp_path / "rig.toml"
    stills.mkdir()
    told = ['schema = "psvideo-rig/1"']
    for light in csv.DictReader((folder / "lights.csv").read_text().splitlines()):
        if int(light["file"][:3]) in BRIGHTER + USUAL:
            (stills / light["file"]).symlink_to(folder / light["file"])
            way, strength = (
                [float(light[key]) for key in keys] for keys in (("dx", "dy", "dz"), ("e_r", "e_g", "e_b"))
            )
            told.append(f'[[light]]\nname = "{light["file"][:3]}"\ndirection = {way}\nintensity = {strength}')
    rig.write_text("\n".join(told))
    true, common = np.load(folder / "normal_gt.npy").astype(np.float64), ("--transfer", "linear")
    inside = read_picture(folder / "mask.png", cv2.IMREAD_GRAYSCALE) > 127

    def solved(rig: Path, out: Path) -> tuple[str, float]:
        words = (stills, "--lights", rig, "--mask", folder / "mask.png", *common, "--no-rti", "-o", out)
        assert run("stills", *words) == 0
        normals = planes(out / "normals" / "bear_normals.1001.exr")
        return capsys.readouterr().err, float(errors_deg(normals, true)[inside].mean())

    said, before_deg = solved(rig, tmp_path / "out")
    assert "with other strengths it would" in said
    assert all(f"'{name:03d}' 1" in said for name in BRIGHTER)
    assert not any(f"'{name:03d}'" in said for name in USUAL)
    assert run("calibrate", "intensities", stills, "--rig", rig, *common, "-o", tmp_path / "measured.toml") == 0
    said, after_deg = solved(tmp_path / "measured.toml", tmp_path / "again")
    assert "other strengths" not in said
    assert after_deg < 0.6 * before_deg < 7


def test_a_real_raw_frame_is_a_clip_of_one_light(shared_data: Path, tmp_path: Path) -> None:
    clip = tmp_path / "chart"
    clip.mkdir()
    (clip / "chart_0001.dng").symlink_to(shared_data / "raw" / "colorchart.dng")
    write_stills_plan(clip / "plan.toml", width_px=1734, height_px=1156, lights=1)
    out = tmp_path / "plates"
    assert run("split", clip, "-o", out, "-q") == 0
    plate = planes(out / "L0" / "chart_L0.1001.exr")
    assert plate.shape == (1156, 1734, 3)
    assert 0.0 < np.median(plate) < 0.5
    assert 0.3 < np.percentile(plate, 99.9) <= 1.0
