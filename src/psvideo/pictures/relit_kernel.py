"""Compiled part of relit movies: a surface in half floats under one distant light, averaged down, in one pass."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.compiled import EXACT
from psvideo.compute.memory import decoded, encoded

Halves = NDArray[np.float16]
Codes = NDArray[np.uint16]


def relit(normals: tuple[Halves, ...], albedo: tuple[Halves, ...], light: NDArray[np.float32], factor: int) -> Halves:
    """Return albedo * max(0, n . l), averaged over squares of ``factor`` pixels, (row, col, 3), linear light.

    ``normals`` are three planes (row, col), ``albedo`` one or three; rows and columns that fill no square are left out.
    """
    rows, cols = (size // factor for size in normals[0].shape)
    out = np.empty((rows, cols, 3), np.uint16)
    x, y, z = map(_bits, normals)
    red, green, blue = map(_bits, albedo if len(albedo) == 3 else albedo * 3)
    _relit(x, y, z, red, green, blue, light.astype(np.float32), factor, out)
    return out.view(np.float16)


def _bits(plane: Halves) -> Codes:
    return np.ascontiguousarray(plane).view(np.uint16)


@EXACT.kept
def _relit(
    xs: Codes, ys: Codes, zs: Codes, reds: Codes, greens: Codes, blues: Codes, light: Any, factor: int, out: Codes
) -> None:
    share = np.float32(1.0) / np.float32(factor * factor)
    for row in range(out.shape[0]):
        for col in range(out.shape[1]):
            red, green, blue = np.float32(0), np.float32(0), np.float32(0)
            for i in range(row * factor, (row + 1) * factor):
                for j in range(col * factor, (col + 1) * factor):
                    facing = decoded(xs[i, j]) * light[0] + decoded(ys[i, j]) * light[1] + decoded(zs[i, j]) * light[2]
                    facing = max(facing, np.float32(0)) * share
                    red += decoded(reds[i, j]) * facing
                    green += decoded(greens[i, j]) * facing
                    blue += decoded(blues[i, j]) * facing
            out[row, col, 0] = encoded(red, out)
            out[row, col, 1] = encoded(green, out)
            out[row, col, 2] = encoded(blue, out)
