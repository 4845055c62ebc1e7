"""The surroundings of holes, copied out of a picture in square tiles, in which ``growing`` works.

Growing jumps all over the picture, to whatever pixel is nearest to solved ones. In a large picture, whose planes lie in
files, that would bring every row into memory, though most pixels lie far from any hole.
"""

from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.compute.compiled import FUSED
from psvideo.compute.spilled import let_go, planes_for
from psvideo.model.arrays import Bytes, Mask, Samples

SHIFT = 5
SIDE_PX = 1 << SHIFT
WITHIN = SIDE_PX - 1
AT_ONCE = 1 << 18
"""This many pixels are brought back before the planes that they lie in are let go."""


THREE_LIGHTS, AT_RIM, ODD_AT_RIM, ALONE_AT_RIM, UNKNOWN, LEFT_ALONE = 3, 4, 5, 6, 9, 10  # of Tiles.lights
NOWHERE = -1  # of Tiles.places and Tiles.table


class Tiles(NamedTuple):
    """A picture's planes around the pixels that are to be filled: float32, or half floats as the bits of uint16.

    rows, cols: the picture's size. table: (row of tiles, column of tiles), a tile's number, NOWHERE of those that are
    not held; pixel (row, col) lies in the tile of its place over SIDE_PX, at what is left over. normals: (tile, 3, row,
    col). albedo: (tile, channel, row, col). lights: (tile, row, col), how many lights a pixel's normal is from,
    THREE_LIGHTS where it was solved (once growing begins AT_RIM, ODD_AT_RIM or ALONE_AT_RIM beside pixels that are to
    be filled), UNKNOWN where it is to be filled. places: (tile, row, col), the place of those among all of them, row
    by row; NOWHERE of others.
    """

    rows: int
    cols: int
    table: NDArray[np.int32]
    normals: Samples
    albedo: Samples
    lights: Bytes
    places: NDArray[np.int32]


def tiles_around(
    wanted: Mask, solved: Mask, normals: Samples, albedo: Samples, *, reach_px: int, spare: Path | None
) -> Tiles:
    """Copy what lies no farther than ``reach_px``, at most a tile, from the ``wanted`` pixels (row, col); planes are
    (plane, row, col), and ``spare`` is a folder for the tiles of large pictures."""
    rows, cols = wanted.shape
    state = np.array([LEFT_ALONE, THREE_LIGHTS, UNKNOWN], np.uint8)
    near = _near(wanted, reach_px)
    table = np.full(near.shape, -1, np.int32)
    count = int(np.count_nonzero(near))
    table[near] = np.arange(count, dtype=np.int32)
    square = (SIDE_PX, SIDE_PX)
    tiles = Tiles(
        rows=rows,
        cols=cols,
        table=table,
        normals=planes_for((count, len(normals), *square), normals.dtype, pixels=wanted.size, folder=spare),
        albedo=planes_for((count, len(albedo), *square), albedo.dtype, pixels=wanted.size, folder=spare),
        lights=np.empty((count, *square), np.uint8),
        places=planes_for((count, *square), np.int32, pixels=wanted.size, folder=spare),
    )
    begun = before = 0
    for down in range(len(near)):
        across = np.flatnonzero(near[down])
        if not len(across):
            continue
        band, held = slice(down << SHIFT, (down + 1) << SHIFT), slice(begun, begun + len(across))
        # beyond the picture's right edge its last column is held again; nobody looks there
        columns = np.minimum((across[:, None] << SHIFT) + np.arange(SIDE_PX), cols - 1)
        asked = wanted[band]
        places = np.cumsum(asked, dtype=np.int32).reshape(asked.shape) + np.int32(before - 1)
        begun, before = held.stop, int(places[-1, -1]) + 1
        high = len(asked)
        tiles.places[held, :high] = np.where(asked, places, np.int32(NOWHERE))[:, columns].transpose(1, 0, 2)
        tiles.lights[held, :high] = state[solved[band] + np.uint8(2) * asked][:, columns].transpose(1, 0, 2)
        for into, planes in ((tiles.normals, normals), (tiles.albedo, albedo)):
            into[held, :, :high] = planes[:, band][..., columns].transpose(2, 0, 1, 3)
            let_go(*planes[:, band])
    return tiles


def bring_back(tiles: Tiles, where: NDArray[np.int32], normals: Samples, albedo: Samples) -> Bytes:
    """Copy the pixels ``where`` (pixel, 2: row and column, row by row) back into the planes that tiles were copied
    from; return how many lights each is from."""
    lights = np.empty(len(where), np.uint8)
    for first in range(0, len(where), AT_ONCE):
        rows, cols = where[first : first + AT_ONCE].T
        tile, y, x = tiles.table[rows >> SHIFT, cols >> SHIFT], rows & WITHIN, cols & WITHIN
        lights[first : first + AT_ONCE] = tiles.lights[tile, y, x]
        for some, planes in ((tiles.normals, normals), (tiles.albedo, albedo)):
            for number, plane in enumerate(planes):
                plane[rows, cols] = some[tile, number, y, x]
                let_go(plane[rows[0] : rows[-1] + 1])
    return lights


def _near(wanted: Mask, reach_px: int) -> Mask:
    """Return which tiles (row, column) hold wanted pixels or what is near to them."""
    rows, cols = wanted.shape
    near = np.zeros((-(-rows // SIDE_PX), -(-cols // SIDE_PX)), np.bool_)
    for down in range(len(near)):
        begin, end = (down << SHIFT) - reach_px, ((down + 1) << SHIFT) + reach_px
        columns = np.zeros(near.shape[1] << SHIFT, np.uint8)
        columns[:cols] = wanted[max(begin, 0) : end].any(axis=0)
        around = cv2.dilate(columns[None], np.ones((1, 2 * reach_px + 1), np.uint8))
        near[down] = around.reshape(-1, SIDE_PX).any(axis=1)
    return near


@FUSED.inlined
def tile_at(tiles: Tiles, row: int, col: int) -> int:
    """The tile that a pixel lies in."""
    return int(tiles.table[row >> SHIFT, col >> SHIFT])


@FUSED.inlined
def lights_at(tiles: Tiles, row: int, col: int) -> int:
    """How many lights a pixel's normal is from."""
    return int(tiles.lights[tile_at(tiles, row, col), row & WITHIN, col & WITHIN])
