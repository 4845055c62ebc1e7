"""Depth, position and meshes as files: what a program that opens them finds is the surface in metres, y up."""

import shutil
import sys
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
import tomlkit
import trimesh

import psvideo as ps
from psvideo.cli.app import main
from psvideo.errors import PsvideoError
from psvideo.export.mesh_files import srgb_codes, write_part, write_ply
from psvideo.export.sequences.planes import InstantPictures
from psvideo.export.space import CAMERA_SPACE, Space
from psvideo.export.usd import require_usd
from psvideo.export.usd.usd_animation import write_animation
from psvideo.runs.steps.output import Output
from psvideo.solve.depth import Mesh

SCENES = Path(__file__).resolve().parents[1] / "data_synth"
TURNED = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])


def triangle(shift: float = 0.0) -> Mesh:
    return Mesh(
        points=np.array([[0.25, 0.5, -1.0], [0.0, 0.0, -1.0], [0.5, 0.0, -1.0 + shift]], np.float32),
        triangles=np.array([[0, 1, 2]], np.int32),
        normals=np.array([[0, 0, 1]] * 3, np.float32),
        colours=np.array([[0.0, 0.18, 1.5]] * 3, np.float32),
        places=np.array([[0.5, 1.0], [0.0, 0.0], [1.0, 0.0]], np.float32),
    )


def test_a_ply_reads_back_with_points_normals_and_srgb_colours(tmp_path: Path) -> None:
    mesh = triangle()
    write_ply(tmp_path / "a.ply", mesh, CAMERA_SPACE)
    read: Any = trimesh.load(tmp_path / "a.ply", process=False)
    assert np.array_equal(read.vertices, mesh.points)
    assert np.array_equal(read.faces, mesh.triangles)
    assert np.allclose(read.vertex_normals, mesh.normals)
    assert read.visual.vertex_colors[0].tolist() == [0, 118, 255, 255]  # 0.18 in linear light is sRGB 118
    assert read.face_normals[0] @ [0, 0, 1] > 0.99  # wound towards the camera


def test_an_instant_of_which_nothing_is_known_is_a_mesh_without_points(tmp_path: Path) -> None:
    mesh, none = triangle(), slice(0, 0)
    write_ply(tmp_path / "a.ply", Mesh(**{name: part[none] for name, part in vars(mesh).items()}), CAMERA_SPACE)
    head, _, rest = (tmp_path / "a.ply").read_bytes().partition(b"end_header\n")
    assert b"element vertex 0\n" in head
    assert b"element face 0\n" in head
    assert rest == b""


def test_srgb_codes_follow_the_standard() -> None:
    linear = np.array([[0.0, 0.0031308, 0.2158605], [0.5, 1.0, 7.0]], np.float32)
    assert srgb_codes(linear)[:, :3].tolist() == [[0, 10, 128], [188, 255, 255]]


def test_meshes_turn_to_the_world_and_are_never_mirrored(tmp_path: Path) -> None:
    write_ply(tmp_path / "a.ply", triangle(), Space(name="world", y="down", camera_to_world=TURNED))
    read: Any = trimesh.load(tmp_path / "a.ply", process=False)
    assert np.allclose(read.vertices, triangle().points @ TURNED.T)
    assert np.allclose(read.face_normals[0], [1, 0, 0])


