"""Depth that is known from elsewhere: near lights find the surface there, and integrated depth its scale."""

import re
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import OpenEXR
import pytest
from numpy.typing import NDArray

from psvideo.cli.app import main
from psvideo.clip import open_depth
from psvideo.errors import PsvideoError
from psvideo.model.irradiance.ground import ground_of
from psvideo.model.rig import Light, Rig
from psvideo.solve.depth import View, depth_of_height, integrate

ROWS, COLS, FOCAL_PX = 60, 80, 120.0
CENTRE, RADIUS_M = np.array([0.02, 0.0, -0.85]), 0.2
SCENE = f"""schema = "psvideo-scene/1"
name = "near"
frames = 20
seed = 3
[camera]
width_px = {COLS}
height_px = {ROWS}
fps = 100
shutter_deg = 360.0
readout_s = 0.01
view = "perspective"
focal_px = {FOCAL_PX}
bits = 16
full_well_e = 1000000.0
read_e = 1.0
[strobe]
flash_s = 0.001
[[object]]
mesh = "sphere"
height_m = {2 * RADIUS_M}
position_m = {CENTRE.tolist()}
albedo = 0.8
"""
for number, position_m in enumerate([[-0.45, 0.25, -0.1], [0.45, 0.3, -0.05], [0.1, -0.5, -0.1], [0.0, 0.1, 0.1]]):
    SCENE += f'[[light]]\nname = "led{number}"\nposition_m = {position_m}\nintensity = 0.35\n'


def true_depth() -> NDArray[np.float32]:
    """Where each pixel's ray meets the ball; 0 beside it."""
    v, u = np.mgrid[:ROWS, :COLS].astype(float)
    ray = np.stack([(u - (COLS - 1) / 2) / FOCAL_PX, -(v - (ROWS - 1) / 2) / FOCAL_PX, -np.ones_like(u)], axis=-1)
    a, b = (ray * ray).sum(axis=-1), ray @ CENTRE
    root = b * b - a * (CENTRE @ CENTRE - RADIUS_M**2)
    return np.where(root > 0, (b - np.sqrt(np.maximum(root, 0))) / a, 0).astype(np.float32)


def write_exr(path: Path, channels: dict[str, NDArray[np.float32]]) -> Path:
    path.parent.mkdir(exist_ok=True)
    OpenEXR.File({"type": OpenEXR.scanlineimage}, {n: np.ascontiguousarray(c) for n, c in channels.items()}).write(
        str(path)
    )
    return path


def picture(path: Path) -> NDArray[np.float32]:
    channels = OpenEXR.File(str(path)).channels()
    planes = channels["RGB"].pixels if "RGB" in channels else next(iter(channels.values())).pixels
    values: NDArray[np.float32] = planes.astype(np.float32)
    return values


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("known")
    (folder / "scene.toml").write_text(SCENE)
    assert main(["synth", str(folder / "scene.toml"), "-o", str(folder / "clip"), "-q"]) == 0
    return folder / "clip"


def run(clip: Path, out: Path, *more: str) -> int:
    return main(["normals", str(clip), "--rig", str(clip / "rig.toml"), "-o", str(out), "-q", *more])


def error_deg(clip: Path, out: Path) -> float:
    """Mean error on the ball, away from its rim."""
    found = picture(next((out / "normals").iterdir()))
    true, inside = picture(clip / "truth" / "normals.exr"), picture(clip / "truth" / "mask.exr") > 0.5
    inside &= true[..., 2] > 0.5
    valid = (np.abs(found).sum(axis=-1) > 0) & inside
    assert valid.sum() > 0.8 * inside.sum()
    apart = np.linalg.norm(found - true, axis=-1)[valid]
    return float(np.degrees(2 * np.arcsin(np.minimum(apart / 2, 1))).mean())


def test_true_depth_takes_the_plane_s_place_and_gives_depth_its_metres(clip: Path, tmp_path: Path) -> None:
    path = write_exr(tmp_path / "scan.exr", {"Z": true_depth()})
    assert run(clip, tmp_path / "known", "--depth", str(path), "--aov", "depth") == 0
    rig, planes = re.subn(r"^plane = .*$", "plane = [0.0, 0.0, 1.0, 0.70]", (clip / "rig.toml").read_text(), flags=re.M)
    assert planes == 1
    with_plane = tmp_path / "rig.toml"
    with_plane.write_text(rig)
    command = ["normals", str(clip), "--rig", str(with_plane), "-q"]
    assert main([*command, "-o", str(tmp_path / "plane"), "--near-iterations", "0"]) == 0
    assert main([*command, "-o", str(tmp_path / "shaped")]) == 0
    known, plane, shaped = (error_deg(clip, tmp_path / name) for name in ("known", "plane", "shaped"))
    assert plane > 0.5
    assert known < 0.15  # what noise and the mesh's facets leave
    assert known < 0.5 * shaped
    assert "the depth that was given" in (tmp_path / "known" / "report.json").read_text()
    depth, true = picture(next((tmp_path / "known" / "depth").iterdir())), true_depth()
    both = (depth > 0) & (true > 0)
    assert np.median(np.abs(depth - true)[both]) < 2e-3
    assert abs(np.median((depth - true)[both])) < 5e-4


