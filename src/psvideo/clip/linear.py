"""From code values to linear light: the transfer curve taken off, 0 at black, 1.0 at saturation.

``light = (curve(code) - curve(black)) / (curve(white) - curve(black))``. Integer codes go through a table.
"""

import functools

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.camera import Encoding
from psvideo.clip.record import Levels, Picture
from psvideo.clip.transfer import find_curve, to_light
from psvideo.errors import PsvideoError


def linear_light(picture: Picture, encoding: Encoding) -> NDArray[np.float32]:
    """Return a picture in linear light, same shape. The plan's levels, where it gives them, override the file's."""
    codes, bits = picture.codes, picture.header.bits
    white = picture.header.white if encoding.white_level is None else encoding.white_level
    black = picture.header.black if encoding.black_level is None else ((encoding.black_level,),)
    if bits is None:
        return _float_light(codes, encoding.transfer, black, white)
    if black is None or len({level for row in black for level in row}) == 1:
        table = light_table(encoding.transfer, bits, black[0][0] if black else None, white, codes.dtype.itemsize)
        return np.asarray(cv2.LUT(codes, table), np.float32).reshape(codes.shape)
    light = np.empty(codes.shape, np.float32)
    for row, levels in enumerate(black):
        for col, level in enumerate(levels):
            place = np.s_[row :: len(black), col :: len(levels)]
            table = light_table(encoding.transfer, bits, level, white, codes.dtype.itemsize)
            light[place] = cv2.LUT(np.ascontiguousarray(codes[place]), table)
    return light


@functools.lru_cache(maxsize=32)
def light_table(
    transfer: str, bits: int, black: float | None, white: float | None, bytes_per_code: int
) -> NDArray[np.float32]:
    """Return the light of every code that ``bytes_per_code`` can hold; the largest that is used is ``2**bits - 1``.

    Left out, black is the code that the curve decodes to 0, and white the largest code.
    """
    largest = 2**bits - 1
    curve = find_curve(transfer)
    codes = np.arange(256**bytes_per_code, dtype=np.float64)
    levels = np.array([0.0 if black is None else black, largest if white is None else white])
    level_light = to_light(curve, levels / largest).astype(np.float64)
    black_light = 0.0 if black is None else level_light[0]
    span = level_light[1] - black_light
    if span <= 0:
        raise PsvideoError(
            f"white_level {levels[1]:g} is no brighter than black_level {levels[0]:g} under the curve {curve.name!r}, "
            f"whose codes run from 0 to {largest} in these files. Give the plan levels that are counted in these codes."
        )
    light = to_light(curve, np.minimum(codes, largest) / largest)
    return ((light - black_light) / span).astype(np.float32)


def _float_light(
    codes: NDArray[np.floating], transfer: str, black: Levels | None, white: float | None
) -> NDArray[np.float32]:
    """Floating point pictures hold light already: they are scaled only where levels are given."""
    curve = find_curve(transfer)
    light = to_light(curve, codes) if curve.source else np.asarray(codes, np.float32)
    if black is None and white is None:
        return light
    ends = to_light(curve, np.array([black[0][0] if black else 0.0, 1.0 if white is None else white]))
    black_light = ends[0] if black else np.float32(0)
    return (light - black_light) / (ends[1] - black_light)
