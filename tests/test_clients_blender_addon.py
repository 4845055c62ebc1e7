"""The add-on for Blender brings results in as a card and as a mesh: rendered, they are the light of the shoot's lamps.

What needs no Blender is always tested; the rest where `make blender` has installed bpy (see test_clients_blender).
"""

import importlib.util
import io
import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import OpenEXR
import pytest
import tomlkit
from numpy.typing import NDArray

from psvideo.cli.app import main
from psvideo.export.programs.blender_addon import ADDON_FILE, addon_folder, addon_zip
from psvideo.formats.rig_toml import read_rig

ROOT = Path(__file__).resolve().parents[1]
IMPORT = ROOT / "tests" / "clients" / "blender_import.py"
PYTHON = Path(os.environ.get("PSVIDEO_BPY_PYTHON", ROOT / ".venv-blender" / "bin" / "python"))
RIGHT = 0.005
TURN = [[0.6, 0.0, 0.8], [0.0, 1.0, 0.0], [-0.8, 0.0, 0.6]]
needs_blender = pytest.mark.skipif(not PYTHON.is_file(), reason="Blender's bpy is not installed: make blender does")


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("addon")
    assert main(["synth", str(ROOT / "data_synth" / "sphere.toml"), "-o", str(folder / "clip"), "-q"]) == 0
    (folder / "camera.txt").write_text("\n".join(" ".join(map(str, row)) for row in TURN), encoding="utf-8")
    rig = tomlkit.parse((folder / "clip" / "rig.toml").read_text(encoding="utf-8"))
    rig["camera"] = {"focal_px": [4000.0, 3000.0], "principal_px": [89.5, 49.5]}
    (folder / "lens.toml").write_text(tomlkit.dumps(rig), encoding="utf-8")
    return folder / "clip"


def delivered(clip: Path, name: str, *more: str, rig: str = "clip/rig.toml") -> Path:
    out = clip.parent / name
    options = ["--rig", str(clip.parent / rig), "-o", str(out), "--for", "blender", "--frames", "0-14", "-q", *more]
    assert main(["normals", str(clip), *options]) == 0
    return out


@pytest.fixture(scope="module")
def out(clip: Path) -> Path:
    return delivered(clip, "card")


