"""Small filmed clips, and the bytes that runs of them leave."""

import itertools
import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from bytes_of_files import digest_of_results
from numpy.typing import NDArray

import psvideo as ps
from psvideo.model.plan import Plan
from psvideo.model.rig import Rig
from psvideo.model.rows.shutter import Pulse, row_weights

RIG = """
schema = "psvideo-rig/1"
light = [
  { name = "a", direction = [0.53, 0.0, 0.848], intensity = 1.0 },
  { name = "b", direction = [-0.527, 0.105, 0.843], intensity = 1.0 },
  { name = "c", direction = [0.105, 0.527, 0.843], intensity = 1.0 },
]
"""
PLAN = """
schema = "psvideo-plan/1"
[camera]
name = "small"
width_px = {width}
height_px = {height}
fps = 100
shutter_deg = {shutter_deg}
readout_s = 0.0097
transfer = "linear"
black_level = 0
white_level = 65535
[strobe]
mode = "rolling"
dark_every = {dark_every}
fall_s = {fall_s}
flash = [
{dark}
  {{ lights = {{ a = 1.0 }}, duration_s = 0.001 }},
  {{ lights = {{ b = 1.0 }}, duration_s = 0.001 }},
  {{ lights = {{ c = 1.0 }}, duration_s = 0.001 }},
]
"""
HEIGHT, WIDTH = 36, 48


def filmed(
    folder: Path,
    *,
    frames: int = 250,
    shutter_deg: float = 360,
    marker: bool = True,
    dark_every: int = 1,
    speed_px: float = 0.0,
    fall_s: float = 0.0,
) -> Path:
    """Film a ball that crosses the picture, ``speed_px`` pixels a frame, under three lights and some ambient light."""
    clip = folder / "clip"
    clip.mkdir()
    dark = "  { lights = {}, duration_s = 0.001 }," if marker else ""
    text = PLAN.format(
        shutter_deg=shutter_deg, dark_every=dark_every, dark=dark, width=WIDTH, height=HEIGHT, fall_s=fall_s
    )
    (clip / "plan.toml").write_text(text, encoding="utf-8")
    (clip / "rig.toml").write_text(RIG, encoding="utf-8")
    plan, rig = ps.read_plan(clip / "plan.toml"), ps.read_rig(clip / "rig.toml")
    rng = np.random.default_rng(3)
    pictures = np.full((frames, HEIGHT, WIDTH), 0.05) * (1 + 0.1 * np.sin(np.arange(frames) / 40))[:, None, None]
    time_s, slots = 0.003, [slot for one in range(plan.dark_every) for slot in _round(plan, one)]
    for slot in itertools.cycle(slots):
        flash = plan.flashes[slot]
        if time_s > frames / 100:
            break
        for name in flash.lights:
            first = int(time_s * 100) - 3
            near = range(max(first, 0), min(first + 6, frames))
            lit = Pulse(fall_s=fall_s)
            seen = row_weights(plan.camera, np.array([time_s]), np.array([flash.duration_s]), frames=near, pulse=lit)[0]
            pictures[near.start : near.stop] += 0.6 * seen[..., None] * _ball(rig, name, time_s * 100 * speed_px)
        time_s += flash.duration_s + plan.dark_s
    pictures += rng.normal(0, 0.002, pictures.shape)
    for number, picture in enumerate(pictures, 1):
        codes = np.clip(np.round(picture * 65535), 0, 65535).astype(np.uint16)
        cv2.imwrite(str(clip / f"small.{number:04d}.png"), codes)
    return clip


def _round(plan: Plan, number: int) -> list[int]:
    return [slot for slot, flash in enumerate(plan.flashes) if flash.lit or number == 0]


def _ball(rig: Rig, name: str, moved_px: float) -> NDArray[np.float64]:
    """Return how bright a light makes the ball, which stands at a third of the width and has moved since."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    x, y = (x - WIDTH / 3 - moved_px % (WIDTH / 3)) / 12, (HEIGHT / 2 - y) / 12
    inside = x**2 + y**2 < 1
    z = np.sqrt(np.where(inside, 1 - x**2 - y**2, 0))
    direction = next(light.direction for light in rig.lights if light.name == name)
    assert direction is not None
    lit = np.maximum(direction[0] * x + direction[1] * y + direction[2] * z, 0) * (0.8 + 0.2 * np.sin(9 * x + 7 * y))
    return np.where(inside, lit, 0.05)


def judged(out: Path) -> dict[str, Any]:
    report: dict[str, Any] = json.loads((out / "report.json").read_text(encoding="utf-8"))
    return report | {"settings": None}


def same_in_pieces(clip: Path, folder: Path, words: tuple[str, ...], **options: Any) -> None:
    """Solve a clip at one go, and again by some pieces and what they leave; compare all files and the reports."""
    given = {"rig": clip / "rig.toml", **options}
    ps.normals(clip, out=folder / "whole", **given)
    for piece in words:
        ps.normals(clip, out=folder / "pieces", piece=piece, **given)
    ps.normals(clip, out=folder / "pieces", resume=True, **given)
    assert digest_of_results(folder / "pieces") == digest_of_results(folder / "whole")
    assert judged(folder / "pieces") == judged(folder / "whole")
    assert not [*folder.glob(".*")]
