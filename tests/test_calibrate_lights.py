"""Lights measured on matte spheres, white targets and any matte scene; and guessed where nothing was calibrated."""

import json
import re
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from picture_file import read_picture

import psvideo as ps
from psvideo.calibrate.cho2020 import measure_strengths
from psvideo.calibrate.flat_field import measure_flat_field, with_intensities
from psvideo.calibrate.guess import guess_rig
from psvideo.calibrate.light_pictures import LightPictures, light_pictures
from psvideo.calibrate.matte import measure_matte_sphere, sphere_normals
from psvideo.calibrate.sphere.outline import given_outline
from psvideo.calibrate.sphere.sphere_view import SphereView
from psvideo.calibrate.white_target import Target
from psvideo.cli.app import main
from psvideo.cli.options.typed import parse_box, parse_seconds, parse_starts_s
from psvideo.errors import PsvideoError, UsageError
from psvideo.formats.exr_files import write_exr
from psvideo.formats.rig_toml import format_rig, read_rig
from psvideo.model.choices import Prior
from psvideo.model.irradiance.ground import ground_of
from psvideo.model.rig import Light, Rig
from psvideo.runs.calibrate.flat_field import flat_field, white_target
from psvideo.runs.calibrate.matte_sphere import matte_sphere
from psvideo.runs.calibrate.mirror_sphere import mirror_sphere
from psvideo.runs.calibrate.readout import readout

Array = NDArray[np.float64]
HIGH, WIDE = 150, 200
CIRCLE = (95.3, 71.8, 60.0)
WALL = """
schema = "psvideo-scene/1"
name = "wall"
frames = 12
seed = 3
[camera]
width_px = 64
height_px = 48
fps = 100
shutter_deg = 360.0
readout_s = 0.0081
width_m = 0.5
[strobe]
flash_s = 0.0007
[[object]]
mesh = "plane"
scale = 2
albedo = 0.6
casts_shadow = false
"""


def ways(count: int, *, seed: int = 0) -> Array:
    """Directions spread over 50 degrees about the camera's axis, not on a ring."""
    rng = np.random.default_rng(seed)
    slant = np.radians(rng.uniform(8, 50, count))
    around = np.arange(count) * 2.4 + rng.uniform(0, 0.5, count)
    return np.stack([np.sin(slant) * np.cos(around), np.sin(slant) * np.sin(around), np.cos(slant)], axis=1)


def sphere_pictures(
    directions: Array, strengths: Array, *, view: SphereView = SphereView(focal_px=None, principal_px=(99.5, 74.5)),
    noise: float = 0.002, gloss: float = 0.0,
) -> LightPictures:  # fmt: skip
    """A matte sphere, perhaps with a highlight, in the circle's outline; ``strengths`` (light, channel)."""
    place = given_outline(view, CIRCLE).place
    points = np.stack(np.meshgrid(np.arange(WIDE), np.arange(HIGH)), axis=-1).reshape(-1, 2).astype(float)
    normals, facing = sphere_normals(view, place, points)
    shade = np.maximum(normals @ directions.T, 0) * (facing > 0)[:, None]
    half = directions + np.array([0.0, 0.0, 1.0])
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    spot = gloss * np.maximum(normals @ half.T, 0) ** 200 * (facing > 0)[:, None]
    images = (0.6 * shade.T[..., None] * strengths[:, None, :] + spot.T[..., None]).reshape(-1, HIGH, WIDE, 3)
    images = images + np.random.default_rng(1).normal(0, noise, images.shape)
    names = [f"L{n}" for n in range(len(directions))]
    return light_pictures(names, list(np.clip(images, 0, 1).astype(np.float32)))


def off_deg(found: Array, true: Array) -> Array:
    angles: Array = np.degrees(np.arccos(np.clip((found * true).sum(axis=-1), -1, 1)))
    return angles


@pytest.mark.parametrize("focal_px", [None, 300.0])
def test_a_matte_sphere_shows_directions_and_intensities_per_channel(focal_px: float | None) -> None:
    view = SphereView(focal_px=focal_px, principal_px=(99.5, 74.5))
    directions, strengths = ways(5), np.random.default_rng(2).uniform(0.5, 1.3, (5, 3))
    found = measure_matte_sphere(
        sphere_pictures(directions, strengths, view=view), given_outline(view, CIRCLE), albedo=0.6
    )
    assert off_deg(np.array([light.direction for light in found]), directions).max() < 0.1
    np.testing.assert_allclose([light.intensity for light in found], strengths, rtol=0.005)
    assert all(0.1 < light.error_deg < 1.5 for light in found), "half a pixel on a marked outline"


