"""Small clips that another simulator made, with its truth beside them: what its camera saw, and when it flashed."""

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from picture_file import read_picture

from psvideo.formats.plan_toml import read_plan
from psvideo.model.arrays import Image
from psvideo.model.plan import Plan


def plan_and_frames(folder: Path) -> tuple[Plan, list[Image]]:
    """Return the clip's plan, and its frames in linear light, (row, col, channel)."""
    plan = read_plan(folder / "plan.toml")
    black, white = plan.camera.encoding.black_level, plan.camera.encoding.white_level
    assert black is not None
    assert white is not None
    codes = (read_picture(file, cv2.IMREAD_UNCHANGED) for file in sorted((folder / "frames").glob("*.png")))
    return plan, [np.ascontiguousarray((one[..., ::-1].astype(np.float32) - black) / (white - black)) for one in codes]


def flashes_told(folder: Path) -> list[dict[str, Any]]:
    """Return what it says of every flash: its light, its start, whether the clip shows all of it, and its plate."""
    flashes: list[dict[str, Any]] = json.loads((folder / "truth" / "timing.json").read_text())["flashes"]
    return flashes
