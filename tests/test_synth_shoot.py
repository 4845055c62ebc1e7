"""Whole virtual shoots: what they write is read back as a camera's footage, and the truth beside it fits."""

import dataclasses
import json
import re
import runpy
import subprocess
import sys
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
import setuptools
import tomlkit

import psvideo
from psvideo.cli.app import main
from psvideo.clip import open_clip, read_frames
from psvideo.errors import PsvideoError, UsageError
from psvideo.export.programs.blender_addon import INSTALLED, addon_folder
from psvideo.export.programs.blender_addon import NAME as ADDON
from psvideo.formats.contract import Contract
from psvideo.formats.plan_toml import read_plan
from psvideo.formats.rig_toml import read_rig
from psvideo.synth import expose, read_scene, shoot
from psvideo.synth.camera.curves import CURVES
from psvideo.synth.scene import Scene
from psvideo.synth.scenes import builtin_scene, builtin_scenes, scene_file
from psvideo.synth.shotplan import true_clock, true_plan, true_rig
from psvideo.synth.stage import set_stage

ROOT = Path(__file__).resolve().parents[1]
SCENES = sorted((ROOT / "data_synth").glob("*.toml"))

SCENE = """
schema = "psvideo-scene/1"
name = "ball"
frames = 8
seed = 5
[camera]
width_px = 48
height_px = 36
fps = 100
shutter_deg = 360.0
readout_s = 0.008
width_m = 1.4
[strobe]
flash_s = 0.001
clock_offset_ppm = 60.0
[[light]]
name = "key"
direction = [0.3, 0.3, 0.9]
[[light]]
name = "left"
direction = [-0.4, 0.1, 0.9]
[[object]]
mesh = "sphere"
albedo = [0.8, 0.5, 0.3]
[[object]]
mesh = "plane"
scale = 4.0
position_m = [0.0, 0.0, -1.0]
albedo = { pattern = "checker", colour = 0.6, second = 0.3, size_m = 0.2 }
"""


def write_scene(folder: Path, **changes: object) -> Path:
    """Write the small scene with keys changed: ``camera__bits=8`` sets bits in [camera]."""
    document = tomlkit.parse(SCENE)
    for place, value in changes.items():
        *tables, key = place.split("__")
        table = document
        for name in tables:
            table = table.setdefault(name, tomlkit.table())
        table[key] = value
    path = folder / "scene.toml"
    path.write_text(tomlkit.dumps(document))
    return path


def film(folder: Path, **changes: object) -> Path:
    return shoot(write_scene(folder, **changes), folder / "clip").path


def exr(path: Path) -> np.ndarray:
    channels = OpenEXR.File(str(path)).channels()
    return np.asarray(next(iter(channels.values())).pixels, np.float32)


def expected_frames(clip: Path) -> np.ndarray:
    """Expose the written plates again, from the truth files alone."""
    truth = json.loads((clip / "truth" / "timing.json").read_text())
    scene = read_scene(clip.parent / "scene.toml")
    plates = {row["slot"]: exr(clip / "truth" / row["plate"]) for row in truth["flashes"] if "plate" in row}
    return expose(plates, true_plan(scene), frames=scene.frames, clock=true_clock(scene)).frames


@pytest.mark.parametrize(
    ("kind", "camera", "step"),
    [
        ("png16", {}, 1 / 3800),
        ("png16", {"bits": 16, "black_level": 0.0}, 1 / 60_000),
        ("png8", {"bits": 8}, 1 / 200),
        ("png16", {"colour": "grey"}, 1 / 3800),
        ("tif", {"bits": 14}, 1 / 15_000),
        ("exr", {"bits": 14}, 1 / 3_000),
        ("dng", {"cfa": "GBRG", "bits": 14, "white_level": 15_000.0}, 1 / 13_000),
        ("png16", {"cfa": "BGGR"}, 1 / 3800),
        ("dpx", {"bits": 10}, 1 / 900),
        ("dpx", {"bits": 16}, 1 / 60_000),
        ("png16", {"transfer": "srgb", "bits": 16}, 1 / 20_000),
        ("tif", {"transfer": "rec709", "bits": 14}, 1 / 4_000),
        ("png16", {"transfer": "slog3", "bits": 16}, 1 / 5_000),
        ("png16", {"transfer": "logc3", "bits": 16}, 1 / 5_000),
    ],
)
def test_footage_of_every_kind_reads_back_as_the_light_that_fell(
    tmp_path: Path, kind: str, camera: dict[str, Any], step: float
) -> None:
    clip = film(tmp_path, output__kind=kind, **{f"camera__{key}": value for key, value in camera.items()})
    opened = open_clip(clip)
    light = expected_frames(clip)
    cfa = camera.get("cfa")
    assert opened.cfa == cfa
    frames = [frame.image for frame in read_frames(opened)]
    assert len(frames) == 8
    for n, image in enumerate(frames):
        expected = light[n]
        if cfa:
            places = np.arange(36)[:, None] % 2 * 2 + np.arange(48)[None, :] % 2
            channel = np.array(["RGB".index(name) for name in cfa])[places]
            expected = np.take_along_axis(expected, channel[..., None], axis=2)[..., 0]
        assert image.shape == expected.shape
        np.testing.assert_allclose(image, expected, atol=step)