def test_an_animated_usd_holds_every_instant(tmp_path: Path) -> None:
    usd = pytest.importorskip("pxr.Usd")
    geometry = pytest.importorskip("pxr.UsdGeom")
    parts = {}
    for number in (1001, 1002, 1005):
        parts[number] = tmp_path / f"{number}.part.npz"
        write_part(parts[number], triangle(number - 1001), CAMERA_SPACE)
    write_animation(tmp_path / "mesh" / "a.usdc", parts, Fraction(120_000, 1001) / 5, metric=False)
    assert sorted(path.name for path in (tmp_path / "mesh").iterdir()) == ["a.usdc"]
    stage = usd.Stage.Open(str(tmp_path / "mesh" / "a.usdc"))
    assert geometry.GetStageUpAxis(stage) == "Y"
    assert geometry.GetStageMetersPerUnit(stage) == 1
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (1001, 1005)
    assert stage.GetTimeCodesPerSecond() == pytest.approx(120_000 / 1001 / 5)
    assert stage.GetRootLayer().customLayerData["psvideo:metric"] is False
    mesh = geometry.Mesh(stage.GetDefaultPrim())
    assert mesh.GetPointsAttr().GetTimeSamples() == [1001, 1002, 1005]
    assert np.array_equal(np.array(mesh.GetPointsAttr().Get(1005)), triangle(4.0).points)
    assert list(mesh.GetFaceVertexIndicesAttr().Get(1002)) == [0, 1, 2]
    assert list(mesh.GetFaceVertexCountsAttr().Get(1002)) == [3]
    assert np.allclose(np.array(mesh.GetDisplayColorAttr().Get(1001))[0], [0, 0.18, 1.5])
    assert np.array_equal(np.array(geometry.PrimvarsAPI(mesh).GetPrimvar("st").Get(1002)), triangle().places)
    assert mesh.GetSubdivisionSchemeAttr().Get() == "none"


