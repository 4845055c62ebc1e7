"""Compiled part of the robust solver: some pixels of a block put side by side, from all blocks of a row, to be solved
together."""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.model.arrays import Floats, Indices
from psvideo.solve.normals.loops.blocks import COUNT, LIMIT, X, Y, Z
from psvideo.solve.normals.robust.equations import SENT, VIEW_X, VIEW_Y, VIEW_Z
from psvideo.solve.normals.robust.room import Room

WHOLE = 16  # pixels are filled up to whole vectors of this many: what is left over would be solved one by one


@FUSED.inlined
def put_side_by_side(
    block: Room, listed: Indices, count: int, distant: bool, lens: bool, apart: Room, waiting: int
) -> None:
    """Copy the listed pixels of a block behind those that are ``waiting``; lights that are not ``distant`` and views
    through a ``lens`` are each pixel's own."""
    for plane in (X, Y, Z, COUNT, LIMIT):
        for k in range(count):
            apart.planes[plane + waiting + k] = block.planes[plane + listed[k]]
    if not distant:
        _pick(block.more[SENT:], listed, count, apart.more[SENT + waiting :])
    if lens:
        for plane in (VIEW_X, VIEW_Y, VIEW_Z):
            _pick(block.more[plane:], listed, count, apart.more[plane + waiting :])
    for light in range(len(block.measurements)):
        _pick(block.measurements[light], listed, count, apart.measurements[light, waiting:])
    for plane in range(len(block.values)):
        _pick(block.values[plane], listed, count, apart.values[plane, waiting:])
    for light in range(0 if distant else len(block.measurements)):
        for axis in range(3):
            _pick(block.matrix[light, axis], listed, count, apart.matrix[light, axis, waiting:])
        _pick(block.per_strength[light], listed, count, apart.per_strength[light, waiting:])
    for light in range(len(block.ways) if lens else 0):
        for number in range(6):
            _pick(block.ways[light, number], listed, count, apart.ways[light, number, waiting:])


@FUSED.inlined
def _pick(plane: Floats, listed: Indices, n: int, into: Floats) -> None:
    for k in range(n):
        into[k] = plane[listed[k]]


@FUSED.inlined
def fill_up(apart: Room, waiting: int, distant: bool, lens: bool, listed: Indices) -> int:
    """Copy the first pixel behind the others up to whole vectors; return how many pixels that makes."""
    more = -waiting % WHOLE
    listed[:more] = np.uint32(0)
    put_side_by_side(apart, listed, more, distant, lens, apart, waiting)
    return waiting + more
