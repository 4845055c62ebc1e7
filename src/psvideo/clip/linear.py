"""From code values to linear light: the transfer curve taken off, 0 at black, 1.0 at saturation.

``light = (curve(code) - curve(black)) / (curve(white) - curve(black))``. Integer codes go through a table.
"""

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.clip.decode.movies.yuv import signal_range
from psvideo.clip.decoded import CodedPicture, Header, Levels, PictureInFile
from psvideo.clip.transfer import find_curve, to_light
from psvideo.errors import PsvideoError
from psvideo.model.camera import Encoding
from psvideo.model.coded import IDENTITY, Coded, Tone


def linear_light(picture: CodedPicture, encoding: Encoding) -> NDArray[np.float32]:
    """Return a picture in linear light, same shape. The plan's levels, where it gives them, override the file's."""
    return in_codes(picture, encoding).light()


def in_codes(picture: CodedPicture | PictureInFile, encoding: Encoding) -> Coded:
    """Return a picture as it was read, and what light its codes stand for; only curves on single floats are undone.

    The plan's levels, where it gives them, override the file's.
    """
    head = picture.header
    codes = np.ascontiguousarray(picture.codes) if isinstance(picture, CodedPicture) else picture.codes
    white = head.white if encoding.white_level is None else encoding.white_level
    black = head.black if encoding.black_level is None else ((encoding.black_level,),)
    if head.bits is not None:
        return Coded(
            codes=codes, tone=_tone(_scale(head, encoding), encoding.transfer, black, white, codes.dtype.itemsize)
        )
    alike = {level for row in black for level in row} if black else {None}
    if codes.dtype == np.float16 and len(alike) == 1:
        return Coded(codes=codes.view(np.uint16), tone=_half_tone(encoding.transfer, alike.pop(), white))
    if black is None and white is None and not find_curve(encoding.transfer).source:
        return Coded(codes=codes if codes.dtype == np.float32 else np.asarray(codes, np.float32), tone=IDENTITY)
    return Coded(codes=_float_light(np.asarray(codes), encoding.transfer, black, white))


@functools.lru_cache(maxsize=32)
def _tone(scale: "Scale", transfer: str, black: Levels | None, white: float | None, bytes_per_code: int) -> Tone:
    """Return what the codes of an integer picture stand for; a curve is looked up, linear codes are computed with."""
    levels: Levels = black or ((None,),)  # type: ignore[assignment]
    if find_curve(transfer).source:
        tables = {level: light_table(scale, transfer, level, white, bytes_per_code) for row in levels for level in row}
        if len(tables) == 1:
            return Tone(table=next(iter(tables.values())))
    ends = [[_ends(scale, transfer, level, white) for level in row] for row in levels]
    zero, one = (np.array([[pair[end] for pair in row] for row in ends]) for end in (0, 1))
    most = float(scale.largest) if scale.clamped and scale.largest < 256**bytes_per_code - 1 else np.inf
    if find_curve(transfer).source:
        return Tone(
            table=np.asarray(_curved(scale, transfer, bytes_per_code), np.float32), zero=zero, gain=1 / (one - zero)
        )
    zero, one = ((end - scale.signal_at_0) / scale.signal_per_code for end in (zero, one))
    return Tone(zero=zero, gain=1 / (one - zero), most=most)


@functools.lru_cache(maxsize=4)
def _half_tone(transfer: str, black: float | None, white: float | None) -> Tone:
    values = np.arange(65536, dtype=np.uint16).view(np.float16).astype(np.float32)
    as_they_are = black is None and white is None and not find_curve(transfer).source
    with np.errstate(invalid="ignore"):  # among all halves there are those that are no number
        levels = None if black is None else ((black,),)
        return Tone(table=_float_light(values, transfer, levels, white), halves=as_they_are)


@dataclass(frozen=True, kw_only=True)
class Scale:
    """Which signal a code stands for. ``largest`` is the code that the plan's levels are counted against."""

    signal_at_0: float
    signal_per_code: float
    largest: int
    clamped: bool


DEPTHS = (8, 10, 12, 14)
"""Bits that cameras record, and that files of 16 bits may hold as they are, at their lower end."""