def test_a_folder_gives_every_instant_its_own_depth(clip: Path, tmp_path: Path) -> None:
    for number, factor in ((1001, 1.0), (1002, 1.0), (1003, 1.02), (1004, 1.04)):
        write_exr(tmp_path / "scan" / f"scan.{number}.exr", {"Z": factor * true_depth()})
    assert run(clip, tmp_path / "out", "--depth", str(tmp_path / "scan"), "--aov", "depth") == 0
    written = sorted((tmp_path / "out" / "depth").iterdir())
    assert len(written) >= 2
    for path in written:
        true = picture(tmp_path / "scan" / f"scan.{path.name.split('.')[1]}.exr")
        both = (picture(path) > 0) & (true > 0)
        assert abs(np.median((picture(path) - true)[both])) < 1e-3


def test_a_folder_without_an_instant_s_depth_is_refused(
    clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_exr(tmp_path / "scan" / "scan.0001.exr", {"Z": true_depth()})
    assert run(clip, tmp_path / "out", "--depth", str(tmp_path / "scan")) == 1
    said = " ".join(capsys.readouterr().err.split())
    assert "numbered 1 to 1" in said
    assert not (tmp_path / "out").exists()


def test_a_16_bit_png_is_millimetres_unless_said_otherwise(tmp_path: Path) -> None:
    codes = (true_depth() * 1000 + 0.5).astype(np.uint16)
    codes[0, :5] = 65535
    cv2.imwrite(str(tmp_path / "scan.png"), codes)
    read = open_depth(tmp_path / "scan.png", width_px=COLS, height_px=ROWS).at(7)
    assert np.abs(read - true_depth()).max() < 6e-4
    assert not read[0, :5].any()
    tenths = open_depth(tmp_path / "scan.png", width_px=COLS, height_px=ROWS, metres_per_unit=1e-4).at(7)
    assert np.allclose(tenths, read / 10)


@pytest.mark.parametrize(
    "channels",
    [
        {"Y": 1.0},
        {"V": 1.0},
        {"R": 1.0, "G": 1.0, "B": 1.0},
        {"Layer.Depth.Z": 1.0, "Layer.Normal.X": 0.0, "Layer.Normal.Y": 0.1, "Layer.Normal.Z": 0.9, "Layer.R": 3.0},
    ],
    ids=["Y", "V", "grey in three channels", "layers of a renderer"],
)
def test_depth_is_found_among_channels_and_what_is_no_distance_is_unknown(
    channels: dict[str, float], tmp_path: Path
) -> None:
    depth = true_depth()
    depth[:4] = np.array([np.nan, np.inf, 1e10, -1.0])[:, None]
    planes = {name: np.where(value == 1.0, depth, value).astype(np.float32) for name, value in channels.items()}
    if "G" in planes:
        planes = {name: np.nan_to_num(plane) for name, plane in planes.items()}
    read = open_depth(write_exr(tmp_path / "a.exr", planes), width_px=COLS, height_px=ROWS).at(1)
    assert np.array_equal(read[4:], true_depth()[4:])
    assert not read[:4].any()


@pytest.mark.parametrize(
    ("channels", "words"),
    [
        ({"Z": np.zeros((ROWS, COLS))}, "no depth above 0"),
        ({"Z": -true_depth()}, "Negative ones are there"),
        ({"Z": np.full((ROWS, COLS), np.nan)}, "no depth above 0"),
        ({"Z": true_depth() * 1000}, "`depth_scale=0.001`"),
        ({"Z": true_depth()[:-1]}, "80 x 59 pixels, and the frames are 80 x 60"),
        ({"R": true_depth(), "G": true_depth() + 1, "B": true_depth()}, "in colour"),
        ({"A": true_depth()}, "not clear which channel"),
    ],
    ids=["empty", "negative", "nan", "millimetres", "size", "colour", "alpha only"],
)
def test_depth_that_cannot_be_meant_is_refused_in_a_paragraph(
    channels: dict[str, NDArray[np.float64]], words: str, tmp_path: Path
) -> None:
    path = write_exr(tmp_path / "a.exr", {name: plane.astype(np.float32) for name, plane in channels.items()})
    with pytest.raises(PsvideoError, match=words) as caught:
        open_depth(path, width_px=COLS, height_px=ROWS)
    assert str(path) in str(caught.value)


def test_depth_in_a_later_part_goes_before_the_colours_of_the_first(tmp_path: Path) -> None:
    colour = {name: np.full((ROWS, COLS), 0.5, np.float32) for name in "RGB"}
    parts = [OpenEXR.Part({}, colour, "beauty"), OpenEXR.Part({}, {"depth.Z": true_depth()}, "depth")]
    OpenEXR.File(parts).write(str(tmp_path / "scan.exr"))
    found = open_depth(tmp_path / "scan.exr", width_px=COLS, height_px=ROWS).first
    assert np.array_equal(found, true_depth())


def test_other_files_are_refused(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "eight.png"), np.full((ROWS, COLS), 100, np.uint8))
    (tmp_path / "text.exr").write_text("no picture")
    (tmp_path / "a.npy").write_bytes(b"")
    for name, words in {
        "eight.png": "8 bits",
        "text.exr": "cannot be read as OpenEXR",
        "a.npy": "is not a picture that can hold depth",
        "b.exr": "there is no such depth file",
    }.items():
        with pytest.raises(PsvideoError, match=words):
            open_depth(tmp_path / name, width_px=COLS, height_px=ROWS)