@pytest.mark.parametrize("turn_deg", [0.0, 30.0, 90.0, 200.0])
def test_a_drawn_out_outline_ends_where_the_sphere_turns_away(turn_deg: float) -> None:
    """As on a mirror: at a share of the way to the rim, the normal leans by that share."""
    view, place = SphereView(focal_px=None, principal_px=(99.5, 74.5)), np.array([95.0, 72.0, 60.0, 0.04, -0.03])
    turn = np.radians(turn_deg)
    way = np.array([np.cos(turn), np.sin(turn)])
    rim = 60.0 * (1 + 0.04 * np.cos(2 * turn) - 0.03 * np.sin(2 * turn))
    shares = np.array([0.3, 0.7, 0.98])
    normals, _ = sphere_normals(view, place, place[:2] + shares[:, None] * rim * way)
    np.testing.assert_allclose(normals[:, :2], shares[:, None] * way * [1, -1], atol=1e-9)


def test_gloss_and_saturation_are_weighed_out_of_a_matte_sphere() -> None:
    directions, strengths = ways(4), np.full((4, 3), 1.5)
    glossy = sphere_pictures(directions, strengths, gloss=0.8)
    assert glossy.saturated.any()
    found = measure_matte_sphere(glossy, given_outline(SphereView(focal_px=None, principal_px=(99.5, 74.5)), CIRCLE))
    assert off_deg(np.array([light.direction for light in found]), directions).max() < 0.5
    np.testing.assert_allclose([light.intensity for light in found], 1.0, rtol=0.01)


@pytest.mark.campaign
def test_a_wrong_outline_costs_what_the_standard_error_says() -> None:
    directions, strengths = ways(6), np.ones((6, 3))
    pictures = sphere_pictures(directions, strengths)
    x, y, radius = CIRCLE
    ratios = []
    for dx, dy, dr in np.random.default_rng(3).normal(0, 0.5, (8, 3)):
        outline = given_outline(SphereView(focal_px=None, principal_px=(99.5, 74.5)), (x + dx, y + dy, radius + dr))
        found = measure_matte_sphere(pictures, outline)
        off = off_deg(np.array([light.direction for light in found]), directions)
        ratios += list(off / [light.error_deg for light in found])
    assert 0.3 < np.sqrt(np.mean(np.square(ratios))) < 1.5


def test_what_is_no_matte_sphere_is_refused_light_by_light() -> None:
    disc = np.zeros((HIGH, WIDE, 3), np.float32)
    cv2.circle(disc, (95, 72), 60, (0.5, 0.5, 0.5), -1)
    outline = given_outline(SphereView(focal_px=None, principal_px=(99.5, 74.5)), CIRCLE)
    found = measure_matte_sphere(light_pictures(["a", "b"], [disc, 0.01 * disc]), outline)
    assert all("not matte" in light.fault or "no matte sphere" in light.fault for light in found)


def washington(folder: Path, into: Path) -> tuple[Path, Array]:
    into.mkdir()
    for n in range(12):
        (into / f"gray.{n}.png").symlink_to((folder / "uw_psm" / "gray" / f"gray.{n}.png").resolve())
    words = (folder / "uw_psm" / "lights.txt").read_text().split()
    true = np.array(words[1:], float).reshape(-1, 3)
    return into, true / np.linalg.norm(true, axis=1, keepdims=True)