def white_of_others(header: Header, encoding: Encoding) -> str:
    """Say where a plan's white level was meant for other files, for no code of these reaches it; "" where it was not.
    All light counts as so much darker."""
    if header.bits is None or encoding.white_level is None or encoding.white_level < 2**header.bits:
        return ""
    return (
        f"white_level is {encoding.white_level:g} in the plan, and the largest code of these {header.bits}-bit files "
        f"is {2**header.bits - 1}: it was meant for other files"
    )


RIGHT_WHITE = "Write the code at which these saturate, or leave it out"


def level_warning(header: Header, encoding: Encoding) -> tuple[str, ...]:
    """Say where the plan's white level was meant for other files, and what to do."""
    found = white_of_others(header, encoding)
    return (f"{found}. {RIGHT_WHITE}",) if found else ()


def depth_held(bits: int, encoding: Encoding) -> int:
    """Return how many bits the codes have that a file of ``bits`` bits holds, where a curve encodes light.

    A plan's white level says so: no curve puts saturation into the lower half of its codes, so a file of 16 bits whose
    white is 1023 holds 10 bits as they are. Without a curve it makes no difference.

    >>> depth_held(16, Encoding(transfer="srgb", white_level=1023))
    10
    """
    white = encoding.white_level
    if white is None or not find_curve(encoding.transfer).source or white > 2 ** (bits - 1) - 1:
        return bits
    return next((depth for depth in DEPTHS if depth < bits and white <= 2**depth - 1), bits)


def _scale(head: Header, encoding: Encoding) -> Scale:
    """Return a picture's scale.

    Where a maker defines the curve on recorded codes (S-Log3, V-Log, Canon Log), video range is not expanded: code 420
    of 1023 is S-Log3's 18 % grey whether or not the file is tagged as video range.
    """
    largest = 2 ** (head.bits or 0) - 1
    if head.signal_per_code is None:
        largest = 2 ** depth_held(head.bits or 0, encoding) - 1
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
    zero, one = _ends(scale, transfer, black, white)
    return np.asarray((_curved(scale, transfer, bytes_per_code) - zero) / (one - zero), np.float32)


def _ends(scale: Scale, transfer: str, black: float | None, white: float | None) -> tuple[float, float]:
    """Return what black and white decode to on the curve's own scale."""
    curve = find_curve(transfer)
    levels = np.array([0.0 if black is None else black, scale.largest if white is None else white])
    zero, one = (float(light) for light in to_light(curve, levels / scale.largest))
    zero = 0.0 if black is None else zero
    if one <= zero:
        raise PsvideoError(
            f"white_level {levels[1]:g} is not brighter than black_level {levels[0]:g} under the curve {curve.name!r}, "
            f"whose codes run from 0 to {scale.largest} in these files. Give the plan levels counted in these codes."
        )
    return zero, one


def _curved(scale: Scale, transfer: str, bytes_per_code: int) -> NDArray[np.float64]:
    """Return what every code decodes to on the curve's own scale."""
    codes = np.arange(256**bytes_per_code, dtype=np.float64)
    if scale.clamped:
        codes = np.minimum(codes, scale.largest)
    return to_light(find_curve(transfer), scale.signal_at_0 + codes * scale.signal_per_code)


def _float_light(
    codes: NDArray[np.floating], transfer: str, black: Levels | None, white: float | None
) -> NDArray[np.float32]:
    """Floating point pictures hold light already: they are scaled only where levels are given, by position."""
    curve = find_curve(transfer)
    light = np.array(to_light(curve, codes) if curve.source else codes, np.float32)
    if black is None and white is None:
        return light
    one = float(to_light(curve, np.array([1.0 if white is None else white]))[0])
    zeros = to_light(curve, np.array(black)) if black else np.zeros((1, 1))
    rows, cols = zeros.shape
    for (row, col), zero in np.ndenumerate(zeros):
        place = np.s_[...] if zeros.size == 1 else np.s_[row::rows, col::cols]
        light[place] = (light[place] - np.float32(zero)) / np.float32(one - zero)
    return light
