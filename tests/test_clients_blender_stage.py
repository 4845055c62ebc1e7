"""The USD stage of a delivery in Blender: what its own importer makes of it, rendered by Cycles under its own lights.

Only where `make blender` has installed bpy (see test_clients_blender).
"""

import json
import os
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
import tomlkit
from numpy.typing import NDArray

from psvideo.cli.app import main
from psvideo.formats.rig_toml import read_rig

ROOT = Path(__file__).resolve().parents[1]
CLIENT = ROOT / "tests" / "clients" / "blender_stage.py"
PYTHON = Path(os.environ.get("PSVIDEO_BPY_PYTHON", ROOT / ".venv-blender" / "bin" / "python"))
RIGHT = 0.005
IMPORTED_SUN = 4.0
"""Blender 5.0's USD importer makes a sun four times as strong as the stage's distant light."""
pytestmark = pytest.mark.skipif(not PYTHON.is_file(), reason="Blender's bpy is not installed: make blender does")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("stage")
    clip = folder / "clip"
    assert main(["synth", str(ROOT / "data_synth" / "sphere.toml"), "-o", str(clip), "-q"]) == 0
    rig = tomlkit.parse((clip / "rig.toml").read_text(encoding="utf-8"))
    rig["camera"] = {"focal_px": [4000.0, 4000.0], "principal_px": [89.5, 49.5]}
    rig["surface"] = {"plane": [0.0, 0.0, 1.0, 2.5]}
    (folder / "rig.toml").write_text(tomlkit.dumps(rig), encoding="utf-8")
    for name, more in {"card": ("--for", "blender"), "mesh": ("--mesh", "usd", "--for", "houdini")}.items():
        words = ["normals", str(clip), "--rig", str(folder / "rig.toml"), "-o", str(folder / name), "-q", *more]
        assert main([*words, "--frames", "0-9"]) == 0
    return folder


@pytest.fixture(scope="module")
def seen(folder: Path) -> dict[str, Any]:
    """What Blender made of the stages of a card and of a mesh."""
    usd, shade = pytest.importorskip("pxr.Usd"), pytest.importorskip("pxr.UsdShade")
    stage = usd.Stage.Open(str(folder / "card" / "clip.usda"))
    shaders = [shade.Shader(prim) for prim in stage.Traverse() if prim.GetTypeName() == "Shader"]
    ids = {str(one.GetShaderId()): [one.GetBaseName() for one in one.GetInputs()] for one in shaders}
    jobs = [
        {"stage": str(folder / name / "clip.usda"), "out": str(folder / name / "seen"), "size": [160, 120]}
        for name in ("card", "mesh")
    ]
    asked = {"jobs": jobs, "ids": {name: inputs for name, inputs in ids.items() if name.startswith("ND_")}}
    (folder / "jobs.json").write_text(json.dumps(asked), encoding="utf-8")
    ran = subprocess.run([PYTHON, CLIENT, folder / "jobs.json"], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr + ran.stdout
    found: dict[str, Any] = json.loads(ran.stdout.splitlines()[-1])
    return found


def pixels(file: Path) -> NDArray[np.float64]:
    channels = OpenEXR.File(str(file), separate_channels=True).channels()
    by_end = {name[-1]: plane.pixels for name, plane in channels.items()}
    return np.stack([by_end[one] for one in ("RGB" if "R" in by_end else "Y")], axis=-1).astype(np.float64)


@pytest.mark.parametrize("name", ["card", "mesh"])
def test_a_stage_under_its_own_lights_is_what_the_plates_were(name: str, folder: Path, seen: dict[str, Any]) -> None:
    """A mesh shades by its own geometry, which turns away at the rim: that is left out."""
    normals, albedo, valid = (pixels(min((folder / name / what).iterdir())) for what in ("normals", "albedo", "valid"))
    front = (valid[..., 0] > 0) & (normals[..., 2] > (0.7 if name == "mesh" else 0.3))
    assert front.sum() > 500
    for light in read_rig(folder / "rig.toml").lights:
        shade = np.maximum(normals @ np.array(light.direction), 0)[..., None]
        shown = pixels(folder / name / f"seen.{light.name}.exr") / IMPORTED_SUN
        error = np.abs(shown - albedo * np.array(light.intensity) * shade)[front].mean()
        print(f"{name} {light.name}: {error:.2g}")
        assert error < RIGHT


def test_the_stage_comes_in_with_lights_camera_places_and_range(folder: Path, seen: dict[str, Any]) -> None:
    card, mesh = seen["seen"]
    rig = read_rig(folder / "rig.toml")
    assert set(card["suns"]) == set(rig.names)
    assert card["suns"]["key"] == pytest.approx(IMPORTED_SUN * np.pi * rig.lights[0].intensity[0], rel=1e-5)
    assert (card["lens"], card["uv"], mesh["uv"]) == ("PERSP", ["st"], ["st"])
    first = min((folder / "card" / "albedo").iterdir()).name
    assert first in card["images"]
    assert card["frames"][0] == int(first.split(".")[1])


def test_materialx_knows_every_node_and_input(seen: dict[str, Any]) -> None:
    assert seen["unknown"] == []
