"""Contact sheets: labelled pictures in rows, for eyes."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from psvideo.model.arrays import Pixels

BACKGROUND = 24
INK = (226, 226, 226)
FAINT_INK = (150, 150, 150)
GAP_PX = 12
LABEL_PX = 30
TITLE_PX = 44
OVERSAMPLING = 4
LEAST_TILE_PX = 88
"""Pictures that would become narrower stand in several rows: 96 lights shall still be told apart."""


@dataclass(frozen=True)
class Tile:
    """One labelled picture: 8-bit sRGB pixels (row, col, 3)."""

    label: str
    picture: Pixels


MOST_HIGH = 2.0
"""No picture of a sheet is higher than this many times the width that it has room for."""


@dataclass(frozen=True)
class Strip:
    """One row of a sheet, under a title."""

    title: str
    tiles: Sequence[Tile]


def sheet(strips: Sequence[Strip], *, width_px: int = 1600) -> Pixels:
    """Return the strips below each other as one picture, (row, col, 3); each strip fills the width, in several rows
    where one would make its pictures too small."""
    return np.concatenate([_strip(strip, width_px) for strip in strips], axis=0)


def _strip(strip: Strip, width_px: int) -> Pixels:
    count = len(strip.tiles)
    rows = -(-count // max((width_px - GAP_PX) // (LEAST_TILE_PX + GAP_PX), 1))
    across = -(-count // rows)
    title = np.full((TITLE_PX, width_px, 3), BACKGROUND, np.uint8)
    write_line(title, strip.title, GAP_PX, TITLE_PX - 14, 0.62, INK)
    lines = [strip.tiles[first : first + across] for first in range(0, count, across)]
    return np.concatenate([title, *(_line(line, across, width_px) for line in lines)], axis=0)


def _line(tiles: Sequence[Tile], across: int, width_px: int) -> Pixels:
    """Return pictures side by side with their labels below, each as wide as ``across`` of them leave it."""
    tile_px = (width_px - GAP_PX * (across + 1)) // across
    pictures = [_fitted(tile.picture, tile_px) for tile in tiles]
    height_px = max(picture.shape[0] for picture in pictures)
    canvas = np.full((height_px + LABEL_PX, width_px, 3), BACKGROUND, np.uint8)
    for place, (tile, picture) in enumerate(zip(tiles, pictures, strict=True)):
        left = GAP_PX + place * (tile_px + GAP_PX)
        canvas[: picture.shape[0], left : left + picture.shape[1]] = picture
        write_line(canvas, tile.label, left, height_px + 20, 0.46, FAINT_INK)
    return canvas


def _fitted(picture: Pixels, width_px: int) -> Pixels:
    """Scale a picture to a width, its shape kept; one that is much higher than wide to a height."""
    high = picture.shape[0] / picture.shape[1]
    width_px = max(round(width_px * min(MOST_HIGH / high, 1)), 1)
    height_px = max(round(high * width_px), 1)
    smaller = width_px < picture.shape[1]
    return cv2.resize(
        picture, (width_px, height_px), interpolation=cv2.INTER_AREA if smaller else cv2.INTER_CUBIC
    ).astype(np.uint8)


def write_line(canvas: Pixels, text: str, left: int, baseline: int, size: float, ink: tuple[int, int, int]) -> None:
    """Write a line of text, drawn larger and scaled down, which is smoother than the font's own lines."""
    font = cv2.FONT_HERSHEY_SIMPLEX
    (wide, tall), below = cv2.getTextSize(text, font, size * OVERSAMPLING, OVERSAMPLING + 1)
    pad = OVERSAMPLING * 3
    mask = np.zeros((tall + below + 2 * pad, wide + 2 * pad), np.uint8)
    cv2.putText(mask, text, (pad, tall + pad), font, size * OVERSAMPLING, 255, OVERSAMPLING + 1, cv2.LINE_AA)
    small = cv2.resize(
        mask, (mask.shape[1] // OVERSAMPLING, mask.shape[0] // OVERSAMPLING), interpolation=cv2.INTER_AREA
    )
    top = max(baseline - (tall + pad) // OVERSAMPLING, 0)
    place = canvas[top : top + small.shape[0], left : left + small.shape[1]]
    share = small[: place.shape[0], : place.shape[1], None] / 255.0
    place[:] = (place * (1 - share) + np.array(ink) * share + 0.5).astype(np.uint8)