def test_a_clip_lies_as_a_camera_would_leave_it_and_the_truth_fits(tmp_path: Path) -> None:
    clip = film(tmp_path, output__dropped=[3], output__first_number=118)
    scene = read_scene(tmp_path / "scene.toml")
    assert sorted(path.name for path in clip.iterdir()) == [".written", "frames", "plan.toml", "rig.toml", "truth"]
    numbers = [118, 119, 120, 122, 123, 124, 125]
    assert sorted(path.name for path in (clip / "frames").iterdir()) == [f"ball.{n:04d}.png" for n in numbers]
    plan, rig = read_plan(clip / "plan.toml"), read_rig(clip / "rig.toml")
    assert dataclasses.replace(plan, camera=true_plan(scene).camera) == true_plan(scene)
    assert rig == true_rig(scene)
    truth = json.loads((clip / "truth" / "timing.json").read_text())
    assert truth["row_time_s"] == pytest.approx(0.008 / 36)
    assert {row["light"] for row in truth["flashes"]} == {"key", "left", None}
    assert all((clip / "truth" / row["plate"]).is_file() for row in truth["flashes"] if "plate" in row)
    assert all("plate" in row for row in truth["flashes"] if row["complete"] and row["light"])
    said = json.loads((clip / "truth" / "scene.json").read_text())
    assert said["clock_offset_ppm"] == 60.0
    assert said["phase_s"] == true_clock(scene).phase_s
    assert said["dropped_frames"] == [3]


def test_true_plates_are_albedo_times_intensity_times_the_cosine(tmp_path: Path) -> None:
    clip = film(tmp_path)
    normals, albedo = exr(clip / "truth" / "normals.exr"), exr(clip / "truth" / "albedo.exr")
    assert exr(clip / "truth" / "mask.exr").min() == 1.0
    rig = {light.name: light for light in read_rig(clip / "rig.toml").lights}
    for row in json.loads((clip / "truth" / "timing.json").read_text())["flashes"]:
        if "plate" in row:
            light = rig[row["light"]]
            cosine = np.maximum(normals.astype(float) @ np.array(light.direction), 0.0)[..., None]
            plate = exr(clip / "truth" / row["plate"])
            lit = plate.any(axis=-1)
            np.testing.assert_allclose(plate[lit], (albedo * cosine * light.intensity)[lit], atol=2e-6)
            assert lit.mean() > 0.75


def test_a_moving_scene_has_its_surface_at_every_flash(tmp_path: Path) -> None:
    text = SCENE.replace("albedo = [0.8, 0.5, 0.3]", "albedo = 0.8\nmotion = { velocity_m_per_s = [3.0, 0.0, 0.0] }")
    (tmp_path / "scene.toml").write_text(text)
    clip = shoot(tmp_path / "scene.toml", tmp_path / "clip").path
    rows = [row for row in json.loads((clip / "truth" / "timing.json").read_text())["flashes"] if "plate" in row]
    middles = []
    for row in rows:
        name = Path(row["plate"]).name
        mask = np.abs(exr(clip / "truth" / "albedo" / name)[..., 0] - 0.8) < 1e-6
        assert (exr(clip / "truth" / "mask" / name) == 1).all()
        middles.append(np.argwhere(mask)[:, 1].mean())
        normal = exr(clip / "truth" / "normals" / name)[18, round(middles[-1])]
        assert normal[2] > 0.99
    time_s = [row["start_s"] + 0.5 * row["duration_s"] for row in rows]
    np.testing.assert_allclose(middles, 23.5 + np.multiply(time_s, 3.0) / (1.4 / 48), atol=0.5)