def test_depth_for_nothing_and_scales_for_nothing_are_refused(
    clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write_exr(tmp_path / "scan.exr", {"Z": true_depth()})
    lights = 'schema = "psvideo-rig/1"\n[camera]\nfocal_px = [120.0, 120.0]\n'
    for number, way in enumerate([(0.5, 0, 0.8), (-0.5, 0, 0.8), (0, 0.5, 0.8), (0, -0.4, 0.9)]):
        unit = np.array(way) / np.linalg.norm(way)
        lights += f'[[light]]\nname = "led{number}"\ndirection = {unit.tolist()}\n'
    (tmp_path / "distant.toml").write_text(lights)
    command = ["normals", str(clip), "--rig", str(tmp_path / "distant.toml"), "-o", str(tmp_path / "out"), "-q"]
    assert main([*command, "--depth", str(path)]) == 2
    assert "nothing would use it" in " ".join(capsys.readouterr().err.split())
    assert main([*command, "--depth-scale", "0.001"]) == 2
    assert "give that as well" in " ".join(capsys.readouterr().err.split())
    assert main([*command, "--near-iterations", "2"]) == 2
    assert "--near-iterations 2: nothing would use it" in " ".join(capsys.readouterr().err.split())
    (tmp_path / "distant.toml").write_text(lights.replace("[camera]\nfocal_px = [120.0, 120.0]\n", ""))
    assert main([*command, "--depth", str(path), "--aov", "depth"]) == 1
    assert "focal_px" in capsys.readouterr().err


def test_unknown_pixels_take_the_plane_or_the_nearest_known_depth() -> None:
    known = np.zeros((40, 60), np.float32)
    known[10:20, 10:20], known[30:35, 50:55] = 1.5, 2.0
    light = Light(name="a", position_m=(0.5, 0.5, -0.5))
    camera: dict[str, Any] = {"focal_px": (100.0, 100.0), "principal_px": (29.5, 19.5)}
    alone = ground_of(Rig(lights=(light,), **camera), height_px=40, width_px=60, known_m=known).depth_m
    assert set(np.unique(alone)) == {np.float32(1.5), np.float32(2.0)}
    assert alone[0, 0] == np.float32(1.5)
    assert alone[39, 59] == np.float32(2.0)
    on_plane = Rig(lights=(light,), **camera, plane=(0.0, 0.0, 1.0, 3.0))
    depth = ground_of(on_plane, height_px=40, width_px=60, known_m=known).depth_m
    assert np.array_equal(depth, np.where(known > 0, known, np.float32(3.0)))


def test_parts_of_unknown_depth_stand_at_the_middle_of_what_is_known() -> None:
    view = View(focal_px=(100.0, 100.0))
    normals = np.zeros((40, 60, 3))
    normals[..., 2] = 1
    mask = np.zeros((40, 60), np.bool_)
    mask[5:30, 5:25] = mask[5:30, 35:55] = True
    known = np.zeros((40, 60), np.float32)
    known[:, :30] = 1.5
    found = depth_of_height(integrate(normals, mask, view), view, known_m=known)
    assert found.metric
    assert np.allclose(found.depth[mask], 1.5)
