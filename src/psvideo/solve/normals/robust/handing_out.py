"""Compiled part of the robust solver: solved pixels go to pictures, as bytes of half floats or of float32."""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import encoded
from psvideo.compute.whole_stores import unmasked
from psvideo.model.arrays import Bytes, Floats, Indices
from psvideo.solve.normals.loops.blocks import ZERO
from psvideo.solve.normals.result import Result
from psvideo.solve.normals.robust.equations import DOUBT
from psvideo.solve.normals.robust.predicted_error import UNEXPLAINED


def as_bytes(result: Result) -> Result:
    """Return a result as ``solve_rows`` takes it."""
    return Result(
        normals=result.normals.view(np.uint8),
        albedo=result.albedo.view(np.uint8),
        valid=result.valid,
        residual=result.residual.view(np.uint8),
    )


@FUSED.called
def hand_out(
    block: Result, v: Floats, out: Result, predicted: Bytes, unexplained: Floats, half: bool, places: Indices, n: int
) -> None:
    """Write solved pixels where they go."""
    for i in range(n):
        doubt = unmasked(v[DOUBT + i])
        v[DOUBT + i] = doubt if block.valid[i] else ZERO
    for i in range(min(n, len(unexplained))):
        unexplained[places[i]] = v[UNEXPLAINED + i] if block.valid[i] else ZERO
    for axis in range(3):
        _write(block.normals[axis], out.normals[axis], half, places, n)
    for channel in range(len(block.albedo)):
        _write(block.albedo[channel], out.albedo[channel], half, places, n)
    if out.residual.size:
        _write(block.residual, out.residual, half, places, n)
    if predicted.size:
        _write(v[DOUBT : DOUBT + n], predicted, half, places, n)
    for i in range(n):
        out.valid[places[i]] = block.valid[i]


@FUSED.called
def _write(values: Floats, plane: Bytes, half: bool, places: Indices, n: int) -> None:
    start, side_by_side = places[0], places[n - 1] - places[0] == n - 1
    if half and side_by_side:
        halves = plane.view(np.uint16)[start : start + n]
        for i in range(n):
            halves[i] = encoded(values[i], halves)
    elif half:
        halves = plane.view(np.uint16)
        for i in range(n):
            halves[places[i]] = encoded(values[i], halves)
    else:
        floats = plane.view(np.float32)
        for i in range(n):
            floats[places[i]] = values[i]
