"""Where a solution goes: planes that the compiled solvers fill, of large pictures in files."""

from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from psvideo.compute.spilled import let_go, lie_in_files, planes_for
from psvideo.model.arrays import Bytes, Samples


class Result(NamedTuple):
    """Where the solution goes: planes of float32, or of half floats as the bits of uint16."""

    normals: Samples  # (3, pixel)
    albedo: Samples  # (channel, pixel)
    valid: Bytes  # (pixel,)
    residual: Samples  # (pixel,), or empty


def empty_result(pixels: int, channels: int, *, half: bool, residual: bool, spare: Path | None = None) -> Result:
    """Return memory for the solution of this many pixels; of large pictures files in the folder ``spare``."""
    stored = np.uint16 if half else np.float32
    room = partial(planes_for, kind=stored, pixels=pixels, folder=spare)
    return Result(
        normals=room((3, pixels)),
        albedo=room((channels, pixels)),
        valid=np.empty(pixels, np.uint8),
        residual=room((pixels if residual else 0,)),
    )


def let_rows_go(result: Result, cols: int, first: int, last: int) -> None:
    """Hand rows of a solution that lies in files back to the system."""
    if not lie_in_files(result.normals):  # as the other planes, which empty_result made alike
        return
    part = slice(first * cols, last * cols)
    let_go(*(plane[part] for plane in (*result.normals, *result.albedo, result.residual)))