def test_a_real_matte_sphere_agrees_with_the_chrome_one(
    shared_data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, chrome = washington(shared_data, tmp_path / "gray")
    out = tmp_path / "rig.toml"
    assert main(["calibrate", "matte-sphere", str(folder), "-o", str(out)]) == 0
    assert "the focal length is not known" in capsys.readouterr().err
    lights = read_rig(out).lights
    off = off_deg(np.array([light.direction for light in lights]), chrome)
    assert off.mean() < 3.5  # those ignore second reflections: 8 degrees for light 1
    assert np.median(off / np.array([light.error_deg for light in lights])) < 1.5
    strengths = np.array([light.intensity for light in lights]).mean(axis=1)
    assert np.sort(np.abs(strengths - 1))[-2] < 0.013, "eleven of twelve within 1.3 %"
    assert read_picture(out.with_suffix(".png")).shape[1] == 1200


@pytest.mark.parametrize("near", [False, True], ids=["distant", "near"])
def test_a_white_target_shows_intensities_and_leaves_only_falloff_that_the_rig_does_not_explain(near: bool) -> None:
    directions, strengths = ways(4), np.random.default_rng(4).uniform(0.2, 0.5, (4, 3))
    normal = np.array([0.2, 0.0, 1.0]) / np.hypot(0.2, 1.0)
    rig = Rig(
        lights=tuple(
            Light(name=f"L{n}", position_m=tuple(np.array([0, 0, -1.2]) + 0.9 * way))
            if near
            else Light(name=f"L{n}", direction=tuple(way))
            for n, way in enumerate(directions)
        ),
        focal_px=(400.0, 400.0),
        principal_px=(99.5, 74.5),
        plane=(0.2, 0.0, 1.0, 1.2),
    )
    x, y = np.meshgrid((np.arange(WIDE) - 99.5) / 400, -(np.arange(HIGH) - 74.5) / 400)
    ray = np.stack([x, y, -np.ones_like(x)], axis=-1)
    points = ray * (-1.2 / (ray @ [0.2, 0, 1]))[..., None]
    shades = []
    for light in rig.lights:
        if light.position_m is None:
            shades.append(np.full((HIGH, WIDE), np.array(light.direction) @ normal))
        else:
            away = np.array(light.position_m) - points
            shades.append(away @ normal / np.linalg.norm(away, axis=-1) ** 3)
    images = [
        (0.9 * shade[..., None] * strength).astype(np.float32)
        for shade, strength in zip(shades, strengths, strict=True)
    ]
    pictures = light_pictures(rig.names, images)
    ground = ground_of(rig, height_px=HIGH, width_px=WIDE) if near else None
    target = Target(albedo=0.9, normal=normal, rows=slice(0, HIGH), cols=slice(0, WIDE))
    found = measure_flat_field(pictures, rig, target, ground=ground)
    np.testing.assert_allclose([light.intensity for light in found], strengths, rtol=1e-4)
    assert max(light.falloff for light in found) < 1e-3
    vignetted = light_pictures(
        rig.names, [image * (1 - 2 * (x**2 + y**2))[..., None].astype(np.float32) for image in images]
    )
    assert min(light.falloff for light in measure_flat_field(vignetted, rig, target, ground=ground)) > 0.05


FACING = Target(albedo=0.9, normal=np.array([0.0, 0.0, 1.0]), rows=slice(0, 24), cols=slice(0, 32))
WAYS = ((0.6, 0.0, 0.8), (-0.6, 0.0, 0.8), (0.0, 0.6, 0.8))


def under(seen: Array) -> LightPictures:
    """A white card that faces the camera under lights whose strengths the channels see so, (light, channel)."""
    images = [np.full((24, 32, 3), 0.9 * way[2] * one, np.float32) for way, one in zip(WAYS, seen, strict=True)]
    return light_pictures("abc", images)


def test_what_is_measured_takes_the_place_of_colour_and_of_the_flash_that_the_old_strength_was_for() -> None:
    seen = np.array([(1.0, 0.5, 0.2), (0.1, 0.8, 0.1), (0.05, 0.2, 0.9)])
    lights = tuple(
        Light(name=name, direction=way, intensity=(2.0,), colour=tuple(one), reference_duration_s=0.0016)
        for name, way, one in zip("abc", WAYS, seen, strict=True)
    )
    rig, pictures = Rig(lights=lights), under(seen)
    strengths = [light.intensity.tolist() for light in measure_flat_field(pictures, rig, FACING)]
    for flashes_s in (None, (0.0008, 0.0008, 0.0004)):
        measured = with_intensities(rig, strengths, replace(pictures, flashes_s=flashes_s)).lights
        np.testing.assert_allclose([light.by_channel for light in measured], seen, rtol=1e-4)
        assert all(light.colour is not None for light in measured), "flashes of several colours are still told apart"
        assert [light.reference_duration_s for light in measured] == list(flashes_s or [None] * 3)


def test_a_clip_says_for_how_long_the_lights_shone_whose_strengths_it_shows(tmp_path: Path) -> None:
    lights = "".join(f'[[light]]\nname = "{n}"\ndirection = {list(w)}\n' for n, w in zip("abc", WAYS, strict=True))
    scene = tmp_path / "scene.toml"
    scene.write_text(WALL + lights)
    clip = ps.shoot(scene, tmp_path / "clip").path
    true = read_rig(clip / "rig.toml")
    other = [replace(light, intensity=(7.0,), reference_duration_s=0.003) for light in true.lights]
    (tmp_path / "rig.toml").write_text(format_rig(Rig(lights=tuple(other))))
    found = flat_field(clip, rig=tmp_path / "rig.toml", out=tmp_path / "found.toml", albedo=0.6).rig
    for light, one in zip(found.lights, true.lights, strict=True):
        assert light.reference_duration_s == one.reference_duration_s == 0.0007
        np.testing.assert_allclose(light.intensity, one.intensity[0], rtol=0.02)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_plane_is_the_same_with_either_sign(sign: float) -> None:
    rig = Rig(lights=(), plane=(0.2 * sign, 0.0, sign, 1.2 * sign))
    lights = tuple(Light(name=name, direction=way) for name, way in zip("abc", WAYS, strict=True))
    known, pictures = replace(rig, lights=lights), under(np.ones((3, 3)))
    target, _ = white_target(pictures, known, Path("rig.toml"), albedo=0.9, box=None)
    np.testing.assert_allclose(target.normal, np.array([0.2, 0, 1]) / np.hypot(0.2, 1))


@pytest.mark.parametrize("cosine", [0.2, 0.04, 0.001])
def test_a_light_that_only_grazes_the_target_is_refused_and_one_above_it_is_measured(cosine: float) -> None:
    rig = Rig(lights=(Light(name="a", direction=(float(np.sqrt(1 - cosine**2)), 0.0, cosine)),))
    pictures = light_pictures("a", [np.full((24, 32), 0.9 * cosine, np.float32)])
    if cosine > 0.05:
        assert measure_flat_field(pictures, rig, FACING)[0].intensity == pytest.approx(1)
        return
    with pytest.raises(PsvideoError, match="behind the white target, or just at its edge"):
        measure_flat_field(pictures, rig, FACING)


def test_a_matte_scene_shows_the_strengths_of_lights_of_known_directions() -> None:
    directions, strengths = ways(6), np.random.default_rng(5).uniform(0.5, 1.4, (6, 3))
    pictures = sphere_pictures(directions, strengths)
    found = measure_strengths(pictures, directions)
    np.testing.assert_allclose(found.intensity, strengths / strengths.mean(axis=0), rtol=0.01)
    assert 0.01 < found.error.max() < 0.04, "directions are known to a degree at best"
    shining = np.array(pictures.images)
    shining[:2] += 0.3 * (np.random.default_rng(1).random(shining[:2].shape[:3]) < 0.02)[..., None]
    of_shining = measure_strengths(light_pictures(pictures.names, list(shining)), directions)
    np.testing.assert_allclose(of_shining.intensity, found.intensity, rtol=0.005)
    dim = [image * (0.01 if n == 4 else 1.0) for n, image in enumerate(pictures.images)]
    with pytest.raises(PsvideoError, match=f"Light {pictures.names[4]!r} reaches hardly any"):
        measure_strengths(light_pictures(pictures.names, dim), directions)
    with pytest.raises(PsvideoError, match="four lights or more"):
        measure_strengths(sphere_pictures(directions[:3], strengths[:3]), directions[:3])
    flat = light_pictures(["a", "b", "c", "d"], [np.full((50, 60), 0.2 * n + 0.1, np.float32) for n in range(4)])
    noisy = [image + np.random.default_rng(9).normal(0, 0.002, image.shape).astype(np.float32) for image in flat.images]
    with pytest.raises(PsvideoError, match="does not show"):
        measure_strengths(light_pictures(flat.names, noisy), directions[:4])


def test_the_command_writes_the_strengths_into_the_rig_and_speaks_json(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    directions, strengths = ways(5), np.random.default_rng(6).uniform(0.5, 0.9, (5, 3))
    for name, image in zip("abcde", sphere_pictures(directions, strengths).images, strict=True):
        write_exr(tmp_path / "stills" / f"{name}.exr", {c: image[..., k] for k, c in enumerate("RGB")}, half=False)
    lights = tuple(Light(name=name, direction=(x, y, z)) for name, (x, y, z) in zip("abcde", directions, strict=True))
    (tmp_path / "known.toml").write_text(format_rig(Rig(lights=lights)))
    words = ["calibrate", "intensities", str(tmp_path / "stills"), "--rig", str(tmp_path / "known.toml")]
    words += ["-o", str(tmp_path / "rig.toml")]
    assert main([*words, "--json"]) == 0
    spoken = json.loads(capsys.readouterr().out)["lights"]
    written = read_rig(tmp_path / "rig.toml").lights
    assert [light["name"] for light in spoken] == [light.name for light in written] == list("abcde")
    found = np.array([light.intensity for light in written])
    np.testing.assert_allclose(found, strengths / strengths.mean(axis=0), rtol=0.02)
    assert off_deg(np.array([light.direction for light in written]), directions).max() < 1e-3
    assert main(words) == 2, "a rig is not replaced without --force"
    assert main([*words, "--force"]) == 0
    assert "5 lights written; intensities are relative" in capsys.readouterr().out


@pytest.mark.parametrize(("lights", "prior"), [(8, "equal-lights"), (8, "equal-albedo"), (4, None)])
def test_a_guess_is_right_where_its_priors_hold(lights: int, prior: Prior | None) -> None:
    directions = ways(lights)
    guessed = guess_rig(sphere_pictures(directions, np.ones((lights, 3))), prior=prior)
    found = np.array([light.direction for light in guessed.rig.lights])
    assert off_deg(found, directions).max() < 6
    assert all(light.error_deg == 20 for light in guessed.rig.lights)


def test_a_guess_says_what_it_cannot_know() -> None:
    ring = np.array([[np.cos(a), np.sin(a), 1.4] for a in np.arange(8) * np.pi / 4])
    ring /= np.linalg.norm(ring, axis=1, keepdims=True)
    with pytest.raises(PsvideoError, match=r"fit several directions of the lights|No lights of equal strength"):
        guess_rig(sphere_pictures(ring, np.ones((8, 3)), noise=0), prior="equal-lights")
    unequal = np.linspace(0.2, 1.5, 8)[:, None] * np.ones(3)
    with pytest.raises(PsvideoError, match=r"unequal by|No lights of equal strength"):
        guess_rig(sphere_pictures(ways(8), unequal), prior="equal-lights")
    with pytest.raises(PsvideoError, match="A matte surface explains"):
        guess_rig(sphere_pictures(ways(8), np.ones((8, 3)), noise=0.15), prior="equal-lights")


def test_a_guessed_rig_says_so_in_the_file_and_on_the_terminal(
    shared_data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, chrome = washington(shared_data, tmp_path / "gray")
    out = tmp_path / "rig.toml"
    assert main(["calibrate", "guess", str(folder), "-o", str(out)]) == 0
    assert "A GUESS" in capsys.readouterr().err
    assert out.read_text().startswith("# A GUESS")
    lights = read_rig(out).lights
    assert off_deg(np.array([light.direction for light in lights]), chrome).mean() < 20
    assert main(["calibrate", "guess", str(folder), "-o", str(tmp_path / "x.toml"), "--prior", "luck"]) == 2


@pytest.fixture
def shot(tmp_path: Path) -> tuple[Path, Path]:
    """A folder of stills of a matte ball, one per light, and the rig of these lights."""
    directions = ways(4)
    for name, image in zip("abcd", sphere_pictures(directions, np.full((4, 3), 0.8)).images, strict=True):
        write_exr(tmp_path / "stills" / f"{name}.exr", {c: image[..., k] for k, c in enumerate("RGB")}, half=False)
    lights = tuple(Light(name=name, direction=(x, y, z)) for name, (x, y, z) in zip("abcd", directions, strict=True))
    (tmp_path / "known.toml").write_text(format_rig(Rig(lights=lights)))
    return tmp_path / "stills", tmp_path / "known.toml"


@pytest.mark.parametrize("out", ["rig", "rig.lp", "rig.png"])
def test_a_rig_gets_a_name_under_which_it_can_be_read(
    shot: tuple[Path, Path], capsys: pytest.CaptureFixture[str], out: str
) -> None:
    """A list of lights is read for what it is not, and a .png would be its own picture's name."""
    path = shot[0].with_name(out)
    assert main(["calibrate", "matte-sphere", str(shot[0]), "-o", str(path)]) == 2
    assert "expected a name that ends in .toml, such as" in capsys.readouterr().err
    assert not path.exists()


@pytest.mark.parametrize(
    ("circle", "status", "says"),
    [
        ("95.3,71.8,63", 0, "lies 3 pixels from the outline that the pictures show, 95,72,60"),
        ("101,71.8,60", 0, "lies 6 pixels from the outline that the pictures show, 95,72,60"),
        ("110,71.8,60", 1, "lies 15 pixels from the outline that the pictures show, 95,72,60"),
    ],
)
def test_a_circle_beside_the_ball_is_named_and_not_believed(
    shot: tuple[Path, Path], capsys: pytest.CaptureFixture[str], circle: str, status: int, says: str
) -> None:
    rig = shot[0].with_name("rig.toml")
    assert main(["calibrate", "matte-sphere", str(shot[0]), "-o", str(rig), "--circle", circle]) == status
    said = capsys.readouterr().err
    assert says in said
    assert "no matte sphere of one colour" not in said
    if status == 0:
        known = {light.name: light.direction for light in read_rig(shot[1]).lights}
        for light in read_rig(rig).lights:
            assert light.direction is not None
            off = off_deg(np.array(light.direction), np.array(known[light.name]))
            assert off < 3 * (light.error_deg or 0)


def test_a_calibration_that_failed_is_repeated_without_force(
    shot: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    rig = shot[0].with_name("rig.toml")
    words = ["calibrate", "matte-sphere", str(shot[0]), "-o", str(rig)]
    assert main([*words, "--circle", "30,30,20"]) == 1
    assert rig.with_suffix(".png").exists(), "it shows what was tried"
    capsys.readouterr()
    assert main([*words, "--circle", "95.3,71.8,60"]) == 0
    assert main([*words, "--circle", "95.3,71.8,60"]) == 2, "a picture that belongs to a rig stays"
    before = rig.read_bytes(), rig.with_suffix(".png").read_bytes()
    capsys.readouterr()
    assert main([*words, "--circle", "30,30,20", "--force"]) == 1
    assert (rig.read_bytes(), rig.with_suffix(".png").read_bytes()) == before, "and stays where a repetition fails"
    assert f"See {rig.with_suffix('.failed.png')}." in capsys.readouterr().err
    assert rig.with_suffix(".failed.png").exists()
    rig.unlink()
    rig.with_suffix(".png").write_bytes(b"somebody's own")
    assert main(words) == 2


CARD = {"key": (0.4, 0.3), "left": (-0.5, 0.1), "top": (0.0, 0.5), "low": (0.1, -0.4)}


def card_pictures(folder: Path, *, part: tuple[int, int, int, int], grain: float = 0.002) -> Path:
    """Photograph a white card of albedo 0.9, in a part of the picture, before a dark wall; its rig lies beside."""
    folder.mkdir()
    left, top, right, bottom = part
    lights = []
    for n, (name, (x, y)) in enumerate(CARD.items()):
        direction = np.array([x, y, 1.0]) / np.sqrt(x * x + y * y + 1)
        picture = np.full((120, 160), 0.03)
        picture[top:bottom, left:right] = 0.9 * (0.8 - 0.1 * n) * direction[2]
        picture += np.random.default_rng(n).normal(0, grain, picture.shape)
        plane = picture.astype(np.float32)
        write_exr(folder / f"{name}.exr", dict.fromkeys("RGB", plane), half=False)
        lights.append(Light(name=name, direction=(float(direction[0]), float(direction[1]), float(direction[2]))))
    folder.with_suffix(".toml").write_text(format_rig(Rig(lights=tuple(lights))))
    return folder


def strengths_by(rig: Path) -> list[float]:
    """Return the lights' strengths in the order of ``CARD``."""
    found = {light.name: light.intensity[0] for light in read_rig(rig).lights}
    return [found[name] for name in CARD if name in found]


def flat_field_words(folder: Path, out: Path) -> list[str]:
    return ["calibrate", "flat-field", str(folder), "--rig", str(out / "card.toml"), "-o", str(out / "r.toml")]


def test_a_white_card_that_fills_a_part_of_the_picture_is_named_with_its_place(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The median of the picture is the wall's, and was taken for the card's: strengths ten times too small."""
    folder = card_pictures(tmp_path / "card", part=(40, 20, 100, 80))
    words = flat_field_words(folder, tmp_path)
    assert main(words) == 1
    said = capsys.readouterr().err
    assert said.startswith(f"psvideo: {folder}: A part of the picture, about ")
    box = said.partition("about ")[2].partition(" (")[0]
    left, top, right, bottom = map(int, box.split(","))
    assert 40 <= left <= 55
    assert 20 <= top <= 35
    assert 85 <= right <= 100
    assert 65 <= bottom <= 80
    assert main([*words, "--box", box]) == 0
    np.testing.assert_allclose(strengths_by(tmp_path / "r.toml"), [0.8, 0.7, 0.6, 0.5], rtol=0.005)


def test_grain_is_no_falloff_and_a_light_without_a_picture_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = card_pictures(tmp_path / "card", part=(0, 0, 160, 120), grain=0.05)
    (folder / "low.exr").unlink()
    words = flat_field_words(folder, tmp_path)
    assert main(words) == 0
    said = capsys.readouterr().err
    assert "not evenly lit" not in said
    assert "1 of the rig's 4 lights has no picture here and is not in the rig that is written: 'low'" in said
    np.testing.assert_allclose(strengths_by(tmp_path / "r.toml"), [0.8, 0.7, 0.6], rtol=0.01)


@pytest.mark.parametrize("axis", [0, 1], ids=["down", "across"])
def test_a_target_that_is_clipped_where_it_is_brightest_shows_its_median_within_its_error(axis: int) -> None:
    """A third of it is: the median of the others was 5 % low, and 0.02 % claimed where it is brighter to the right."""
    rng = np.random.default_rng(0)
    slope = 1 + 0.15 * np.linspace(-1, 1, (120, 160)[axis]).reshape((-1, 1) if axis == 0 else (1, -1))
    rig = Rig(lights=tuple(Light(name=f"L{n}", direction=(0.0, 0.0, 1.0)) for n in range(2)))
    images = [0.9 * strength * slope + rng.normal(0, 0.003, (120, 160)) for strength in (1.08, 0.8)]
    pictures = light_pictures(rig.names, [np.clip(image, 0, 1).astype(np.float32) for image in images])
    assert pictures.saturated[0].mean() > 0.3
    target = Target(albedo=0.9, normal=np.array([0.0, 0.0, 1.0]), rows=slice(0, 120), cols=slice(0, 160))
    found = measure_flat_field(pictures, rig, target)
    np.testing.assert_allclose([one.intensity[0] for one in found], [1.08, 0.8], rtol=0.001)
    assert all(0.01 < one.intensity_error < 0.03 for one in found), "its parts differ by 15 % each way"


@pytest.mark.parametrize("side", [8, 24, 60])
def test_the_error_of_a_strength_is_what_noise_makes_of_it(side: int) -> None:
    rig = Rig(lights=tuple(Light(name=f"L{n}", direction=(0.0, 0.0, 1.0)) for n in range(60)))
    noise = np.random.default_rng(side).normal(0, 0.01, (60, side, side))
    pictures = light_pictures(rig.names, list((0.5 + noise).astype(np.float32)))
    target = Target(albedo=1.0, normal=np.array([0.0, 0.0, 1.0]), rows=slice(0, side), cols=slice(0, side))
    found = measure_flat_field(pictures, rig, target)
    off = np.sqrt(np.mean([(one.intensity[0] / 0.5 - 1) ** 2 for one in found]))
    assert 0.7 < off / np.median([one.intensity_error for one in found]) < 1.5


def test_a_target_of_a_few_pixels_is_refused() -> None:
    rig = Rig(lights=(Light(name="key", direction=(0.0, 0.0, 1.0)),))
    pictures = light_pictures(["key"], [np.full((40, 40), 0.5, np.float32)])
    target = Target(albedo=0.9, normal=np.array([0.0, 0.0, 1.0]), rows=slice(3, 4), cols=slice(3, 4))
    with pytest.raises(PsvideoError, match="The white target is 1 x 1 pixels: how well it is known cannot be said"):
        measure_flat_field(pictures, rig, target)


def test_what_is_no_white_target_gives_no_strengths(
    shot: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    out = shot[0].with_name("rig.toml")
    assert main(["calibrate", "flat-field", str(shot[0]), "--rig", str(shot[1]), "-o", str(out)]) == 1
    assert "as where the pictures show no white target, or more than it" in capsys.readouterr().err
    assert not out.exists()


def test_rig_and_falloff_are_never_written_to_one_file(
    shot: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    out = str(shot[0].with_name("rig.toml"))
    words = ["calibrate", "flat-field", str(shot[0]), "--rig", str(shot[1]), "-o", out, "--flat", out]
    assert main(words) == 2
    assert "--out and --flat both name" in capsys.readouterr().err


def test_pictures_that_a_rig_knows_nothing_of_are_named_with_the_rig(
    shot: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    (shot[0] / "d.exr").rename(shot[0] / "top.exr")
    out = shot[0].with_name("rig.toml")
    assert main(["calibrate", "flat-field", str(shot[0]), "--rig", str(shot[1]), "-o", str(out)]) == 1
    assert (
        "known.toml: The rig has no light named 'top', which the plan flashes or pictures are"
        in capsys.readouterr().err
    )


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"circle": (float("nan"), 90, 60)}, "`circle` nan: expected"),
        ({"circle": (95, 70, 1e5)}, "`circle` 95,70,100000: is larger than the picture of 200 x 150 pixels"),
        ({"circle": (300, 70, 60)}, "`circle` 300,70,60: is outside of the picture of 200 x 150 pixels"),
        ({"focal_px": float("inf")}, "`focal_px` inf: expected 1 to"),
        ({"albedo": 0.0}, "`albedo` 0: expected a share above 0"),
        ({"albedo": -0.5}, "`albedo` -0.5: expected a share above 0"),
    ],
)
def test_numbers_of_a_matte_sphere_that_cannot_be_meant_are_refused(
    options: dict[str, Any], says: str, shot: tuple[Path, Path], tmp_path: Path
) -> None:
    with pytest.raises(UsageError, match=re.escape(says)):
        matte_sphere(shot[0], out=tmp_path / "rig.toml", **options)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"principal_px": (float("nan"), 3.0), "focal_px": 500.0}, "`principal_px` nan: expected"),
        ({"focal_mm": float("inf"), "sensor_mm": 36.0}, "`focal_mm` inf: expected 0.1 to"),
        ({"focal_mm": 50.0, "sensor_mm": 0.0}, "`sensor_mm` 0: expected 0.1 to"),
        ({"circle": [(float("inf"), 1.0, 1.0)]}, "`circle` inf: expected"),
        ({"radius_mm": float("nan")}, "`radius_mm` nan"),
    ],
)
def test_numbers_of_a_mirror_sphere_that_cannot_be_meant_are_refused(
    options: dict[str, Any], says: str, tmp_path: Path
) -> None:
    with pytest.raises(UsageError, match=re.escape(says)):
        mirror_sphere([tmp_path], out=tmp_path / "rig.toml", **options)


@pytest.mark.parametrize("number", ["led_hz", "led_tolerance_ppm", "zoom", "near_s"])
@pytest.mark.parametrize("value", [float("nan"), float("inf"), -1.0, 1e300])
def test_numbers_of_a_readout_that_cannot_be_meant_are_refused(number: str, value: float, tmp_path: Path) -> None:
    given: dict[str, Any] = {"led_hz": 1000.0, number: value}
    with pytest.raises(UsageError, match=re.escape(f"`{number}` {value:g}: expected")):
        readout([tmp_path], **given)


@pytest.mark.parametrize("text", ["nan,nan,nan,nan", "inf,0,9,9", "0,0,1e400,9"])
def test_a_box_of_no_numbers_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match="expected left,top,right,bottom, numbers in pixels"):
        parse_box(text)


@pytest.mark.parametrize("parse", [partial(parse_seconds, option="--flash"), parse_starts_s])
def test_a_time_without_an_end_is_refused(parse: Callable[[str], object]) -> None:
    with pytest.raises(UsageError, match="1e400"):
        parse("1e400" if parse is parse_starts_s else "1e400s")
