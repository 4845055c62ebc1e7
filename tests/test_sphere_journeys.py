"""Lights calibrated on spheres in strobed clips, and normals solved with the rigs that came out of it."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from angles import angles_deg

from psvideo.calibrate.mirror.sighting import Sighting
from psvideo.calibrate.sphere.outline import given_outline
from psvideo.calibrate.sphere.sphere_view import SphereView
from psvideo.cli.app import main
from psvideo.formats.rig_toml import read_rig
from psvideo.runs.photographs.still_rig import plane_of

SCENE = Path(__file__).resolve().parents[1] / "data_synth" / "sphere.toml"
MATTE = '[[object]]\nmesh = "sphere"\nalbedo = 0.8\n'
WALL = '[[object]]\nmesh = "plane"\nscale = 3\nposition_m = [0, 0, -0.8]\nalbedo = 0.35\ncasts_shadow = false\n'
CHROME = '[[object]]\nmesh = "sphere"\nalbedo = 0.02\nspecular = { strength = 0.2, roughness = 0.13 }\n\n' + WALL


@pytest.fixture(scope="module")
def subject(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A rolling-shutter clip of a matte sphere under three strobed lights."""
    return shot(tmp_path_factory.mktemp("subject"), SCENE.read_text())


def shot(folder: Path, scene: str) -> Path:
    (folder / "scene.toml").write_text(scene)
    assert main(["synth", str(folder / "scene.toml"), "-o", str(folder / "clip"), "-q"]) == 0
    return folder / "clip"


def pixels(path: Path) -> np.ndarray:
    channels = OpenEXR.File(str(path)).channels()
    picture: np.ndarray = (channels["RGB"] if "RGB" in channels else next(iter(channels.values()))).pixels
    return picture.astype(np.float64)


def errors_of(rig: Path, truth: Path) -> tuple[np.ndarray, np.ndarray]:
    found = {light.name: light for light in read_rig(rig).lights}
    true = read_rig(truth).lights
    assert set(found) == {light.name for light in true}
    cosine = [np.dot(np.array(found[light.name].direction), np.array(light.direction)) for light in true]
    return np.degrees(np.arccos(np.clip(cosine, -1, 1))), np.array([found[light.name].error_deg for light in true])


def normals_error(subject: Path, rig: Path, out: Path) -> float:
    assert main(["normals", str(subject), "--rig", str(rig), "-o", str(out), "-q"]) == 0
    file = sorted((out / "normals").iterdir())[0]
    found, true = pixels(file), pixels(subject / "truth" / "normals.exr")
    valid = pixels(out / "valid" / file.name.replace("normals", "valid")) > 0
    where = valid & (pixels(subject / "truth" / "mask.exr") > 0.5)
    assert where.mean() > 0.1
    return float(angles_deg(found, true)[where].mean())


def test_a_chrome_ball_in_a_strobed_clip_shows_the_lights_with_which_normals_come_out_right(
    subject: Path, tmp_path: Path
) -> None:
    ball, rig = shot(tmp_path, SCENE.read_text().replace(MATTE, CHROME)), tmp_path / "rig.toml"
    assert main(["calibrate", "mirror-sphere", str(ball), "-o", str(rig), "-q"]) == 0
    errors, own = errors_of(rig, ball / "rig.toml")
    assert errors.max() < 0.6
    assert (errors < 2 * own).all()
    assert normals_error(subject, rig, tmp_path / "out") < 1.0


def test_a_matte_ball_in_a_strobed_clip_shows_directions_and_strengths(subject: Path, tmp_path: Path) -> None:
    rig = tmp_path / "rig.toml"
    words = ["calibrate", "matte-sphere", str(subject), "-o", str(rig), "--albedo", "0.8", "-q"]
    assert main(words) == 0
    errors, own = errors_of(rig, subject / "rig.toml")
    assert errors.max() < 1.0
    assert (errors < 2.5 * own).all()
    true = {light.name: light.intensity[0] for light in read_rig(subject / "rig.toml").lights}
    for light in read_rig(rig).lights:
        assert np.mean(light.intensity) == pytest.approx(true[light.name], rel=0.03)
    assert normals_error(subject, rig, tmp_path / "out") < 1.5


