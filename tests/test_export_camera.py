"""World space: normals and points lie in the scene where the camera of a text or USD file puts them."""

from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from psvideo.errors import PsvideoError, UsageError
from psvideo.export.mesh_files import read_part, write_part
from psvideo.export.sequences.result_files import Delivery
from psvideo.export.space import Space, choose_space, placed, placed_points
from psvideo.export.usd.pose import read_pose
from psvideo.model.rig import Rig
from psvideo.runs.delivery.beforehand import world_doubts
from psvideo.solve.depth import Mesh

usd = pytest.importorskip("pxr.Usd")
from pxr import Gf, UsdGeom  # noqa: E402

FPS = Fraction(24)


def stage_with_cameras(
    path: Path, *, up: str = "Y", unit_m: float = 0.01, moving: bool = False, names: int = 1
) -> Path:
    """A camera 300 units up the stage's z, turned 30 degrees about its y; moving: 10 units in x per time code."""
    stage = usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, up)
    UsdGeom.SetStageMetersPerUnit(stage, unit_m)
    stage.SetTimeCodesPerSecond(24)
    UsdGeom.Xform.Define(stage, "/rig").AddScaleOp().Set(Gf.Vec3f(2, 2, 2))
    for n in range(names):
        camera = UsdGeom.Camera.Define(stage, f"/rig/shot{n or ''}")
        place = camera.AddTranslateOp()
        if moving:
            for code in range(101, 111):
                place.Set(Gf.Vec3d(5 * (code - 101), 0, 150), code)
        else:
            place.Set(Gf.Vec3d(0, 0, 150))
        camera.AddRotateYOp().Set(30)
    stage.Save()
    return path


def test_a_usd_camera_turns_normals_and_moves_points_in_the_stages_unit(tmp_path: Path) -> None:
    space = choose_space("world", "up", stage_with_cameras(tmp_path / "shot.usda"))
    facing = placed(np.array([[[0.0, 0, 1]]], np.float32), space)
    assert np.allclose(facing, [0.5, 0, np.sqrt(0.75)], atol=1e-6)  # backwards, turned 30 degrees towards x
    ahead = placed_points(np.array([[[0.0, 0, -1]], [[0, 0, 0]]], np.float32), space, np.array([[True], [False]]))
    assert np.allclose(ahead[0, 0], [-50, 0, 300 - 100 * np.sqrt(0.75)], atol=1e-4)  # 1 m is 100 units
    assert not ahead[1].any(), "what is not valid stays 0, wherever the camera is"
    said = space.attributes()
    assert (said["psvideo:meters_per_unit"], said["psvideo:up"]) == (0.01, "y")
    numbers = [float(word) for word in str(said["psvideo:camera_to_world"]).split()]
    assert np.allclose(np.reshape(numbers, (4, 4))[:3, 3], [0, 0, 300])


def test_a_stage_that_is_z_up_keeps_its_axes_and_says_so(tmp_path: Path) -> None:
    space = choose_space("world", "up", stage_with_cameras(tmp_path / "shot.usdc", up="Z", unit_m=1.0))
    assert space.up == "z"
    assert np.allclose(placed(np.array([0.0, 1, 0], np.float32), space), [0, 1, 0], atol=1e-6)


def test_a_camera_that_moves_is_where_it_was_at_the_instant(tmp_path: Path) -> None:
    path = stage_with_cameras(tmp_path / "shot.usda", moving=True)
    by_frame = choose_space("world", "up", path)
    assert by_frame.at(2.5 / 120, 1001, Fraction(120)).origin == pytest.approx([25, 0, 300])
    seconds = choose_space("world", "up", path, camera_time="seconds")
    assert seconds.at(2.5 / 24, 1001, Fraction(120)).origin == pytest.approx([25, 0, 300])
    numbers = choose_space("world", "up", path, camera_time="numbers")
    assert numbers.at(77.0, 104, Fraction(120)).origin == pytest.approx([30, 0, 300])
    with pytest.raises(PsvideoError, match=r"101 to 110.*needs it at 1001"):
        numbers.at(0.0, 1001, Fraction(120))


def test_a_camera_that_stands_still_is_where_it_is_at_any_instant(tmp_path: Path) -> None:
    space = choose_space("world", "up", stage_with_cameras(tmp_path / "shot.usda"))
    assert space.at(1e6, 5, FPS) is space


