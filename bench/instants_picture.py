"""Make docs/pictures/shutter_fan.png, a fan flashed and blurred again: ``python -m bench.instants_picture``."""

import tempfile
from pathlib import Path

import cv2
import numpy as np
from docs.figures.staging import PICTURES, Pixels, row

import psvideo as ps
from bench.instants import FPS, VIEWS, beauties, lit_at, small_scene
from psvideo.pictures.contact import sheet
from psvideo.pictures.on_screen import srgb
from psvideo.synth.scene import read_scene
from psvideo.synth.scenes import builtin_scene
from psvideo.synth.stage import set_stage

WIDE_PX, SHEET_PX = 240, 720
TURNS_A_MINUTE, SHUTTER_DEG = 60, 360
PLACE = 1
"""Which result is shown, from 0."""


def fan(folder: Path) -> Pixels:
    """The repository's fan under continuous light, as its flashes froze it, and under an open shutter made of these."""
    motion = {"axis": [0.0, 0.0, 1.0], "spin_deg_per_s": 6.0 * TURNS_A_MINUTE}
    scene = small_scene("fan", WIDE_PX, motion, folder)
    clip = ps.shoot(scene, folder / "clip").path
    stage = set_stage(read_scene(scene), builtin_scene("fan").parent)
    opened = beauties(clip, folder / "opened", fps=FPS, shutter=SHUTTER_DEG)
    time_s = list(opened)[PLACE]
    open_s = SHUTTER_DEG / 360 / FPS
    views = [lit_at(stage, time_s + open_s * ((n + 0.5) / VIEWS - 0.5)) for n in range(VIEWS)]
    frozen = beauties(clip, folder / "frozen", fps="round")
    nearest = min(frozen, key=lambda at_s: abs(at_s - time_s))
    shown = [
        (f"continuous light, shutter {SHUTTER_DEG}°", np.mean(views, axis=0)),
        ("flashed, one round", frozen[nearest]),
        (f"--fps {FPS} --shutter {SHUTTER_DEG}", opened[time_s]),
    ]
    largest = max(float(image.max()) for _, image in shown)
    tiles = [(name, srgb(np.asarray(image, np.float32), exposure=1 / largest)) for name, image in shown]
    return sheet([row(f"A fan, {TURNS_A_MINUTE} turns a minute", *tiles)], width_px=SHEET_PX)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary:
        made = fan(Path(temporary))
    cv2.imwrite(str(PICTURES / "shutter_fan.png"), made[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 9])