def reading() -> ModuleType:
    spec = importlib.util.spec_from_file_location("addon_reading", addon_folder() / "reading.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["addon_reading"] = module
    spec.loader.exec_module(module)
    return module


def test_the_add_on_lies_beside_a_delivery_for_blender_and_is_the_same_every_time(out: Path) -> None:
    assert (out / ADDON_FILE).read_bytes() == addon_zip()
    names = set(zipfile.ZipFile(io.BytesIO(addon_zip())).namelist())
    assert names == {"__init__.py", "building.py", "reading.py", "blender_manifest.toml"}


def test_the_add_on_knows_what_was_delivered(out: Path, clip: Path) -> None:
    found = reading().read_results(out / "normals" / "clip_normals.1001.exr")
    numbers = [int(file.suffixes[0][1:]) for file in sorted((out / "normals").iterdir())]
    assert (found.first, found.count, found.clip) == (numbers[0], len(numbers), "clip")
    assert found.file("albedo").is_file()
    rig = read_rig(clip / "rig.toml")
    directions = {light.name: np.array(light.direction) for light in rig.lights}
    for light in found.lights:
        assert np.array(light["direction"]) @ directions[light["name"]] == pytest.approx(1.0, abs=1e-6)


def test_results_without_a_word_come_in_under_a_light_of_their_own(out: Path, tmp_path: Path) -> None:
    (tmp_path / "normals").mkdir()
    (tmp_path / "normals" / "take_normals.0007.exr").write_bytes(b"")
    found = reading().read_results(tmp_path)
    assert (found.first, found.space, found.fps, len(found.lights)) == (7, "camera", None, 1)


@pytest.mark.parametrize(
    ("files", "said"),
    [
        ({}, "no folder of psvideo results"),
        ({"normals/x.png": ""}, "holds no <clip>_normals.<number>.exr"),
        ({"normals/a_normals.1.exr": "", "delivery.json": "{"}, "cannot be read"),
        (
            {"normals/a_normals.1.exr": "", "delivery.json": '{"schema": "psvideo-delivery/2"}'},
            "reads psvideo-delivery/1",
        ),
    ],
)
def test_what_is_no_result_is_said(files: dict[str, str], said: str, tmp_path: Path) -> None:
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    module = reading()
    with pytest.raises(module.NotResultsError, match=said):
        module.read_results(tmp_path)


@pytest.fixture(scope="module")
def seen(clip: Path, out: Path) -> dict[str, Any]:
    """What Blender made of a card, and through a lens that squeezes of the same in world space, and of a mesh."""
    world = delivered(clip, "world", "--camera-to-world", str(clip.parent / "camera.txt"), rig="lens.toml")
    mesh = delivered(clip, "mesh", "--mesh", "ply", rig="lens.toml")
    first: int = json.loads((out / "delivery.json").read_text(encoding="utf-8"))["first"]
    wanted = [(out, "CARD", first + 1, "card"), (world, "CARD", first + 1, "world"), (mesh, "MESH", first, "mesh")]
    jobs = [
        {"results": str(of / "delivery.json"), "shape": shape, "frame": frame, "out": str(clip.parent / f"{name}.exr")}
        for of, shape, frame, name in wanted
    ]
    asked = {"addon": str(out / ADDON_FILE), "jobs": jobs, "nothing": str(clip.parent)}
    (clip.parent / "jobs.json").write_text(json.dumps(asked), encoding="utf-8")
    ran = subprocess.run([PYTHON, IMPORT, clip.parent / "jobs.json"], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr + ran.stdout
    found: dict[str, Any] = json.loads(ran.stdout.splitlines()[-1])
    return found


def rendered(clip: Path, name: str) -> NDArray[np.float64]:
    """Return what all suns give together, each rendered by itself."""
    files = sorted(clip.parent.glob(f"{name}.exr.*.exr"))
    assert len(files) == len(read_rig(clip / "rig.toml").lights)
    total: NDArray[np.float64] = np.sum([pixels(file) for file in files], axis=0)
    return total


def pixels(file: Path) -> NDArray[np.float64]:
    channels = OpenEXR.File(str(file), separate_channels=True).channels()
    by_end = {name[-1]: plane.pixels for name, plane in channels.items()}
    return np.stack([by_end[one] for one in ("RGB" if "R" in by_end else "Y")], axis=-1).astype(np.float64)


def expected(clip: Path, out: Path, place: int) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return the light of the shoot's lamps on the surface, albedo * intensity * n . l, and where it is measured."""
    normals, albedo, valid = (pixels(sorted((out / what).iterdir())[place]) for what in ("normals", "albedo", "valid"))
    light = np.zeros_like(albedo)
    for one in read_rig(clip / "rig.toml").lights:
        direction = np.array(one.direction, np.float64)
        direction /= np.linalg.norm(direction)
        light += albedo * np.array(one.intensity) * np.maximum((normals * direction).sum(axis=-1, keepdims=True), 0)
    return light, valid[..., 0] > 0


@needs_blender
@pytest.mark.parametrize("name", ["card", "world"])
def test_a_card_under_the_shoots_suns_is_what_its_plates_add_up_to(
    name: str, clip: Path, out: Path, seen: object
) -> None:
    light, valid = expected(clip, out, place=1)
    error = np.abs(rendered(clip, name) - light)[valid].mean()
    print(f"{name}: {error:.2g}")
    assert error < RIGHT


@needs_blender
def test_a_mesh_bears_the_same_material(clip: Path, out: Path, seen: object) -> None:
    """Its own geometry turns away where the card does not, so that the rim is left out."""
    light, valid = expected(clip, out, place=0)
    front = valid & (pixels(sorted((out / "normals").iterdir())[0])[..., 2] > 0.7)
    assert front.sum() > 500
    error = np.abs(rendered(clip, "mesh") - light)[front].mean()
    print(f"mesh: {error:.2g}")
    assert error < RIGHT


@needs_blender
def test_the_scene_has_lights_camera_rate_and_range(clip: Path, out: Path, seen: dict[str, Any]) -> None:
    said = json.loads((out / "delivery.json").read_text(encoding="utf-8"))
    card = seen["seen"][0]
    assert card["suns"] == [f"clip {light.name}" for light in read_rig(clip / "rig.toml").lights]
    assert card["fps"] == pytest.approx(said["fps"][0] / said["fps"][1], rel=1e-6)
    assert card["frames"] == [said["first"], said["last"]]
    assert [one["pixel_height"] for one in seen["seen"]] == pytest.approx([1, 4 / 3, 4 / 3], rel=1e-6)
    assert "no folder of psvideo results" in seen["refused"]