def test_a_lens_that_is_not_the_rigs_and_depth_without_scale_are_reported(tmp_path: Path) -> None:
    space = choose_space("world", "up", stage_with_cameras(tmp_path / "shot.usda"))
    lens_px = 1000 * 50 / 20.955  # USD's own focal length and aperture, at 1000 pixels
    delivery = Delivery(space=space, aovs=("position",))

    def doubts(focal_px: float | None, *, metric: bool = True) -> str:
        rig = Rig(lights=(), focal_px=None if focal_px is None else (focal_px, focal_px))
        return " ".join(world_doubts(delivery, rig, 1000, metric=metric))

    assert doubts(1.005 * lens_px) == ""
    assert "the USD camera's 2386.07" in doubts(1.1 * lens_px)
    assert "would be 2386.07" in doubts(None, metric=False)
    assert world_doubts(Delivery(space=space), Rig(lights=()), 1000, metric=False) == (), "normals need no scale"


def test_one_of_several_cameras_is_named(tmp_path: Path) -> None:
    path = stage_with_cameras(tmp_path / "shot.usda", names=3)
    with pytest.raises(PsvideoError, match=r"3 cameras .*/rig/shot1.*`camera`"):
        choose_space("world", "up", path)
    with pytest.raises(PsvideoError, match="no camera named 'shot9'"):
        choose_space("world", "up", path, camera="shot9")
    for name in ("shot1", "/rig/shot1", "rig/shot1"):
        assert choose_space("world", "up", path, camera=name).origin == pytest.approx([0, 0, 300])


def test_a_file_that_is_no_stage_or_has_no_camera_is_refused(tmp_path: Path) -> None:
    (tmp_path / "broken.usda").write_text("not usd at all")
    with pytest.raises(PsvideoError, match=r"broken\.usda: cannot be read as USD"):
        choose_space("world", "up", tmp_path / "broken.usda")
    with pytest.raises(PsvideoError, match="is not a file"):
        choose_space("world", "up", tmp_path / "none.usdc")
    usd.Stage.CreateNew(str(tmp_path / "empty.usda")).Save()
    with pytest.raises(PsvideoError, match="holds no camera"):
        choose_space("world", "up", tmp_path / "empty.usda")
    (tmp_path / "camera.txt").write_text("1 0 0 0 1 0 0 0 1")
    with pytest.raises(UsageError, match="belongs to a USD camera"):
        choose_space("world", "up", tmp_path / "camera.txt", camera="a")
    with pytest.raises(UsageError, match='`camera_time`: belongs to `space="world"`'):
        choose_space("camera", "up", None, camera_time="frames")


def test_a_text_matrix_places_the_camera_and_one_for_row_vectors_is_named(tmp_path: Path) -> None:
    path = tmp_path / "camera.txt"
    path.write_text("1 0 0 4\n0 1 0 5\n0 0 1 6\n0 0 0 1\n")
    assert read_pose(path).origin.tolist() == [4, 5, 6]
    path.write_text("1 0 0 0\n0 1 0 0\n0 0 1 0\n4 5 6 1\n")
    with pytest.raises(PsvideoError, match="transpose"):
        read_pose(path)


def test_a_mesh_lies_where_the_camera_stands_and_is_not_mirrored(tmp_path: Path) -> None:
    space = replace(choose_space("world", "up", stage_with_cameras(tmp_path / "shot.usda")), y="down")
    mesh = Mesh(
        points=np.array([[0, 0, -1.0], [0.1, 0, -1], [0, 0.1, -1]], np.float32),
        triangles=np.array([[0, 1, 2]], np.int32),
        normals=np.array([[0, 0, 1.0]] * 3, np.float32),
        colours=np.ones((3, 3), np.float32),
        places=np.zeros((3, 2), np.float32),
    )
    write_part(tmp_path / "a.npz", mesh, space)
    moved = read_part(tmp_path / "a.npz")
    assert np.allclose(moved.points[2] - moved.points[0], [0, 10, 0], atol=1e-4)
    wound = np.cross(moved.points[1] - moved.points[0], moved.points[2] - moved.points[0])
    assert np.allclose(wound / np.linalg.norm(wound), moved.normals[0], atol=1e-5)
    assert isinstance(space, Space)
