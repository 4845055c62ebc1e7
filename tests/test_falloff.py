"""A lens that darkens towards the corners: measured on a white card, taken off in a run of normals."""

from pathlib import Path

import cv2
import numpy as np
import OpenEXR
import pytest

from psvideo.cli.app import main
from psvideo.errors import PsvideoError
from psvideo.formats.flat_toml import read_falloff
from psvideo.formats.rig_toml import read_rig

HIGH, WIDE = 90, 120
WAYS = {"key": (0.5, 0.2, 0.84), "left": (-0.5, 0.3, 0.81), "low": (0.1, -0.55, 0.83), "top": (0.0, 0.6, 0.8)}
STRENGTH = {"key": 0.9, "left": 0.8, "low": 0.7, "top": 1.0}
PLAN = """schema = "psvideo-plan/1"
[camera]
width_px = 120
height_px = 90
fps = 24
transfer = "linear"
[strobe]
mode = "synced"
"""


def vignette(light: str) -> np.ndarray:
    """The lens darkens the corners by half; the key lamp is narrower, too, and falls off to the right."""
    x, y = np.meshgrid((np.arange(WIDE) - 59.5) / 60, (np.arange(HIGH) - 44.5) / 60)
    lens = 1 / (1 + 0.32 * (x**2 + y**2)) ** 2
    return lens * (1 - 0.2 * x) if light == "key" else lens


def film(folder: Path, normals: np.ndarray, albedo: float) -> Path:
    folder.mkdir()
    flashes = "".join(f"[[strobe.flash]]\nlights = {{ {light} = 1.0 }}\nduration_s = 0.001\n" for light in WAYS)
    (folder / "plan.toml").write_text(PLAN + flashes)
    rng = np.random.default_rng(0)
    for n, (light, way) in enumerate(WAYS.items()):
        direction = np.array(way) / np.linalg.norm(way)
        shade = albedo * STRENGTH[light] * np.maximum(normals @ direction, 0) * vignette(light)
        noisy = np.clip(shade + rng.normal(0, 5e-4, shade.shape), 0, 1)
        cv2.imwrite(str(folder / f"shot.{n + 1:04d}.png"), np.round(noisy * 65535).astype(np.uint16))
    return folder


def flat_card() -> np.ndarray:
    return np.broadcast_to([0.0, 0.0, 1.0], (HIGH, WIDE, 3))


def waves() -> np.ndarray:
    """A surface of slopes up to half, over all of the picture."""
    x, y = np.meshgrid(np.arange(WIDE) / 9, np.arange(HIGH) / 7)
    slopes = np.stack([0.5 * np.sin(x), 0.5 * np.cos(y), np.ones_like(x)], axis=-1)
    normals: np.ndarray = slopes / np.linalg.norm(slopes, axis=-1, keepdims=True)
    return normals


def rig_file(path: Path) -> Path:
    lights = "".join(f'[[light]]\nname = "{name}"\ndirection = {list(way)}\n' for name, way in WAYS.items())
    path.write_text('schema = "psvideo-rig/1"\n' + lights)
    return path


def normals_error(out: Path, truth: np.ndarray) -> float:
    file = next((out / "normals").iterdir())
    found = OpenEXR.File(str(file)).channels()["RGB"].pixels.astype(float)
    return float(np.degrees(np.arccos(np.clip((found * truth).sum(axis=-1), -1, 1))).mean())


def test_vignetting_measured_on_a_card_is_taken_off_in_normals(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    card, scene = film(tmp_path / "card", flat_card(), 0.9), film(tmp_path / "scene", waves(), 0.8)
    bare, rig, flat = rig_file(tmp_path / "bare.toml"), tmp_path / "rig.toml", tmp_path / "flat.toml"
    words = ["calibrate", "flat-field", str(card), "--rig", str(bare), "-o", str(rig)]
    assert main(words) == 0
    assert "--flat flat.toml" in " ".join(capsys.readouterr().err.split()), "falloff that nothing corrects is warned of"
    assert main([*words, "--force", "--flat", str(flat)]) == 0
    intensities = np.array([light.intensity[0] for light in read_rig(rig).lights])
    np.testing.assert_allclose(intensities[1:] / intensities[1], [1, 0.7 / 0.8, 1 / 0.8], rtol=0.01)
    field = read_falloff(flat, width_px=WIDE, height_px=HIGH).field("key")
    shape = vignette("key") / vignette("key").mean()
    assert np.abs(field / field.mean() / shape - 1).max() < 0.02
    run = ["normals", str(scene), "--rig", str(rig), "-q", "-o"]
    assert main([*run, str(tmp_path / "without")]) == 0
    assert main([*run, str(tmp_path / "with"), "--flat", str(flat)]) == 0
    without, with_flat = (normals_error(tmp_path / name, waves()) for name in ("without", "with"))
    assert with_flat < 0.5
    assert without > 4 * with_flat


def test_a_flat_field_of_another_size_or_without_a_light_is_refused(tmp_path: Path) -> None:
    card, flat = film(tmp_path / "card", flat_card(), 0.9), tmp_path / "flat.toml"
    rig = rig_file(tmp_path / "rig.toml")
    words = ["calibrate", "flat-field", str(card), "--rig", str(rig), "-o", str(tmp_path / "measured.toml")]
    assert main([*words, "--flat", str(flat)]) == 0
    with pytest.raises(PsvideoError, match=r"120 x 90.*60 x 45"):
        read_falloff(flat, width_px=60, height_px=45)
    with pytest.raises(PsvideoError, match="no light 'rim'"):
        read_falloff(flat, width_px=WIDE, height_px=HIGH).field("rim")
