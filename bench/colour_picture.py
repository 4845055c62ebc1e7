"""Make the picture of docs/colour.md, a bust and a fan under coloured lamps: ``python -m bench.colour_picture``."""

import json
import tempfile
from pathlib import Path

import cv2
from docs.figures.staging import PICTURES, Pixels, exr, frames, psvideo, row

import psvideo as ps
from bench.colour import fan_scene, filmed, picture_of, scene_of, white_scene
from psvideo.pictures.contact import sheet
from psvideo.pictures.on_screen import normal_colours, srgb

WIDE_PX = 240
SHEET_PX = 720
"""Narrower than others: guards are fine detail, and pictures are to stay small files."""
PLACE = 7
"""Which result of the fan is shown, from 0."""
BRIGHT = 1.4


def colour_and_time(folder: Path) -> Pixels:
    """A standing bust taken apart, and a fan at the rate of flashes beside the same under white light."""
    folder.mkdir(parents=True)
    clip = filmed(scene_of("colour", WIDE_PX), folder / "bust")
    psvideo("normals", clip, "--rig", clip / "rig.toml", "--plates", "-o", folder / "out")
    bust = [
        ("a frame", srgb(frames(clip)[PLACE], exposure=BRIGHT)),
        ("one lamp, taken apart", srgb(exr(folder / "out" / "plates" / "key"), exposure=BRIGHT)),
        ("albedo", srgb(exr(folder / "out" / "albedo"), exposure=BRIGHT)),
        ("normals", normal_colours(exr(folder / "out" / "normals"))),
    ]
    fan = fan_scene(grey=True)
    clip, white = filmed(fan, folder / "fan"), filmed(white_scene(fan), folder / "white")
    apart, time_s = _normals(clip, folder / "apart")
    flash = _flash_at(clip, time_s)
    tiles = [
        ("one flash", srgb(picture_of(clip / "truth" / "plates" / flash), exposure=BRIGHT)),
        ("normals of that flash", apart),
        ("one white light per flash", _normals(white, folder / "by_time")[0]),
        ("truth", normal_colours(picture_of(clip / "truth" / "normals" / flash))),
    ]
    strips = [row("A painted bust: colours exchanged between flashes", *bust), row("A fan, 720 turns a minute", *tiles)]
    return sheet(strips, width_px=SHEET_PX)


def _normals(clip: Path, out: Path) -> tuple[Pixels, float]:
    """Return one result, and its instant."""
    report = ps.normals(clip, rig=clip / "rig.toml", out=out, fps="flash")
    return normal_colours(exr(out / "normals", PLACE)), report.instants[PLACE].time_s


def _flash_at(clip: Path, time_s: float) -> str:
    """Return the file that shows the truth of an instant."""
    flashes = json.loads((clip / "truth" / "timing.json").read_text(encoding="utf-8"))["flashes"]
    lit = [one for one in flashes if one.get("plate")]
    nearest = min(lit, key=lambda one: abs(float(one["start_s"]) + one["duration_s"] / 2 - time_s))
    return Path(str(nearest["plate"])).name


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary:
        made = colour_and_time(Path(temporary) / "made")
    cv2.imwrite(str(PICTURES / "colour_and_time.png"), made[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 9])
