"""How strong lights are: from a white target, a card, or a matte scene under lights of known directions."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from angles import angles_deg
from pictures_of_lights import HIGH, WIDE, Array, sphere_pictures, ways

import psvideo as ps
from psvideo.calibrate.cho2020 import measure_strengths
from psvideo.calibrate.flat_field import measure_flat_field, with_intensities
from psvideo.calibrate.light_pictures import LightPictures, light_pictures
from psvideo.calibrate.white_target import Target
from psvideo.cli.app import main
from psvideo.errors import PsvideoError
from psvideo.formats.exr_files import write_exr
from psvideo.formats.rig_toml import format_rig, read_rig
from psvideo.model.irradiance.ground import ground_of
from psvideo.model.rig import Light, Rig
from psvideo.runs.calibrate.flat_field import flat_field, white_target

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
    assert angles_deg(np.array([light.direction for light in written]), directions).max() < 1e-3
    assert main(words) == 2, "a rig is not replaced without --force"
    assert main([*words, "--force"]) == 0
    assert "5 lights written; intensities are relative" in capsys.readouterr().out


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
