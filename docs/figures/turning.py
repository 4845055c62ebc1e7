"""The figure of docs/rolling.md: a fan under a light that stays on, flashed, and blurred again."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import OpenEXR
from bench.rolling import LIGHT, Picture, continuous, flashed, scene_at
from docs.figures.staging import Figure, Pixels, figure, psvideo, row

from psvideo.pictures.on_screen import srgb
from psvideo.synth.scene import read_scene
from psvideo.synth.scenes import builtin_scene
from psvideo.synth.stage import set_stage

FAST, SLOW = 720, 40
BRIGHT = 0.8


def rolling_fan(folder: Path) -> Figure:
    """Filmed fast under both kinds of light, and slower with its shutter opened again."""
    folder.mkdir(parents=True)
    scene = scene_at(FAST, folder)
    stage = set_stage(read_scene(scene), builtin_scene("fan").parent)
    tiles = [
        ("light stays on, 360 degrees", _shown(continuous(stage, 360.0)[0])),
        ("light stays on, 11 degrees", _shown(continuous(stage, 11.0)[0])),
        ("flashed, 0.3 ms, 360 degrees", _shown(flashed(scene, folder)[0])),
    ]
    clip = folder / "slow" / "clip"
    clip.parent.mkdir()
    said = psvideo("synth", scene_at(SLOW, clip.parent, frames=36), "-o", clip)
    said += psvideo("split", clip, "--fps", "12", "--shutter", "360", "-o", folder / "open")
    file = sorted((folder / "open" / LIGHT).iterdir())[1]
    with OpenEXR.File(str(file)) as read:
        plate = np.asarray(read.channels()["RGB"].pixels, np.float32)
    tiles.append(("40 a minute, open for 1/12 s", _shown(plate)))
    return figure([row("A fan at 720 turns a minute before a rolling shutter", *tiles)], said)


def _shown(picture: Picture) -> Pixels:
    return srgb(picture, exposure=BRIGHT)


TURNING: dict[str, Callable[[Path], Figure]] = {"rolling_fan": rolling_fan}
"""By the picture's name: docs/pictures/NAME.png."""
