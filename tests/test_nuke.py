"""The Nuke script of a delivery, parsed as Nuke reads scripts and evaluated node by node against n . l of the files."""

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from nuke_reader import picture_of, read_script
from numpy.typing import NDArray

from psvideo.cli.app import main
from psvideo.formats.rig_toml import read_rig

SCENES = Path(__file__).resolve().parents[1] / "data_synth"
TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])


@pytest.fixture(scope="module")
def delivered(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    folder = tmp_path_factory.mktemp("nuke")
    assert main(["synth", str(SCENES / "sphere.toml"), "-o", str(folder / "clip"), "-q"]) == 0
    (folder / "camera.txt").write_text("\n".join(" ".join(map(str, row)) for row in TURN), encoding="utf-8")

    def run(name: str, *more: str) -> Path:
        command = ["normals", folder / "clip", "--rig", folder / "clip" / "rig.toml", "-o", folder / name, *more]
        assert main([str(word) for word in (*command, "--for", "nuke", "--no-multipart", "--frames", "0-9", "-q")]) == 0
        return folder / name / "clip.nk"

    run.folder = folder  # type: ignore[attr-defined]
    return run


def pixels(script: Path, what: str, frame: int) -> NDArray[np.float64]:
    file = script.parent / what / f"clip_{what}.{frame:04d}.exr"
    channels = OpenEXR.File(str(file), separate_channels=True).channels()
    return np.stack([channels[c].pixels for c in ("RGB" if "R" in channels else "Y")], axis=-1).astype(np.float64)


@pytest.mark.parametrize(
    "more", [(), ("--y", "down"), ("--camera-to-world", "camera.txt")], ids=["camera", "down", "world"]
)
def test_the_script_gives_the_light_of_the_shoots_own_lamps(
    delivered: Callable[..., Path], more: tuple[str, ...]
) -> None:
    folder = delivered.folder  # type: ignore[attr-defined]
    options = [str(folder / word) if word.endswith(".txt") else word for word in more]
    script = delivered("out" + "".join(more), *options)
    nodes = read_script(script)
    reads = [node for node in nodes if node.kind == "Read"]
    frame = int(reads[0].knobs["first"])
    (viewer,) = [node for node in nodes if node.kind == "Viewer"]
    shown = picture_of(viewer.inputs[0], script, frame)
    normals, albedo, valid = (pixels(script, what, frame) for what in ("normals", "albedo", "valid"))
    expected = np.zeros_like(albedo)
    for light in read_rig(folder / "clip" / "rig.toml").lights:
        direction = np.array(light.direction)
        direction = direction / np.linalg.norm(direction)
        direction = TURN @ direction if len(options) and "camera" in options[0] else direction
        direction = direction * (1, -1, 1) if "down" in options else direction
        shading = np.maximum((normals * direction).sum(axis=-1, keepdims=True), 0)
        expected += albedo * np.array(light.intensity) * shading
    assert expected.max() > 0.1
    assert np.abs(shown[..., :3] - expected).max() < 1e-5
    assert np.array_equal(shown[..., 3:], valid)


def test_a_clip_whose_name_holds_the_first_number_keeps_it(delivered: Callable[..., Path], tmp_path: Path) -> None:
    clip = tmp_path / "shot.1001.v2"
    shutil.copytree(delivered.folder / "clip", clip)  # type: ignore[attr-defined]
    words = [
        "normals",
        clip,
        "--rig",
        clip / "rig.toml",
        "-o",
        tmp_path / "out",
        "--for",
        "nuke",
        "--no-multipart",
        "-q",
    ]
    assert main([*map(str, words), "--frames", "0-9"]) == 0
    reads = [node for node in read_script(tmp_path / "out" / "shot.1001.v2.nk") if node.kind == "Read"]
    assert reads
    for node in reads:
        assert node.knobs["file"].endswith(f'/{node.name}/shot.1001.v2_{node.name}.%04d.exr"')


def test_every_read_stands_on_the_files_that_are_there(delivered: Callable[..., Path]) -> None:
    script = delivered("reads")
    for node in read_script(script):
        if node.kind == "Read":
            folder = script.parent / node.name
            numbers = sorted(int(file.suffixes[0][1:]) for file in folder.iterdir())
            assert (int(node.knobs["first"]), int(node.knobs["last"])) == (numbers[0], numbers[-1])
            assert node.knobs["format"] == '"160 120 0 0 160 120 1 psvideo"'
    (root,) = [node for node in read_script(script) if node.kind == "Root"]
    assert float(root.knobs["fps"]) == pytest.approx(
        float(OpenEXR.File(str(next(folder.iterdir()))).header()["framesPerSecond"])
    )
