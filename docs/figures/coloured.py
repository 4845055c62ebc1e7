"""The figure of docs/colour.md: a bust and a fan under three lamps of three colours."""

import json
from collections.abc import Callable
from pathlib import Path

from bench.colour import fan_scene, filmed, picture_of, scene_of, white_scene
from docs.figures.staging import Figure, Pixels, exr, figure, frames, psvideo, row

import psvideo as ps
from psvideo.pictures.relighting import normal_colours, srgb

WIDE_PX = 240
PLACE = 7
"""Which result of the fan is shown, from 0."""
BRIGHT = 1.4


def colour_and_time(folder: Path) -> Figure:
    """A standing bust taken apart, and a fan at the rate of flashes beside the same under white light."""
    folder.mkdir(parents=True)
    clip = filmed(scene_of("colour", WIDE_PX), folder / "bust")
    said = psvideo("normals", clip, "--rig", clip / "rig.toml", "--plates", "-o", folder / "out")
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
    return figure(
        [row("A painted bust: colours exchanged between flashes", *bust), row("A fan, 720 turns a minute", *tiles)],
        said,
    )


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


COLOURED: dict[str, Callable[[Path], Figure]] = {"colour_and_time": colour_and_time}
"""By the picture's name: docs/pictures/NAME.png."""
