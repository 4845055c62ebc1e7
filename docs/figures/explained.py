"""The figures of docs/how-it-works.md and docs/gallery.md, made of the table scene by psvideo's own steps."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from docs.figures.faults import BRIGHT, paint, shown, solved, white
from docs.figures.staging import Figure, Image, Pixels, exr, figure, film, frames, psvideo, row

from psvideo.formats.plan_toml import read_plan
from psvideo.formats.timing_json import read_timing
from psvideo.model.rows.shutter import row_weights
from psvideo.model.surface import Surface
from psvideo.pictures.on_screen import normal_colours, srgb
from psvideo.pictures.relighting import relight

FRAME = 5
LAMPS = {
    "from the left": ((-0.9, 0.1, 0.4), (1.0, 1.0, 1.0)),
    "from above": ((0.0, 0.9, 0.4), (1.0, 1.0, 1.0)),
    "candle, from below": ((0.35, -0.7, 0.5), (1.0, 0.66, 0.35)),
    "moon, from behind the right": ((0.95, 0.3, 0.12), (0.55, 0.7, 1.0)),
}


def how_frames(folder: Path) -> Figure:
    """Frames that follow each other: the dark row runs through them."""
    clip = film(folder)
    seen = frames(clip)
    tiles = [(f"frame {place}", shown(seen[place])) for place in range(FRAME, FRAME + 4)]
    return figure([row("Four frames that follow each other, 10 ms apart", *tiles)], "")


def how_mixture(folder: Path) -> Figure:
    """A frame is its two flashes' plates, each weighted row by row."""
    clip = film(folder)
    said = psvideo("split", clip, "-o", folder / "plates", "--flashes")
    timing, camera = read_timing(folder / "plates" / "timing.json"), read_plan(clip / "plan.toml").camera
    weights = row_weights(camera, timing.start_s, timing.duration_s, frames=range(FRAME, FRAME + 1))[:, 0]
    lit = [flash for flash in timing.flashes if flash.plate and weights[flash.index].max() > 0.2][:2]
    parts = [exr((folder / "plates" / str(flash.plate)).parent, _place(flash.plate)) for flash in lit]
    shares = [weights[flash.index].astype(np.float32) for flash in lit]
    total = sum((share[:, None, None] * part for share, part in zip(shares, parts, strict=True)), np.float32(0))
    tiles = [
        (name, _with_curve(part, share))
        for name, part, share in zip(("one flash, its share", "the next, its share"), parts, shares, strict=True)
    ]
    recorded, summed = shown(frames(clip)[FRAME]), shown(np.asarray(total, np.float32))
    return figure([row("A frame is a mixture", *tiles, ("their sum", summed), ("the frame recorded", recorded))], said)


def _place(plate: str | None) -> int:
    """Return which of its light's plates a file is: they are numbered from 1001 on."""
    return int(str(plate).split(".")[-2]) - 1001


def _with_curve(plate: Image, share: Image) -> Pixels:
    """Draw a row's share, from 0 at the left to 1 at the right, over the plate."""
    picture = shown(plate)
    rows, cols = picture.shape[:2]
    across = np.round(4 + share * (cols - 9)).astype(int)
    for line in range(rows):
        first, last = sorted((across[line], across[min(line + 1, rows - 1)]))
        picture[line, first - 1 : last + 2] = (255, 196, 0)
    return picture


def how_plates(folder: Path) -> Figure:
    """One whole picture per light."""
    clip = film(folder)
    said = psvideo("split", clip, "-o", folder / "plates")
    plates = [(name, shown(exr(folder / "plates" / name))) for name in ("key", "left", "top", "low")]
    return figure([row("One plate per light", *plates)], said)


def how_normals(folder: Path) -> Figure:
    """The surface that explains the plates."""
    clip = film(folder)
    out, said = solved(clip)
    surface = [
        ("normals", normal_colours(exr(out / "normals"))),
        ("albedo", paint(exr(out / "albedo"))),
        ("valid is white", white(exr(out / "valid"))),
        ("relit", _lit(out, *LAMPS["from the left"])),
    ]
    return figure([row("What the plates say about the surface", *surface)], said)


def gallery_light(folder: Path) -> Figure:
    """The table under light that was never there."""
    clip = film(folder)
    out, said = solved(clip)
    return figure(
        [row("Light that was never there", *((name, _lit(out, *lamp)) for name, lamp in LAMPS.items()))], said
    )


def gallery_depth(folder: Path) -> Figure:
    """Depth integrated from normals, and its slope as a check for the eye."""
    clip = film(folder)
    out, said = solved(clip, "--aov", "depth")
    depth, valid = exr(out / "depth"), exr(out / "valid") > 0
    low, high = np.quantile(depth[valid], [0.01, 0.99])
    near = np.where(valid, np.clip((high - depth) / (high - low), 0, 1), 0).astype(np.float32)
    tiles = [("normals", normal_colours(exr(out / "normals"))), ("depth, near is white", white(near))]
    return figure([row("Depth from normals", *tiles)], said)


def _lit(out: Path, light: tuple[float, float, float], colour: tuple[float, float, float]) -> Pixels:
    normals, albedo = exr(out / "normals"), exr(out / "albedo")
    plain = Surface(normals=normals, albedo=albedo, residual=None, valid=albedo.max(axis=-1) > 0)
    return srgb(relight(plain, light, colour=colour), exposure=BRIGHT)


EXPLAINED: dict[str, Callable[[Path], Figure]] = {
    "how_frames": how_frames,
    "how_mixture": how_mixture,
    "how_plates": how_plates,
    "how_normals": how_normals,
    "gallery_light": gallery_light,
    "gallery_depth": gallery_depth,
}
"""By the picture's name: docs/pictures/NAME.png."""
