"""Blender lights a card by delivered normals as they are; set wrong in the known ways, it does not.

bpy (Blender as a Python module) is about 1 GB and fits one version of Python: `make blender` installs it into an
environment of its own, .venv-blender, and runs these tests. PSVIDEO_BPY_PYTHON names another.
"""

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from ball_delivery import SIZE, ball, deliver

from psvideo.export.space import Space

ROOT = Path(__file__).resolve().parents[1]
RELIGHT = ROOT / "tests" / "clients" / "blender_relight.py"
PYTHON = Path(os.environ.get("PSVIDEO_BPY_PYTHON", ROOT / ".venv-blender" / "bin" / "python"))
LIGHT = np.array([0.4, 0.5, 0.77]) / np.linalg.norm([0.4, 0.5, 0.77])
HALF_TURN_DEG = 40.0
RIGHT, WRONG = 0.005, 0.1
"""Mean error against n.l that right ways stay below, and that wrong ways are above."""

pytestmark = pytest.mark.skipif(not PYTHON.is_file(), reason="Blender's bpy is not installed: make blender installs it")


@pytest.fixture(scope="module")
def lit(tmp_path_factory: pytest.TempPathFactory) -> dict[str, float]:
    """The mean error of every way to load the normals, rendered in one process."""
    folder = tmp_path_factory.mktemp("blender")
    turn = np.radians(HALF_TURN_DEG)
    rotation = np.array([[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]])
    quaternion = [float(np.cos(turn / 2)), 0.0, float(np.sin(turn / 2)), 0.0]
    spaces = {
        "camera": Space(),
        "down": Space(y="down"),
        "world": Space(name="world", camera_to_world=rotation, origin=np.zeros(3)),
    }
    for name, space in spaces.items():
        deliver(folder / name, space, aovs=())

    def job(name: str, at: str = "camera", kind: str = "exr", **more: object) -> dict[str, object]:
        parent = "normals" if kind == "exr" else "normals_png16"
        image = folder / at / parent / f"ball_normals.1001.{'exr' if kind == 'exr' else 'png'}"
        usual = {"frame": 2, "offset": 1000, "colour_space": "", "flip_y": False, "bump_correction": False}
        camera = quaternion if more.pop("turned", False) else [1.0, 0.0, 0.0, 0.0]
        place = {"image": str(image), "kind": kind, "out": str(folder / f"{name}.exr"), "size": [SIZE, SIZE]}
        return {**usual, **place, "light": LIGHT.tolist(), "camera": camera, "space": "camera", "name": name, **more}

    jobs = [
        job("exr"),
        job("exr of a turned camera", turned=True),
        job("exr in world space", at="world", space="world", turned=True),
        job("exr, y down, flipped back", at="down", flip_y=True),
        job("png as data", kind="png", colour_space="Non-Color"),
        job("png in a normal map node", kind="map", colour_space="Non-Color"),
        job("exr in a normal map node", kind="map", image=str(folder / "camera/normals/ball_normals.1001.exr")),
        job("exr as srgb", colour_space="sRGB"),
        job("exr, y down", at="down"),
        job("png as blender takes it", kind="png"),
        job("exr of the wrong frame", offset=1001),
        job("exr with bump correction", bump_correction=True),
    ]
    (folder / "jobs.json").write_text(json.dumps(jobs), encoding="utf-8")
    ran = subprocess.run([PYTHON, RELIGHT, folder / "jobs.json"], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    said = json.loads(ran.stdout.splitlines()[-1])
    errors = {str(one["name"]): mean_error(one, rotation) for one in jobs}
    print(json.dumps({"blender": said[0]["version"], "errors": errors}, indent=1))
    assert said[0]["colour_space"] == "Non-Color" or said[0]["version"] < "5", "the EXR says that it is data"
    return errors


def mean_error(job: dict[str, object], rotation: np.ndarray) -> float:
    channels = OpenEXR.File(str(job["out"]), separate_channels=True).channels()
    rendered = next(plane.pixels for name, plane in channels.items() if name.endswith("R"))
    normals, valid = ball(1002)
    turned = job["camera"] != [1.0, 0.0, 0.0, 0.0]
    facing = (normals @ rotation.T if turned else normals) @ LIGHT
    # a render shows no light on what the card itself turns away from the sun, and this sun is in front of it
    return float(np.abs(rendered - np.maximum(facing, 0))[valid].mean())


RIGHT_WAYS = ["exr", "exr of a turned camera", "exr in world space", "exr, y down, flipped back", "png as data"]
RIGHT_WAYS += ["png in a normal map node"]
WRONG_WAYS = ["exr as srgb", "exr, y down", "png as blender takes it", "exr in a normal map node"]


@pytest.mark.parametrize("way", RIGHT_WAYS)
def test_blender_relights_a_card_by_delivered_normals(way: str, lit: dict[str, float]) -> None:
    assert lit[way] < RIGHT


@pytest.mark.parametrize("way", WRONG_WAYS)
def test_blender_shows_that_a_wrong_way_is_wrong(way: str, lit: dict[str, float]) -> None:
    assert lit[way] > WRONG


def test_frames_are_found_by_their_numbers_and_bump_correction_bends_normals(lit: dict[str, float]) -> None:
    assert lit["exr of the wrong frame"] > 4 * RIGHT
    assert lit["exr with bump correction"] > lit["exr"]