def test_ambient_light_shows_a_moving_scene_at_the_middle_of_the_frame(tmp_path: Path) -> None:
    text = SCENE.replace("albedo = [0.8, 0.5, 0.3]", "albedo = 0.8\nmotion = { velocity_m_per_s = [3.0, 0.0, 0.0] }")
    text = text[: text.rindex("[[object]]")] + "[ambient]\nlevel = 0.2\n"
    (tmp_path / "scene.toml").write_text(text)
    ambient = set_stage(read_scene(tmp_path / "scene.toml"), tmp_path).ambient()
    assert ambient is not None
    for n in (0, 3):
        middle_s = n * 0.01 + 0.5 * (0.008 * 35 / 36 + 0.01)
        assert np.argwhere(ambient(n)[..., 0])[:, 1].mean() == pytest.approx(
            23.5 + 3.0 * middle_s / (1.4 / 48), abs=0.5
        )


def test_a_light_that_flashes_twice_has_its_intensity_at_its_first_length(tmp_path: Path) -> None:
    flashes = [{"lights": {"key": 1.0}, "duration_s": d} for d in (0.0006, 0.0018)] + [
        {"lights": {"left": 0.5}, "duration_s": 0.001}
    ]
    clip = film(tmp_path, strobe__flash=flashes)
    assert [light.reference_duration_s for light in read_rig(clip / "rig.toml").lights] == [0.0006, 0.001]
    truth = json.loads((clip / "truth" / "timing.json").read_text())["flashes"]
    plates = {row["slot"]: exr(clip / "truth" / row["plate"]) for row in truth if "plate" in row}
    np.testing.assert_allclose(plates[1], 3.0 * plates[0], rtol=1e-6)


def test_motion_inside_a_flash_blurs_it_over_the_way_it_goes_where_asked(tmp_path: Path) -> None:
    """A white square of 0.4 m that goes 0.1 m while the flash lasts: its plate's edges are ramps of 0.1 m."""
    square = 'mesh = "plane"\nscale = 0.4\nalbedo = 0.8\nmotion = { velocity_m_per_s = [100.0, 0.0, 0.0] }'
    text = SCENE.replace('mesh = "sphere"\nalbedo = [0.8, 0.5, 0.3]', square + "\nposition_m = [-2.0, 0.0, 0.0]")
    text = (
        text[: text.rindex("[[object]]")].replace("frames = 8", "frames = 5").replace("width_m = 1.4", "width_m = 2.4")
    )
    ramps_px = []
    for samples in (1, 64):
        path = tmp_path / f"scene{samples}.toml"
        path.write_text(text.replace("seed = 5", f"seed = 5\nmotion_samples = {samples}"))
        clip = shoot(path, tmp_path / f"clip{samples}").path
        rows = [exr(file)[18, :, 0] for file in sorted((clip / "truth" / "plates").iterdir())]
        whole = [row for row in rows if row.any() and not (row[0] or row[-1])]
        assert whole
        ramps_px.append([np.sum((row > 0) & (row < row.max() * 0.999)) / 2 for row in whole])
    assert set(ramps_px[0]) == {0}
    np.testing.assert_allclose(ramps_px[1], 0.1 / (2.4 / 48), atol=1.0)


def test_the_seed_decides_every_byte(tmp_path: Path) -> None:
    keys = {"camera__full_well_e": 5000.0, "camera__read_e": 4.0, "strobe__jitter_s": 1e-6, "strobe__phase_s": 0.002}
    contents = []
    for k, seed in enumerate((5, 5, 6)):
        folder = tmp_path / str(k)
        folder.mkdir()
        clip = film(folder, seed=seed, **keys)
        files = sorted(path for path in clip.rglob("*") if path.is_file())
        contents.append({path.relative_to(clip): path.read_bytes() for path in files})
    assert contents[0] == contents[1]
    assert contents[0].keys() == contents[2].keys()
    assert contents[0] != contents[2]


def test_the_plan_may_claim_other_than_the_truth(tmp_path: Path) -> None:
    keys: dict[str, object] = {
        "plan__fps": 101,
        "plan__readout_s": "unknown",
        "plan__tails": False,
        "strobe__fall_s": 5e-5,
    }
    clip = film(tmp_path, **keys)
    plan = read_plan(clip / "plan.toml")
    assert (plan.camera.fps, plan.camera.readout_s, plan.fall_s) == (Fraction(101), None, 0.0)
    assert plan.camera.shutter_deg == pytest.approx(360.0)
    said = json.loads((clip / "truth" / "scene.json").read_text())
    assert (said["fps"], said["readout_s"], said["fall_s"]) == ("100", 0.008, 5e-5)


