"""The virtual renderer against geometry that is known in closed form."""

from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path
from typing import Literal

import cv2
import numpy as np
import pytest
import trimesh

from psvideo.errors import PsvideoError
from psvideo.model.rig import Light
from psvideo.synth.lamps.emission import Emission
from psvideo.synth.scene_tables import AlbedoTable, AmbientTable, CameraTable, ObjectTable
from psvideo.synth.subject.body import make_body
from psvideo.synth.subject.material import layered_noise, pattern_albedo
from psvideo.synth.subject.meshes import builtin_names, builtin_shape
from psvideo.synth.subject.meshes.fields import ball, common, difference, ellipsoid, union
from psvideo.synth.subject.meshes.surface_nets import extract_surface
from psvideo.synth.subject.render import SeenScene, cast_rays
from psvideo.synth.subject.shading import ambient_plate, flash_plate, irradiance, light_collected
from psvideo.synth.subject.shape import load_shape
from psvideo.synth.truth import true_albedo, true_mask, true_normals

HERE = Path()


def camera(**keys: object) -> CameraTable:
    base = {"width_px": 64, "height_px": 48, "fps": 100, "shutter_deg": 360.0, "readout_s": 0.01, "width_m": 1.6}
    return CameraTable.model_validate(base | keys)


def see(*objects: Mapping[str, object], time_s: float = 0.0, **keys: object) -> SeenScene:
    bodies = [make_body(ObjectTable.model_validate(table), HERE) for table in objects]
    return cast_rays(bodies, camera(**keys), time_s)


def plate(view: SeenScene, light: Light) -> np.ndarray:
    return view.hits.image(light_collected(view, light))


def unit(x: float, y: float, z: float) -> tuple[float, float, float]:
    length = float(np.sqrt(x * x + y * y + z * z))
    return x / length, y / length, z / length


