"""What was found on a matte sphere, as a picture: every light's picture beside what a matte sphere would show."""

from collections.abc import Sequence

import cv2
import numpy as np

from psvideo.calibrate.light_pictures import LightPictures
from psvideo.calibrate.matte import MatteLight, sphere_normals
from psvideo.calibrate.matte_shading import shading
from psvideo.calibrate.sphere.outline import Outline
from psvideo.model.arrays import Pixels
from psvideo.pictures.contact import Strip, Tile, sheet
from psvideo.pictures.on_screen import srgb

TILE_PX = 150
OUTLINE = (90, 230, 120)
MARGIN = 1.15
PER_ROW = 6


def matte_picture(pictures: LightPictures, outline: Outline, lights: Sequence[MatteLight]) -> Pixels:
    """Return 8-bit pixels (row, col, 3): three rows per six lights, as filmed, as fitted, and their difference."""
    x, y, radius = outline.place[:3]
    rows = slice(max(int(y - MARGIN * radius), 0), int(y + MARGIN * radius) + 1)
    cols = slice(max(int(x - MARGIN * radius), 0), int(x + MARGIN * radius) + 1)
    grey = pictures.grey[:, rows, cols].astype(np.float64)
    high, wide = grey.shape[1:]
    points = np.stack(np.meshgrid(np.arange(wide) + cols.start, np.arange(high) + rows.start), axis=-1)
    normals, facing = sphere_normals(outline.view, outline.place, points.reshape(-1, 2).astype(np.float64))
    inside = (facing > 0).reshape(high, wide)
    strips = []
    for first in range(0, len(lights), PER_ROW):
        tiles: list[list[Tile]] = [[], [], []]
        for n, light in enumerate(lights[first : first + PER_ROW], first):
            reached, _ = shading(normals, light.direction, light.nearness)
            shade = np.maximum(reached, 0).reshape(high, wide) * inside
            level = float((grey[n] * shade).sum() / max((shade**2).sum(), 1e-12))
            exposure = 0.8 / max(level, 1e-6)
            made = level * shade
            label = f"{light.name} +-{light.error_deg:.1f}" if not light.fault else f"{light.name} left out"
            off = np.where(inside, 0.5 + (grey[n] - made) * exposure, 0.0)
            shown = (grey[n] * exposure, made * exposure, off)
            for row, (picture, words) in enumerate(zip(shown, (label, "", ""), strict=True)):
                tiles[row].append(Tile(words, _small(picture, outline, cols.start, rows.start)))
        strips += [
            Strip("As filmed; green: the outline", tiles[0]),
            Strip("A matte sphere under the light that was found", tiles[1]),
            Strip("Difference (grey: none)", tiles[2]),
        ]
    return sheet(strips, width_px=1200)


def _small(picture: np.ndarray, outline: Outline, left: int, top: int) -> Pixels:
    canvas = srgb(np.clip(picture, 0, 1).astype(np.float32))
    scale = TILE_PX / max(canvas.shape[:2])
    canvas = np.ascontiguousarray(cv2.resize(canvas, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA))
    rim = ((outline.view.curve(outline.place) - [left, top] + 0.5) * scale).round().astype(np.int32)
    cv2.polylines(canvas, [rim], True, OUTLINE, 1, cv2.LINE_AA)
    return canvas