def test_too_bright_a_scene_is_warned_of(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write_scene(tmp_path, ambient={"level": 1.5})
    assert main(["synth", str(path), "-o", str(tmp_path / "clip")]) == 0
    assert "samples saturate" in capsys.readouterr().err


def test_an_existing_clip_is_replaced_only_by_force(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    clip = film(tmp_path)
    (clip / "mine.txt").write_text("precious")
    with pytest.raises(UsageError, match="exists already"):
        shoot(tmp_path / "scene.toml", clip)
    assert main(["synth", str(tmp_path / "scene.toml"), "-o", str(clip)]) == 2
    assert main(["synth", str(tmp_path / "scene.toml"), "-o", str(clip), "--force"]) == 2
    assert "mine.txt" in capsys.readouterr().err
    assert (clip / "mine.txt").read_text() == "precious"
    (clip / "mine.txt").unlink()
    assert main(["synth", str(tmp_path / "scene.toml"), "-o", str(clip), "--force", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert (said["frames"], said["path"]) == (8, str(clip))


def test_footage_is_never_replaced_by_a_virtual_clip(tmp_path: Path) -> None:
    clip = film(tmp_path)
    (clip / "truth" / "scene.json").unlink()
    with pytest.raises(UsageError, match="was not written by psvideo synth"):
        shoot(tmp_path / "scene.toml", clip, force=True)
    assert len(list((clip / "frames").iterdir())) == 8


def test_a_full_disk_is_one_paragraph_and_leaves_nothing(tmp_path: Path) -> None:
    path = write_scene(tmp_path, camera__width_px=400, camera__height_px=300)
    limited = (
        "import resource, signal, sys; signal.signal(signal.SIGXFSZ, signal.SIG_IGN); "
        "resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000)); "
        f"from psvideo.cli.app import main; sys.exit(main(['synth', {str(path)!r}, '-o', {str(tmp_path / 'clip')!r}]))"
    )
    run = subprocess.run([sys.executable, "-c", limited], capture_output=True, text=True, check=False)
    assert run.returncode == 1
    assert "cannot be written" in run.stderr
    assert "Traceback" not in run.stderr
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["scene.toml"]


def test_a_shoot_that_fails_leaves_nothing_behind(tmp_path: Path) -> None:
    path = write_scene(tmp_path, strobe__mode="synced", strobe__flash_s=0.005)
    with pytest.raises(PsvideoError, match="all rows of 'virtual camera' are open together"):
        shoot(path, tmp_path / "clip")
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["scene.toml"]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('name = "ball"', 'naem = "ball"', "unknown key 'naem': did you mean 'name'"),
        ("flash_s = 0.001", "flesh_s = 0.001", "unknown key 'strobe.flesh_s': did you mean 'flash_s'"),
        ("albedo = [0.8, 0.5, 0.3]", "albedo = { patern = 1 }", "patern"),
        ("fps = 100", "fps = 0", "rate above 0"),
        ("readout_s = 0.008", "readout_s = 0.02", "longer than the frame period of 0.01 s"),
        ("width_px = 48", 'width_px = "48"', "camera.width_px"),
        ("shutter_deg = 360.0", "shutter_deg = 400.0", "less than or equal to 360"),
        ("direction = [0.3, 0.3, 0.9]", "direction = [0.3, 0.3]", r"light\[1\].direction"),
        ("direction = [0.3, 0.3, 0.9]", "", "needs direction .distant. or position_m"),
        ('name = "left"', 'name = "key"', "two lights have the name 'key'"),
        ("frames = 8", 'frames = 8\n[output]\n[[other_camera]]\nname = "virtual camera"', "two cameras have the name"),
        ('mesh = "sphere"', 'mesh = "spere"', "spere"),
        ("width_m = 1.4", 'view = "perspective"', "a perspective view needs focal_px"),
        ("width_m = 1.4", 'cfa = "RGBG"', "camera.cfa"),
        ('schema = "psvideo-scene/1"', 'schema = "psvideo-scene/2"', "newer"),
        ('schema = "psvideo-scene/1"', "", "'schema' is missing"),
        ("frames = 8", "frames = 0", "frames"),
        ("frames = 8", "frames = 8\n[output]\ndropped = [9]", "output.dropped names frame 9"),
        ("frames = 8", 'frames = 8\n[output]\nkind = "dng"', "expected camera.cfa"),
        ("frames = 8", 'frames = 8\n[output]\nkind = "jpg"', "output.kind"),
        ("[strobe]", "[strobe]\nflash = [{ lights = { kee = 1.0 }, duration_s = 0.001 }]", "strobe.flash lights 'kee'"),
        ("seed = 5", "seed = five", "not a TOML file"),
    ],
)
def test_a_faulty_scene_is_one_paragraph_that_names_the_key(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, message: str
) -> None:
    assert old in SCENE
    path = tmp_path / "bad.toml"
    text = SCENE.replace(old, new, 1)
    if "[output]" in new:  # a table in the middle would swallow the keys that follow
        text = SCENE.replace(old, new.split("\n")[0], 1) + "\n".join(new.split("\n")[1:])
    path.write_text(text)
    with pytest.raises(PsvideoError, match=message) as fault:
        shoot(path, tmp_path / "clip")
    assert "\n" not in str(fault.value)
    assert main(["synth", str(path), "-o", str(tmp_path / "clip")]) == 1
    assert "Traceback" not in capsys.readouterr().err
    assert not (tmp_path / "clip").exists()


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_shipped_scenes_are_sound(path: Path) -> None:
    scene = read_scene(path)
    plan, rig = true_plan(scene), true_rig(scene)
    assert plan.lights == rig.names
    assert (scene.frames * plan.camera.frame_period_s > plan.cycle_s) == (plan.dark_code == 0)
    directions = np.array([light.direction for light in rig.lights])
    assert np.linalg.cond(directions) < 4


def test_the_shipped_scenes_are_found_by_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for path in SCENES:
        assert scene_file(Path(path.stem)) == builtin_scene(path.stem)
        assert builtin_scene(path.stem).read_bytes() == path.read_bytes()
    assert set(builtin_scenes()) == {path.stem for path in SCENES} >= {"bust", "fan", "still_life", "sphere", "gloss"}
    with pytest.raises(PsvideoError, match=r"bist: is neither a file nor .*those are bust, cameras, colour"):
        scene_file(Path("bist"))


def test_a_file_goes_before_a_shipped_scene_of_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("bust").write_text(SCENE)
    assert scene_file(Path("bust")) == Path("bust")
    assert scene_file(Path("other/bust")) == Path("other/bust"), "only a bare name is looked up"
    assert scene_file(Path("bust.toml")) == Path("bust.toml")


def test_a_built_package_holds_scenes_and_add_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    ran: dict[str, Any] = {}
    monkeypatch.setattr(setuptools, "setup", lambda **given: ran.update(given))
    runpy.run_path(str(ROOT / "setup.py"))
    built = setuptools.Distribution(
        {"script_name": "setup.py", "packages": ["psvideo"], "package_dir": {"": "src"}, **ran}
    )
    command = built.get_command_obj("build_py")
    command.build_lib = str(tmp_path)
    command.ensure_finalized()
    command.run()
    copies = {path.name: path.read_bytes() for path in (tmp_path / "psvideo" / "synth" / "scenes").iterdir()}
    assert copies == {path.name: path.read_bytes() for path in SCENES}
    assert {str(tmp_path / "psvideo" / "synth" / "scenes" / name) for name in copies} <= set(command.get_outputs())
    installed = tmp_path / "psvideo" / INSTALLED.relative_to(Path(psvideo.__file__).parent)
    addon, source = (one / ADDON for one in (installed, addon_folder().parent))
    assert {path.name: path.read_bytes() for path in addon.iterdir()} == {
        path.name: path.read_bytes() for path in source.iterdir() if path.is_file()
    }


@pytest.mark.parametrize("name", sorted(CURVES))
def test_transfer_curves_are_undone_by_their_inverse(name: str) -> None:
    curve = CURVES[name]
    light = np.linspace(-0.005, 1.0, 4001)
    np.testing.assert_allclose(curve.decode(curve.encode(light)), light, atol=2e-6)
    assert (np.diff(curve.encode(light)) > 0).all()


def test_transfer_curves_meet_their_makers_figures() -> None:
    code = {name: float(curve.encode(np.array(0.18))) for name, curve in CURVES.items()}
    assert code["slog3"] * 1023 == pytest.approx(420, abs=0.01)
    assert code["logc3"] == pytest.approx(0.391, abs=5e-4)
    assert code["srgb"] == pytest.approx(0.4613561, abs=1e-6)
    assert code["rec709"] == pytest.approx(0.4090077, abs=1e-6)
    assert CURVES["slog3"].zero * 1023 == pytest.approx(95, abs=0.01)


def test_every_key_of_the_scene_file_is_documented() -> None:
    text = (ROOT / "docs" / "synth.md").read_text()
    tables: list[type[Contract]] = [Scene]
    while tables:
        table = tables.pop()
        for key, field in table.model_fields.items():
            assert re.search(rf"[`\[{{ ,]{field.alias or key}[`\] =]", text), key
            inner = [field.annotation, *getattr(field.annotation, "__args__", ())]
            tables += [kind for kind in inner if isinstance(kind, type) and issubclass(kind, Contract)]
