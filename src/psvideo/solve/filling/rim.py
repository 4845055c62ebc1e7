"""Solved pixels beside those that are to be filled, and which of them are none to go on from; compiled.

Where a shadow ends within a pixel, a light shows a part of what it would, and the normal is none of the surface's. On
an outline one pixel shows two surfaces, and has three lights where neither of them has.
"""

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.compiled import FUSED
from psvideo.solve.filling.looking import Said
from psvideo.solve.filling.neighbours import known_of, misfit
from psvideo.solve.filling.tiles import (
    ALONE_AT_RIM,
    AT_RIM,
    ODD_AT_RIM,
    THREE_LIGHTS,
    WITHIN,
    Tiles,
    lights_at,
    tile_at,
)
from psvideo.solve.normals.loops.blocks import ONE, ZERO

BEHIND_PX = 2  # a normal beside a hole is held against those no farther from it that do not border on one,
ODD = np.float32(np.cos(np.radians(10.0)))  # and is another than theirs from this angle on


@FUSED.called
def mark_rim(p: Tiles, s: Said, places: NDArray[np.int32]) -> None:
    """Mark the solved pixels beside those at ``places`` (pixel, 2: row and column), which are to be filled, and of
    these the ones that are odd or alone."""
    for pixel in range(len(places)):
        row, col = places[pixel, 0], places[pixel, 1]
        for y in range(max(row - 1, 0), min(row + 2, p.rows)):
            for x in range(max(col - 1, 0), min(col + 2, p.cols)):
                if lights_at(p, y, x) == THREE_LIGHTS:
                    p.lights[tile_at(p, y, x), y & WITHIN, x & WITHIN] = AT_RIM
    for pixel in range(len(places)):
        row, col = places[pixel, 0], places[pixel, 1]
        for y in range(max(row - 1, 0), min(row + 2, p.rows)):
            for x in range(max(col - 1, 0), min(col + 2, p.cols)):
                if lights_at(p, y, x) == AT_RIM:
                    p.lights[tile_at(p, y, x), y & WITHIN, x & WITHIN] = _rim_of(p, s, pixel, y, x)


@FUSED.called
def _rim_of(p: Tiles, s: Said, pixel: int, row: int, col: int) -> int:
    """What a solved pixel beside one that is to be filled is: ODD_AT_RIM if its normal is another one than that of the
    surface behind it, though that explains what lights show of the latter; ALONE_AT_RIM if there is none behind it, as
    on an outline that shows a third light of what lies before another surface."""
    a, b, c, count = ZERO, ZERO, ZERO, ZERO
    for y in range(max(row - BEHIND_PX, 0), min(row + BEHIND_PX + 1, p.rows)):
        for x in range(max(col - BEHIND_PX, 0), min(col + BEHIND_PX + 1, p.cols)):
            if lights_at(p, y, x) == THREE_LIGHTS:
                one, two, three = known_of(p, y, x)
                a, b, c, count = a + one, b + two, c + three, count + ONE
    if not count > ZERO:
        return ALONE_AT_RIM
    a, b, c = a / count, b / count, c / count
    one, two, three = known_of(p, row, col)
    lengths = np.sqrt((a * a + b * b + c * c) * (one * one + two * two + three * three))
    odd = a * one + b * two + c * three < ODD * lengths and misfit(s, pixel, a, b, c) < ONE
    return ODD_AT_RIM if odd else AT_RIM
