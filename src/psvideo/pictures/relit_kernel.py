"""Compiled part of relit movies: a surface in half floats under one distant light, averaged down, in one pass; and how
half floats are shown."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import decoded, encoded
from psvideo.model.arrays import Codes16, Floats, Halves


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


def shown_by(table: NDArray[np.uint8], picture: Halves) -> NDArray[np.uint8]:
    """Return what ``table`` holds for every half float, by its bits; numpy, which makes places of 64 bits first, takes
    nine times as long."""
    shown = np.empty(picture.shape, np.uint8)
    _look_up(table, _bits(picture).reshape(-1), shown.reshape(-1))
    return shown


def _bits(plane: Halves) -> Codes16:
    return np.ascontiguousarray(plane).view(np.uint16)


@FUSED.kept
def _relit(
    xs: Codes16,
    ys: Codes16,
    zs: Codes16,
    reds: Codes16,
    greens: Codes16,
    blues: Codes16,
    light: Any,
    factor: int,
    out: Codes16,
) -> None:
    share = np.float32(1.0) / np.float32(factor * factor)
    cols = out.shape[1] * factor
    facing, total = np.empty(cols, np.float32), np.empty((3, cols), np.float32)
    sums, packed = np.empty(cols, np.float32), np.empty((3, cols), np.uint16)
    for row in range(out.shape[0]):
        total[:] = np.float32(0)
        for i in range(row * factor, (row + 1) * factor):
            _face(xs[i], ys[i], zs[i], light[0] * share, light[1] * share, light[2] * share, facing)
            _add(reds[i], facing, total[0])
            _add(greens[i], facing, total[1])
            _add(blues[i], facing, total[2])
        for channel in range(3):
            _pack_beside(total[channel], factor, sums, packed[channel])
        for col in range(out.shape[1]):
            for channel in range(3):
                out[row, col, channel] = packed[channel, col * factor]


@FUSED.kept
def _look_up(table: NDArray[np.uint8], codes: Codes16, out: NDArray[np.uint8]) -> None:
    for place in range(codes.shape[0]):
        out[place] = table[np.uintp(codes[place])]


@FUSED.inlined
def _face(xs: Codes16, ys: Codes16, zs: Codes16, x: np.float32, y: np.float32, z: np.float32, facing: Floats) -> None:
    for col in range(facing.shape[0]):  # loops over few arrays each become vectors
        facing[col] = max(decoded(xs[col]) * x + decoded(ys[col]) * y + decoded(zs[col]) * z, np.float32(0))


@FUSED.inlined
def _add(albedo: Codes16, facing: Floats, total: Floats) -> None:
    for col in range(facing.shape[0]):
        total[col] += decoded(albedo[col]) * facing[col]


@FUSED.inlined
def _pack_beside(line: Floats, factor: int, sums: Floats, packed: Codes16) -> None:
    """Fill ``packed`` with what so many samples from there on are together, from every one that has as many: one of so
    many is wanted, but loops over neighbours become vectors. ``sums`` is room for a row."""
    count = line.shape[0] - factor + 1
    for col in range(count):
        sums[col] = line[col]
    for beside in range(1, factor):
        ahead = line[beside : beside + count]
        for col in range(count):
            sums[col] += ahead[col]
    for col in range(count):
        packed[col] = encoded(sums[col], packed)