def test_without_usd_core_one_sentence_says_what_to_do(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(PsvideoError, match=r"usd-core.*`mesh=\[\"ply\"\]`"):
        require_usd()
    assert main(["normals", str(tmp_path), "--rig", "rig.toml", "-o", str(tmp_path / "out"), "--mesh", "usd"]) == 1
    said = capsys.readouterr().err
    assert "usd-core" in said
    assert "--mesh ply" in said


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sphere under strobed light, with a rig that knows the lens and how far away the sphere is."""
    folder = tmp_path_factory.mktemp("shoot") / "clip"
    assert main(["synth", str(SCENES / "sphere.toml"), "-o", str(folder), "-q"]) == 0
    rig = tomlkit.parse((folder / "rig.toml").read_text(encoding="utf-8"))
    rig["camera"] = {"focal_px": [4000.0, 4000.0]}
    rig["surface"] = {"plane": [0.0, 0.0, 1.0, 2.5]}
    (folder.parent / "rig.toml").write_text(tomlkit.dumps(rig), encoding="utf-8")
    return folder


def run(clip: Path, out: Path, *more: str) -> int:
    return main(["normals", str(clip), "--rig", str(clip.parent / "rig.toml"), "-o", str(out), "-q", *more])


def channels(path: Path) -> dict[str, np.ndarray]:
    return {name: c.pixels for name, c in OpenEXR.File(str(path), separate_channels=True).channels().items()}


def test_what_lies_nearer_than_relative_depth_0_has_a_place_in_the_world() -> None:
    """Without a lens depth is relative to the middle: a wall that leans far back passes 0."""
    normals = np.broadcast_to(np.array([0, np.sin(1.0), np.cos(1.0)], np.float32), (96, 40, 3))
    known = np.ones((96, 40), np.bool_)
    known[:, :8] = False
    surface = ps.Surface(normals=normals * known[..., None], albedo=known.astype(np.float32), valid=known)
    depth = ps.find_depth(surface)
    assert (depth.depth < 0).mean() > 0.1
    world = Space(name="world", camera_to_world=TURNED, origin=np.array([1.0, 2.0, 3.0]))
    placed = InstantPictures(surface=surface, space=world, depth=depth).position
    camera = InstantPictures(surface=surface, space=Space(), depth=depth).position
    assert placed is not None
    assert camera is not None
    np.testing.assert_allclose(placed[known], camera[known] @ TURNED.T + [1, 2, 3], atol=1e-5)
    assert not placed[~known].any()


SHAPE = ("--aov", "depth", "--aov", "position", "--mesh", "ply")


def test_depth_and_position_agree_and_are_in_metres(clip: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert run(clip, out, *SHAPE, "--multipart") == 0
    depths = sorted((out / "depth").iterdir())
    assert len(depths) == len(list((out / "normals").iterdir())) == len(list((out / "mesh").iterdir()))
    medians = []
    for path in depths:
        depth, number = channels(path)["Y"], path.name.split(".")[1]
        assert depth.dtype == np.float32
        header = OpenEXR.File(str(path)).header()
        assert header["colorInteropID"] == "data"
        normals = channels(out / "normals" / f"clip_normals.{number}.exr")
        there = sum(np.abs(normals[axis]) for axis in "RGB") > 0.5
        assert not depth[~there].any()
        position = channels(out / "position" / f"clip_position.{number}.exr")
        assert np.array_equal(-position["B"], depth)
        rows, cols = depth.shape
        middle = np.abs(np.arange(cols) - (cols - 1) / 2) / 4000.0
        assert np.allclose(np.abs(position["R"]), middle * depth, atol=1e-6)
        assert position["G"][: rows // 2].min() >= 0  # y is up
        medians.append(float(np.median(depth[depth > 0])))
        mesh: Any = trimesh.load(out / "mesh" / f"clip_mesh.{number}.ply", process=False)
        assert mesh.vertices[:, 2].min() == pytest.approx(-depth.max(), abs=1e-5)
        parts = {part.name(): part for part in OpenEXR.File(str(out / f"clip.{number}.exr")).parts}
        assert np.array_equal(next(iter(parts["depth"].channels.values())).pixels, depth)
    assert medians[0] == pytest.approx(2.5, abs=1e-4)
    assert np.ptp(medians) < 1e-3


def test_position_follows_the_space_that_normals_are_delivered_in(clip: Path, tmp_path: Path) -> None:
    assert run(clip, tmp_path / "up", "--aov", "position", "--frames", "1-20") == 0
    assert run(clip, tmp_path / "down", "--aov", "position", "--y", "down", "--frames", "1-20") == 0
    path = min((tmp_path / "up" / "position").iterdir()).relative_to(tmp_path / "up")
    up, down = channels(tmp_path / "up" / path), channels(tmp_path / "down" / path)
    assert np.array_equal(up["G"], -down["G"])
    assert np.array_equal(up["B"], down["B"])
    (tmp_path / "camera.txt").write_text("0 0 1 10  0 1 0 20  -1 0 0 30  0 0 0 1")
    camera = ("--space", "world", "--camera-to-world", str(tmp_path / "camera.txt"))
    assert run(clip, tmp_path / "world", "--aov", "position", "--mesh", "ply", *camera, "--frames", "1-20") == 0
    world, there = channels(tmp_path / "world" / path), up["B"] != 0
    turned = (up["B"] + 10, up["G"] + 20, 30 - up["R"])
    for name, values in zip("RGB", turned, strict=True):
        assert np.allclose(world[name][there], values[there], atol=1e-5)
        assert not world[name][~there].any()
    mesh: Any = trimesh.load(min((tmp_path / "world" / "mesh").iterdir()), process=False)
    assert mesh.vertices[:, 1].min() >= world["G"][there].min() - 1e-5
    assert mesh.vertices[:, 1].max() <= world["G"][there].max() + 1e-5


def test_a_stopped_run_with_meshes_resumes_to_the_same_files(
    clip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole, out = tmp_path / "whole", tmp_path / "out"
    more = (*SHAPE, *(("--mesh", "usd") if "pxr" in sys.modules else ()))
    assert run(clip, whole, *more) == 0

    def stop(*_: object, **__: object) -> None:
        raise PsvideoError("stopped")

    with monkeypatch.context() as patched:
        patched.setattr("psvideo.runs.instants.results.write_report", stop)
        assert run(clip, out, *more) == 1
    assert not out.exists()
    shutil.rmtree(tmp_path / ".out.partial" / "depth")
    assert run(clip, out, *more, "--resume") == 0
    Output(folder=out, force=True).check()  # raises where it is not the whole of a run
    for path in sorted(p for p in whole.rglob("*.exr")):
        assert path.read_bytes() == (out / path.relative_to(whole)).read_bytes()
    names = {str(p.relative_to(whole)) for p in whole.rglob("*")}
    assert names == {str(p.relative_to(out)) for p in out.rglob("*")}
    assert not [name for name in names if "part" in name]
