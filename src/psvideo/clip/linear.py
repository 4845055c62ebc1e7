"""From code values to linear light: the transfer curve taken off, 0 at black, 1.0 at saturation.

``light = (curve(code) - curve(black)) / (curve(white) - curve(black))``. Integer codes go through a table.
"""

import functools
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.clip.decode.yuv import signal_range
from psvideo.clip.record import CodedPicture, Header, Levels
from psvideo.clip.transfer import find_curve, to_light
from psvideo.errors import PsvideoError
from psvideo.model.camera import Encoding


def linear_light(picture: CodedPicture, encoding: Encoding) -> NDArray[np.float32]:
    """Return a picture in linear light, same shape. The plan's levels, where it gives them, override the file's."""
    head, codes = picture.header, picture.codes
    white = head.white if encoding.white_level is None else encoding.white_level
    black = head.black if encoding.black_level is None else ((encoding.black_level,),)
    if head.bits is None:
        return _float_light(codes, encoding.transfer, black, white)
    scale = _scale(head, encoding)
    tables = {
        level: light_table(scale, encoding.transfer, level, white, codes.dtype.itemsize)
        for level in ({level for row in black for level in row} if black else {None})
    }
    if black is None or len(tables) == 1:
        return np.asarray(cv2.LUT(codes, next(iter(tables.values()))), np.float32).reshape(codes.shape)
    light = np.empty(codes.shape, np.float32)
    for row, levels in enumerate(black):
        for col, level in enumerate(levels):
            place = np.s_[row :: len(black), col :: len(levels)]
            light[place] = cv2.LUT(np.ascontiguousarray(codes[place]), tables[level]).reshape(light[place].shape)
    return light


@dataclass(frozen=True, kw_only=True)
class Scale:
    """Which signal a code stands for. ``largest`` is the code that the plan's levels are counted against."""

    signal_at_0: float
    signal_per_code: float
    largest: int
    clamped: bool


def _scale(head: Header, encoding: Encoding) -> Scale:
    """Return a picture's scale.

    Where a maker defines the curve on recorded codes (S-Log3, V-Log, Canon Log), video range is not expanded: code 420
    of 1023 is S-Log3's 18 % grey whether or not the file is tagged as video range.
    """
    largest = 2 ** (head.bits or 0) - 1
    if head.signal_per_code is None:
        return Scale(signal_at_0=0.0, signal_per_code=1 / largest, largest=largest, clamped=True)
    if not (head.video_range and find_curve(encoding.transfer).on_codes):
        return Scale(signal_at_0=head.signal_at_0, signal_per_code=head.signal_per_code, largest=largest, clamped=False)
    zero, one = (code / largest for code in signal_range(head.bits or 0, video_range=True))
    return Scale(
        signal_at_0=zero + (one - zero) * head.signal_at_0,
        signal_per_code=(one - zero) * head.signal_per_code,
        largest=largest,
        clamped=False,
    )


@functools.lru_cache(maxsize=32)
def light_table(
    scale: Scale, transfer: str, black: float | None, white: float | None, bytes_per_code: int
) -> NDArray[np.float32]:
    """Return the light of every code that ``bytes_per_code`` can hold.

    Left out, black is the code that the curve decodes to 0, and white the largest code.
    """
    curve = find_curve(transfer)
    levels = np.array([0.0 if black is None else black, scale.largest if white is None else white])
    level_light = to_light(curve, levels / scale.largest)
    black_light = 0.0 if black is None else level_light[0]
    span = level_light[1] - black_light
    if span <= 0:
        raise PsvideoError(
            f"white_level {levels[1]:g} is no brighter than black_level {levels[0]:g} under the curve {curve.name!r}, "
            f"whose codes run from 0 to {scale.largest} in these files. Give the plan levels counted in these codes."
        )
    codes = np.arange(256**bytes_per_code, dtype=np.float64)
    if scale.clamped:
        codes = np.minimum(codes, scale.largest)
    light = to_light(curve, scale.signal_at_0 + codes * scale.signal_per_code)
    return np.asarray((light - black_light) / span, np.float32)


def _float_light(
    codes: NDArray[np.floating], transfer: str, black: Levels | None, white: float | None
) -> NDArray[np.float32]:
    """Floating point pictures hold light already: they are scaled only where levels are given."""
    curve = find_curve(transfer)
    light = np.asarray(to_light(curve, codes) if curve.source else codes, np.float32)
    if black is None and white is None:
        return light
    ends = to_light(curve, np.array([black[0][0] if black else 0.0, 1.0 if white is None else white]))
    black_light = ends[0] if black else 0.0
    return np.asarray((light - np.float32(black_light)) / np.float32(ends[1] - black_light), np.float32)