def sphere_normals(rows: int, cols: int, width_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Return a unit-diameter sphere's normals in an orthographic picture, and where it is (a pixel inside its edge)."""
    y, x = np.mgrid[:rows, :cols].astype(float)
    pixel_m = width_m / cols
    x, y = (x - (cols - 1) / 2) * pixel_m / 0.5, -(y - (rows - 1) / 2) * pixel_m / 0.5
    inside = x**2 + y**2 < 0.96
    return np.stack([x, y, np.sqrt(np.maximum(1 - x**2 - y**2, 0))], axis=-1), inside


def test_a_spheres_normals_are_the_closed_forms() -> None:
    view = see({"mesh": "sphere", "albedo": 0.8})
    normals, inside = sphere_normals(48, 64, 1.6)
    error_deg = np.rad2deg(np.arccos(np.clip((true_normals(view.hits) * normals).sum(axis=-1), -1, 1)))
    assert error_deg[inside].max() < 0.2
    assert error_deg[inside].mean() < 0.03
    outside = np.hypot(*np.mgrid[-23.5:24, -31.5:32]) > 21
    assert not true_normals(view.hits)[outside].any()
    np.testing.assert_array_equal(true_mask(view.hits)[outside], 0)


def test_a_plate_is_albedo_times_intensity_times_cosine_exactly() -> None:
    view = see({"mesh": "sphere", "albedo": [0.8, 0.5, 0.2]})
    light = Light(name="key", direction=unit(0.4, -0.3, 0.8), intensity=(0.9, 0.7, 0.5))
    cosine = true_normals(view.hits).astype(float) @ np.array(light.direction)
    expected = true_albedo(view.hits, 3) * light.intensity * np.maximum(cosine, 0)[..., None]
    np.testing.assert_allclose(plate(view, light), expected, atol=2e-6)


def test_power_and_duration_scale_a_plate_from_the_reference() -> None:
    from psvideo.model.rig import Rig

    view = see({"mesh": "plane", "albedo": 0.5})
    rig = Rig(lights=(Light(name="a", direction=(0, 0, 1), reference_duration_s=0.001),) * 1)
    halved = flash_plate(view, rig, {"a": 0.5}, 0.003, Emission())
    assert halved[24, 32, 0] == pytest.approx(0.5 * 0.5 * 3.0)
    tails = Emission(rise_s=1e-4, fall_s=3e-4)
    ratio = tails.whole(0.003) / tails.whole(0.001)
    assert flash_plate(view, rig, {"a": 1.0}, 0.003, tails)[24, 32, 0] == pytest.approx(0.5 * ratio)


def test_an_attached_shadow_is_dark_and_follows_the_terminator() -> None:
    view = see({"mesh": "sphere"})
    shaded = plate(view, Light(name="side", direction=(1.0, 0.0, 0.0)))
    normals, inside = sphere_normals(48, 64, 1.6)
    assert not shaded[inside & (normals[..., 0] < -0.02)].any()
    assert (shaded[inside & (normals[..., 0] > 0.05)] > 0).all()


def test_a_cast_shadow_falls_where_the_light_says() -> None:
    """A bar 0.2 m over a wall, lit from 45 degrees: its shadow lies 0.2 m to the other side."""
    bar = {"mesh": "box", "stretch": [0.1, 0.6, 0.02], "position_m": [0.0, 0.0, 0.21], "shading": "flat"}
    wall = {"mesh": "plane", "scale": 4.0, "albedo": 0.5}
    view = see(bar, wall, width_px=160, height_px=120)
    row = plate(view, Light(name="a", direction=unit(1, 0, 1)))[60, :, 0]
    x = (np.arange(160) - 79.5) * 0.01
    dark = np.flatnonzero(row == 0)
    assert x[dark[0]] == pytest.approx(-0.05 - 0.22, abs=0.011)
    assert x[dark[-1]] == pytest.approx(0.05 - 0.20, abs=0.011)
    lit = row[(row > 0) & (np.abs(x) > 0.3)]
    np.testing.assert_allclose(lit, 0.5 * np.sqrt(0.5), rtol=1e-6)
    ghost = see(bar | {"casts_shadow": False}, wall, width_px=160, height_px=120)
    assert (plate(ghost, Light(name="a", direction=unit(1, 0, 1)))[60, :, 0] > 0).all()


def test_a_near_light_falls_off_with_distance_and_beyond_it_nothing_shadows() -> None:
    light = Light(name="near", position_m=(0.0, 0.0, 0.5), intensity=(0.4,))
    view = see({"mesh": "plane", "scale": 4.0, "albedo": 1.0})
    y, x = np.mgrid[:48, :64].astype(float)
    squared = ((x - 31.5) * 0.025) ** 2 + ((y - 23.5) * 0.025) ** 2 + 0.25
    np.testing.assert_allclose(plate(view, light)[..., 0], 0.4 * 0.5 / squared**1.5, rtol=1e-5)
    beyond = {"mesh": "box", "scale": 0.4, "position_m": [0.6, 0.0, 1.5]}  # its shadow would fall about x = -0.3
    behind = see({"mesh": "plane", "scale": 4.0, "albedo": 1.0}, beyond)
    np.testing.assert_allclose(plate(behind, light)[:, :40], plate(view, light)[:, :40], rtol=1e-5)


def test_an_led_shines_along_its_axis_by_the_power_of_its_cosine() -> None:
    light = Light(name="led", position_m=(0.0, 0.0, 1.0), intensity=(1.0,), anisotropy=2.0, axis=(0.0, 0.0, -1.0))
    direction, distance_m, strength = irradiance(light, np.array([[0.0, 0, 0], [1.0, 0, 0]]))
    np.testing.assert_allclose(distance_m, [1, np.sqrt(2)])
    np.testing.assert_allclose(direction[1], [-np.sqrt(0.5), 0, np.sqrt(0.5)])
    np.testing.assert_allclose(strength[:, 0], [1.0, 0.5 * 0.5], rtol=1e-6)


def test_a_perspective_camera_sees_points_where_they_project() -> None:
    ball_at = {"mesh": "sphere", "scale": 0.02, "position_m": [0.3, -0.2, -2.0]}
    view = see(ball_at, view="perspective", focal_px=100.0, principal_px=[20.0, 10.0])
    row, col = np.argwhere(true_mask(view.hits) > 0).mean(axis=0)
    assert (col, row) == (pytest.approx(20 + 100 * 0.15, abs=0.6), pytest.approx(10 + 100 * 0.1, abs=0.6))


def test_more_rays_per_pixel_soften_the_edge_and_keep_the_normals() -> None:
    one, four = (see({"mesh": "sphere"}, rays=rays) for rays in (1, 4))
    assert set(np.unique(true_mask(one.hits))) == {0.0, 1.0}
    assert 0.1 < np.mean((true_mask(four.hits) > 0) & (true_mask(four.hits) < 1)) * 64 * 48 / 126 < 3
    inside = sphere_normals(48, 64, 1.6)[1]
    assert ((true_normals(one.hits) * true_normals(four.hits)).sum(axis=-1)[inside] > 0.9995).all()


def test_the_highlight_lies_between_light_and_camera_and_only_adds_light() -> None:
    light = Light(name="a", direction=unit(1, 0, 1))
    ball_at: dict[str, object] = {"mesh": "sphere", "albedo": 0.5}
    dull, glossy = (plate(see(one), light)[..., 0] for one in (ball_at, ball_at | {"specular": {}}))
    gained = glossy - dull
    assert gained.min() >= 0
    row, col = np.unravel_index(gained.argmax(), gained.shape)
    assert (row, col) == (pytest.approx(23.5, abs=1), pytest.approx(31.5 + 20 * np.sin(np.pi / 8), abs=1))


def test_a_spin_turns_an_object_about_its_own_axis_through_its_position() -> None:
    bar: dict[str, object] = {"mesh": "box", "stretch": [0.8, 0.1, 0.1], "position_m": [0.1, 0.0, 0.0]}
    bar["motion"] = {"axis": [0.0, 0.0, 1.0], "spin_deg_per_s": 900.0}
    flat, upright = (true_mask(see(bar, time_s=t).hits) for t in (0.0, 0.1))
    np.testing.assert_array_equal(flat.any(axis=0).sum(), 32)
    np.testing.assert_array_equal(upright.any(axis=1).sum(), 32)
    np.testing.assert_allclose(np.argwhere(flat).mean(axis=0), np.argwhere(upright).mean(axis=0), atol=0.5)


def test_a_turned_object_spins_about_the_axis_that_turned_with_it() -> None:
    bar: dict[str, object] = {"mesh": "box", "stretch": [0.1, 0.8, 0.1], "rotate_deg": [0.0, 90.0, 0.0]}
    bar["motion"] = {"axis": [0.0, 0.0, 1.0], "spin_deg_per_s": 900.0}
    upright, end_on = (true_mask(see(bar, time_s=t).hits) for t in (0.0, 0.1))
    assert (upright.any(axis=1).sum(), upright.any(axis=0).sum()) == (32, 4)
    assert (end_on.any(axis=1).sum(), end_on.any(axis=0).sum()) == (4, 4)


def test_a_stretched_spheres_normals_are_an_ellipsoids() -> None:
    view = see({"mesh": "sphere", "stretch": [1.0, 0.5, 1.0]})
    y, x = np.mgrid[:48, :64].astype(float)
    x, y = (x - 31.5) * 0.025 / 0.5, -(y - 23.5) * 0.025 / 0.25
    inside = x**2 + y**2 < 0.9
    normal = np.stack([x / 0.5, y / 0.25, np.sqrt(np.maximum(1 - x**2 - y**2, 0)) / 0.5], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    np.testing.assert_allclose(true_normals(view.hits)[inside], normal[inside], atol=4e-3)


def test_travel_and_sway_move_an_object_as_the_clock_says() -> None:
    thing = {
        "mesh": "sphere",
        "scale": 0.2,
        "motion": {"velocity_m_per_s": [2.0, 0, 0], "sway_m": [0, 0.3, 0], "sway_hz": 2.5},
    }
    row, col = np.argwhere(true_mask(see(thing, time_s=0.1).hits)).mean(axis=0)
    assert col == pytest.approx(31.5 + 0.2 / 0.025, abs=0.2)
    assert row == pytest.approx(23.5 - 0.3 / 0.025, abs=0.2)


def test_ambient_light_is_albedo_times_level_and_less_in_a_corner() -> None:
    floor = {"mesh": "plane", "scale": 4.0, "albedo": 0.5}
    wall = {"mesh": "box", "stretch": [0.1, 4.0, 2.0], "position_m": [0.05, 0.0, 1.0]}
    flat = ambient_plate(see(floor), AmbientTable(level=0.2))
    np.testing.assert_allclose(flat, 0.1, rtol=1e-6)
    corner = ambient_plate(see(floor, wall), AmbientTable(level=0.2, occlusion_rays=256))[24, :, 0]
    assert corner[30] == pytest.approx(0.05, rel=0.1)  # beside a high wall: half the sky
    assert corner[0] > 1.2 * corner[30]


@pytest.mark.parametrize("pattern", ["noise", "marble", "stripes", "checker", "bands"])
def test_patterns_lie_between_their_two_colours_and_use_both(
    pattern: Literal["noise", "marble", "stripes", "checker", "bands"],
) -> None:
    table = AlbedoTable(pattern=pattern, colour=0.6, second=[0.1, 0.2, 0.3], size_m=0.1, bands_m=[[-0.2, 0.0]])
    points = np.random.default_rng(0).uniform(-0.5, 0.5, (20_000, 3))
    albedo = pattern_albedo(table, points)
    assert albedo.min() >= 0.1 - 1e-6
    assert albedo.max() <= 0.6 + 1e-6
    assert 0.02 < np.mean(albedo[:, 0] < 0.35) < 0.9


def test_noise_is_smooth_and_the_same_everywhere_and_always() -> None:
    points = np.array([[0.3, -2.7, 11.2], [1e4, 5.5, -3.25]])
    np.testing.assert_allclose(layered_noise(points), layered_noise(points + 1e-7), atol=1e-4)
    np.testing.assert_allclose(layered_noise(points), [-0.6001675, -0.2267946], atol=1e-6)


def test_surface_nets_find_spheres_and_cuts_with_their_volume_and_outward_faces() -> None:
    def field(p: np.ndarray) -> np.ndarray:
        return difference(ball(p, (0, 0, 0), 0.5), ellipsoid(p, (0, 0, 0.5), (0.2, 0.2, 0.2)), 0.0)

    vertices, faces = extract_surface(field, np.full(3, -0.6), np.full(3, 0.6), 0.02)
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    assert mesh.is_watertight
    lens = np.pi * 0.2**2 * (0.2 * 2 / 3 - 0.2**2 / (4 * 0.5))  # of two balls, the smaller's centre on the larger
    assert mesh.volume == pytest.approx(4 / 3 * np.pi * 0.125 - lens, rel=0.01)
    smooth = np.linalg.norm(vertices - [0, 0, 0.5], axis=1) > 0.25
    np.testing.assert_allclose(np.linalg.norm(vertices[smooth], axis=1), 0.5, atol=2e-4)


def test_soft_unions_and_cuts_change_the_field_only_near_the_seam() -> None:
    a, b = np.array([-1.0, 0.02, 3.0]), np.array([2.0, 0.03, -1.0])
    np.testing.assert_array_equal(union(a, b, 0.1)[[0, 2]], [-1.0, -1.0])
    assert union(a, b, 0.1)[1] < 0.02
    np.testing.assert_array_equal(common(a, b, 0.1)[[0, 2]], [2.0, 3.0])


@pytest.mark.parametrize("name", [name for name in builtin_names() if name != "bust"])
def test_built_in_meshes_are_sound_and_their_normals_point_with_their_faces(name: str) -> None:
    shape = builtin_shape(name)
    assert np.isfinite(shape.vertices).all()
    a, b, c = (shape.vertices[shape.faces[:, k]] for k in range(3))
    crosses = np.cross(b - a, c - a)
    with_face = np.einsum("ij,ij->i", crosses, shape.normals[shape.faces[:, 0]])
    assert np.mean(with_face > -1e-15) > 0.999
    used = np.unique(shape.faces[np.linalg.norm(crosses, axis=1) > 1e-12])
    np.testing.assert_allclose(np.linalg.norm(shape.normals[used], axis=1), 1.0, atol=1e-9)
    if shape.colours is not None:
        assert shape.colours.min() >= 0
        assert shape.colours.max() <= 1


def test_the_bust_is_one_closed_body_with_a_face_in_front() -> None:
    shape = builtin_shape("bust")
    mesh = trimesh.Trimesh(shape.vertices, shape.faces, process=False)
    edges, counts = np.unique(mesh.edges_sorted, axis=0, return_counts=True)
    assert set(counts) <= {2, 4}  # closed; where two folds touch, four faces may share an edge
    assert len(trimesh.graph.connected_components(edges)) == 1
    assert mesh.volume > 0.008
    tip = shape.vertices[shape.vertices[:, 2].argmax()]
    assert abs(tip[0]) < 0.003  # the nose's tip, in the middle of the face
    assert -0.05 < tip[1] < -0.02


def test_a_users_mesh_comes_with_its_texture(shared_data: Path) -> None:
    cow = {"mesh": str(shared_data / "meshes" / "spot.obj"), "height_m": 1.0, "rotate_deg": [0.0, 150.0, 0.0]}
    plain = true_albedo(see(cow).hits, 3)
    assert set(np.unique(plain)) == {0.0, np.float32(0.7)}
    spotted = see(cow | {"albedo": {"texture": str(shared_data / "meshes" / "spot_texture.png")}})
    albedo = true_albedo(spotted.hits, 3)[true_mask(spotted.hits) > 0]
    assert 0.1 < np.mean(albedo[:, 0] < 0.2) < 0.6  # dark patches on a light hide
    assert np.mean(albedo[:, 0] > 0.5) > 0.2


def test_a_texture_needs_coordinates_and_a_picture(tmp_path: Path) -> None:
    for mesh, name, message in (
        ("sphere", "a.png", "has no texture coordinates"),
        ("spot.obj", "a.png", "as a texture"),
    ):
        (tmp_path / "spot.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n")
        table = ObjectTable.model_validate({"mesh": mesh, "albedo": {"texture": name}})
        with pytest.raises(PsvideoError, match=message):
            make_body(table, tmp_path)


def test_a_texture_lies_upright_and_its_codes_are_taken_for_srgb(tmp_path: Path) -> None:
    corners = ((0, 0), (1, 0), (1, 1), (0, 1))
    lines = [f"v {u - 0.5} {v - 0.5} 0\nvt {u} {v}" for u, v in corners] + ["f 1/1 2/2 3/3", "f 1/1 3/3 4/4"]
    (tmp_path / "square.obj").write_text("\n".join(lines))
    picture = np.zeros((64, 64, 3), np.uint8)
    picture[:32, :, 2], picture[32:, :32, 0] = 188, 255  # red above, blue below on the left (OpenCV's order)
    cv2.imwrite(str(tmp_path / "flag.png"), picture)
    body = make_body(ObjectTable.model_validate({"mesh": "square.obj", "albedo": {"texture": "flag.png"}}), tmp_path)
    albedo = true_albedo(cast_rays([body], camera(), 0.0).hits, 3)
    np.testing.assert_allclose(albedo[14, 22], [0.503, 0, 0], atol=1e-3)
    np.testing.assert_allclose([albedo[34, 22], albedo[34, 42]], [[0, 0, 1], [0, 0, 0]], atol=1e-6)


@pytest.mark.parametrize("suffix", [".ply", ".stl", ".obj", ".glb"])
def test_mesh_files_of_every_kind_give_the_same_picture(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"ball{suffix}"
    trimesh.creation.icosphere(subdivisions=4, radius=0.5).export(path)
    view = see({"mesh": str(path), "albedo": 0.8})
    normals, inside = sphere_normals(48, 64, 1.6)
    assert ((true_normals(view.hits) * normals).sum(axis=-1)[inside] > np.cos(np.deg2rad(1.5))).all()


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("gone.obj", None, "there is no such mesh file"),
        ("mesh.txt", b"v 0 0 0", "expected one of .obj, .ply"),
        ("broken.ply", b"ply\nformat ascii 1.0\nelement vertex 9\n", "cannot be read as a mesh|holds no triangles"),
        ("empty.obj", b"v 0 0 0\nv 1 0 0\n", "cannot be read as a mesh|holds no triangles"),
    ],
)
def test_a_mesh_that_cannot_be_used_is_named(tmp_path: Path, name: str, content: bytes | None, message: str) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(PsvideoError, match=message) as fault:
        load_shape(tmp_path / name)
    assert name in str(fault.value)


def test_camera_rates_are_exact_ratios() -> None:
    assert camera(fps="120000/1001", readout_s=0.0).rate == Fraction(120_000, 1001)
