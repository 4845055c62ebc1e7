"""Beauty at 24 a second with an open shutter, whole runs against the virtual shoot rendered with a true shutter."""

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import OpenEXR
import tomlkit

import psvideo as ps
from psvideo.synth.lamps.emission import Emission
from psvideo.synth.scene import read_scene
from psvideo.synth.scenes import builtin_scene
from psvideo.synth.stage import Stage, set_stage
from psvideo.synth.subject.shading import flash_plate
from psvideo.synth.truth import as_seen

FPS, BAR_DB = 24, 35.0
VIEWS = 21
"""Instants at which the truth is rendered while the shutter is open."""
EDGE_PX = 6
RAYS = 3
"""Points a side that a pixel which is seen whole sees. A camera's pixels see their area; seen at one point, wires that
are thinner than a pixel, and their shadows, flicker as no camera shows them."""


class Line(NamedTuple):
    """Peak signal to noise of the beauty plates, the mean over instants, and what stands beside it."""

    scene: str
    shutter_deg: int
    instants: int
    open_db: str
    left_sharp_db: str
    rounds_averaged_db: str
    bar_db: float
    met: bool


SCENES: dict[str, tuple[str, int, dict[str, Any], int]] = {
    "bust, turning 30 degrees a second": ("bust", 192, {"axis": [0.0, 1.0, 0.0], "spin_deg_per_s": 30.0}, 1),
    "fan, 20 turns a minute": ("fan", 144, {"axis": [0.0, 0.0, 1.0], "spin_deg_per_s": 120.0}, 1),
    "fan, 120 turns a minute": ("fan", 144, {"axis": [0.0, 0.0, 1.0], "spin_deg_per_s": 720.0}, 1),
    "fan, 720 turns a minute": ("fan", 144, {"axis": [0.0, 0.0, 1.0], "spin_deg_per_s": 4320.0}, 1),
    "fan, pixels seen whole, 20 turns": ("fan", 144, {"axis": [0.0, 0.0, 1.0], "spin_deg_per_s": 120.0}, RAYS),
    "fan, pixels seen whole, 60 turns": ("fan", 144, {"axis": [0.0, 0.0, 1.0], "spin_deg_per_s": 360.0}, RAYS),
    "fan, pixels seen whole, 120 turns": ("fan", 144, {"axis": [0.0, 0.0, 1.0], "spin_deg_per_s": 720.0}, RAYS),
}


def small_scene(name: str, width_px: int, motion: dict[str, Any], folder: Path, *, rays: int = 1) -> Path:
    """Write a scene of the repository smaller, without ambient light, its first object moving; ``rays`` a side see a
    pixel."""
    scene = tomlkit.parse(builtin_scene(name).read_text(encoding="utf-8")).unwrap()
    camera = scene["camera"]
    camera["height_px"] = round(camera["height_px"] * width_px / camera["width_px"])
    camera["width_px"] = width_px
    camera["rays"] = rays
    scene["frames"] = 24
    scene["ambient"] = {"level": 0.0}
    scene["object"][0]["motion"] = motion
    path = folder / f"{name}.toml"
    path.write_text(tomlkit.dumps(scene), encoding="utf-8")
    return path


def rows() -> Iterator[Line]:
    """Film every scene, and open the shutter by 180 degrees."""
    for what, (name, width_px, motion, rays) in SCENES.items():
        with tempfile.TemporaryDirectory() as temporary:
            folder = Path(temporary)
            scene = small_scene(name, width_px, motion, folder, rays=rays)
            clip = ps.shoot(scene, folder / "clip").path
            stage = set_stage(read_scene(scene), builtin_scene(name).parent)
            sharp = beauties(clip, folder / "round", fps="round")
            yield _line(what, 180, stage, clip, folder, sharp)


def _line(what: str, angle: int, stage: Stage, clip: Path, folder: Path, rounds: dict[float, np.ndarray]) -> Line:
    found = beauties(clip, folder / f"open{angle}", fps=FPS, shutter=angle)
    plain = beauties(clip, folder / f"sharp{angle}", fps=FPS)
    gained: list[tuple[float, float, float]] = []
    for time_s, image in found.items():
        open_s = angle / 360 / FPS
        views = [lit_at(stage, time_s + open_s * ((n + 0.5) / VIEWS - 0.5)) for n in range(VIEWS)]
        truth = np.mean(views, axis=0)
        within = [one for at_s, one in rounds.items() if abs(at_s - time_s) <= 0.5 * open_s]
        nearest = min(rounds, key=lambda at_s: abs(at_s - time_s))
        mean = np.mean(within or [rounds[nearest]], axis=0)
        gained.append((_psnr_db(image, truth), _psnr_db(plain[time_s], truth), _psnr_db(mean, truth)))
    blurred, sharp, averaged = np.mean(gained, axis=0)
    return Line(
        scene=what,
        shutter_deg=angle,
        instants=len(found),
        open_db=f"{blurred:.1f}",
        left_sharp_db=f"{sharp:.1f}",
        rounds_averaged_db=f"{averaged:.1f}",
        bar_db=BAR_DB,
        met=bool(blurred >= BAR_DB and blurred > averaged),
    )


def beauties(clip: Path, out: Path, **options: Any) -> dict[float, np.ndarray]:
    """Run, and return the beauty plates by their instants."""
    report = ps.normals(clip, rig=clip / "rig.toml", out=out, aov=["beauty"], fill=False, **options)
    files = sorted((out / "beauty").iterdir())
    pictures = [np.asarray(OpenEXR.File(str(file)).channels()["RGB"].pixels, np.float32) for file in files]
    return {one.time_s: picture for one, picture in zip(report.instants, pictures, strict=True)}


def lit_at(stage: Stage, time_s: float) -> np.ndarray:
    """Return the scene under all lights at once, each as strong as in its flash."""
    flash = next(one for one in stage.plan.flashes if one.lit)
    powers = dict.fromkeys(stage.plan.lights, 1.0)
    view = stage.view(time_s)
    image = flash_plate(view, stage.rig, powers, flash.duration_s, Emission(rise_s=0.0, fall_s=0.0))
    return as_seen(image, stage.scene.camera.channels)


def _psnr_db(image: np.ndarray, truth: np.ndarray) -> float:
    inner = np.s_[EDGE_PX:-EDGE_PX, EDGE_PX:-EDGE_PX]
    return float(10 * np.log10(truth[inner].max() ** 2 / np.mean((image - truth)[inner] ** 2)))