NEAR = {"left": (-0.6, 0.15, -0.1), "right": (0.5, 0.25, -0.05), "low": (0.05, -0.5, 0.1)}
PERSPECTIVE = """schema = "psvideo-scene/1"
name = "near"
frames = 9
seed = 3
[camera]
width_px = 360
height_px = 160
fps = 100
shutter_deg = 360.0
readout_s = 0.01
view = "perspective"
focal_px = 500.0
[strobe]
flash_s = 0.001
"""


@pytest.mark.parametrize("off_deg", [0, 15, 30])
def test_the_surface_is_as_far_as_the_sphere_wherever_in_the_picture_it_stands(off_deg: float) -> None:
    """Rays along the rim of a ball whose middle is 0.8 m deep, seen by a pinhole."""
    view, radius_m = SphereView(focal_px=1000.0, principal_px=(999.5, 749.5)), 0.02
    middle = 0.8 * np.array([np.tan(np.radians(off_deg)), 0.1, -1.0])
    away_m = np.linalg.norm(middle)
    axis = middle / away_m
    across = np.cross(axis, [0, 1, 0]) / np.linalg.norm(np.cross(axis, [0, 1, 0]))
    turn = np.linspace(0, 2 * np.pi, 100)[:, None]
    rim = axis + np.tan(np.arcsin(radius_m / away_m)) * (np.cos(turn) * across + np.sin(turn) * np.cross(axis, across))
    place = view.through(view.project(rim))
    assert place is not None
    outline = replace(given_outline(view, (0, 0, 1)), place=place)
    seen = Sighting(where="ball", outline=outline, highlights=(), picture=np.zeros((2, 2), np.float32), sets=1)
    assert plane_of([seen], radius_m) == pytest.approx((0, 0, 1, 0.8), rel=1e-4)


def test_two_chrome_balls_in_a_strobed_clip_show_where_near_lights_are(tmp_path: Path) -> None:
    lights = "".join(
        f'[[light]]\nname = "{name}"\nposition_m = {list(place)}\nintensity = 0.4\n' for name, place in NEAR.items()
    )
    balls = "".join(
        f'[[object]]\nmesh = "sphere"\nheight_m = 0.16\nposition_m = {place}\nalbedo = 0.02\n'
        "specular = { strength = 0.2, roughness = 0.1 }\n"
        for place in ([-0.14, 0.0, -0.7], [0.14, 0.01, -0.68])
    )
    wall = '[[object]]\nmesh = "plane"\nscale = 2\nposition_m = [0, 0, -0.95]\nalbedo = 0.5\ncasts_shadow = false\n'
    clip, rig = shot(tmp_path, PERSPECTIVE + lights + balls + wall), tmp_path / "rig.toml"
    words = ["calibrate", "mirror-sphere", str(clip), "-o", str(rig), "-q"]
    assert main([*words, "--spheres", "2", "--radius-mm", "80", "--focal-px", "500"]) == 0
    found = {light.name: light.position_m for light in read_rig(rig).lights}
    assert set(found) == set(NEAR)
    for name, place in NEAR.items():
        assert np.linalg.norm(np.subtract(np.array(found[name]), place)) < 0.025, name  # 0.021 m at worst, as measured
    assert read_rig(rig).focal_px == (500.0, 500.0)
    subject = '[[object]]\nmesh = "sphere"\nheight_m = 0.16\nposition_m = [0.0, 0.0, -0.77]\nalbedo = 0.6\n'
    (tmp_path / "subject").mkdir()
    matte, photos = shot(tmp_path / "subject", PERSPECTIVE + lights + subject), tmp_path / "photos"
    assert main(["split", str(matte), "-o", str(tmp_path / "plates"), "-q"]) == 0
    photos.mkdir()
    for name in NEAR:
        shutil.copy(next((tmp_path / "plates" / name).iterdir()), photos / f"{name}.exr")
    words = ["stills", str(photos), "--sphere", str(clip), "--spheres", "2", "--focal-px", "500", "--radius-mm", "80"]
    assert main([*words, "-o", str(tmp_path / "out"), "-q"]) == 0
    normals, true = pixels(next((tmp_path / "out" / "normals").iterdir())), pixels(matte / "truth" / "normals.exr")
    inside = (pixels(matte / "truth" / "mask.exr") > 0.5) & (true[..., 2] > 0.5)
    errors = np.degrees(np.arccos(np.clip((normals * true).sum(axis=-1), -1, 1)))[inside]
    assert np.median(errors) < 4
