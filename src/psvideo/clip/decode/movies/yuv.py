"""Y'CbCr to R'G'B' by the file's own matrix and range, at 16 bits, with the excursions that video range allows.

FFmpeg's own conversion takes untagged footage for BT.601 and is not used. The codes made here count signal from
``LOWEST`` to ``HIGHEST``, so that noise below black and highlights above nominal white are kept.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

LOWEST, HIGHEST = -0.25, 1.25
CODES = 65535
BAND_ROWS = 32
"""Rows that are converted at a time, an even number: what is made on the way stays in a core's second cache."""

LUMA_WEIGHTS = {
    1: ("BT.709", 0.2126, 0.0722),
    4: ("FCC", 0.30, 0.11),
    5: ("BT.601", 0.299, 0.114),
    6: ("BT.601", 0.299, 0.114),
    7: ("SMPTE 240M", 0.212, 0.087),
    9: ("BT.2020", 0.2627, 0.0593),
}
"""By matrix coefficients (ITU-T H.273, table 4): the name, and the weights of red and of blue in luma."""

Codes = NDArray[np.uint8] | NDArray[np.uint16]


def signal_range(bits: int, *, video_range: bool) -> tuple[float, float]:
    """Return the codes of signal 0 and 1: 16 and 235 at 8 bits in video range, else 0 and the largest code."""
    scale = 2.0 ** (bits - 8)
    return (16 * scale, 235 * scale) if video_range else (0.0, 2.0**bits - 1)


def to_rgb(luma: Codes, blue: Codes, red: Codes, *, bits: int, matrix: int, video_range: bool) -> NDArray[np.uint16]:
    """Return R'G'B' codes (row, col, 3); chroma of 4:2:2 and 4:2:0 is interpolated to full size.

    Chroma samples stand on even columns (as MPEG-2, H.264 and H.265 place them) and, in 4:2:0, between two rows.
    """
    rows, cols = luma.shape
    codes = np.empty((rows, cols, 3), np.uint16)
    matrix_to_codes = _to_codes(bits, matrix, video_range)
    for first in range(0, rows, BAND_ROWS):
        band = range(first, min(first + BAND_ROWS, rows))
        planes = [_band(plane, band, rows, cols, bits) for plane in (luma, blue, red)]
        cv2.transform(cv2.merge(planes), matrix_to_codes, dst=codes[band.start : band.stop])
    return codes


def _to_codes(bits: int, matrix: int, video_range: bool) -> NDArray[np.float32]:
    """Return the 3 x 4 matrix from 16-bit planes to codes (H.273, equations 38 to 51, inverted)."""
    _, weight_red, weight_blue = LUMA_WEIGHTS[matrix]
    weight_green = 1 - weight_red - weight_blue
    from_red, from_blue = 2 * (1 - weight_red), 2 * (1 - weight_blue)
    to_signal = np.array(
        [
            [1, 0, from_red],
            [1, -from_blue * weight_blue / weight_green, -from_red * weight_red / weight_green],
            [1, from_blue, 0],
        ]
    )
    zero, one = signal_range(bits, video_range=video_range)
    chroma_span = 224 * 2.0 ** (bits - 8) if video_range else one
    shift = 2.0 ** (16 - bits)
    spans = np.array([one - zero, chroma_span, chroma_span]) * shift
    centres = np.array([zero, 2.0 ** (bits - 1), 2.0 ** (bits - 1)]) * shift
    gain = to_signal / spans
    offset = -gain @ centres - LOWEST
    return np.asarray(np.column_stack([gain, offset]) * CODES / (HIGHEST - LOWEST), np.float32)


def _in_16_bits(plane: Codes, bits: int) -> NDArray[np.uint16]:
    return plane.astype(np.uint16) << np.uint16(16 - bits)


def _band(plane: Codes, band: range, rows: int, cols: int, bits: int) -> NDArray[np.uint16]:
    """Return some rows of a plane, at 16 bits and at the full size of ``rows`` and ``cols``."""
    if plane.shape[0] == rows:
        return _full_width(_in_16_bits(plane[band.start : band.stop], bits), cols)
    first, last = max(band.start // 2 - 1, 0), min((band.stop + 1) // 2 + 1, len(plane))  # with the rows beside
    some = _in_16_bits(plane[first:last], bits)
    doubled = cv2.resize(some, (some.shape[1], 2 * len(some)), interpolation=cv2.INTER_LINEAR)
    return _full_width(np.asarray(doubled[band.start - 2 * first : band.stop - 2 * first], np.uint16), cols)


def _full_width(plane: NDArray[np.uint16], cols: int) -> NDArray[np.uint16]:
    if plane.shape[1] == cols:
        return plane
    wide = np.repeat(plane, 2, axis=1)
    if plane.shape[1] > 1:
        wide[:, 1:-2:2] = cv2.addWeighted(plane[:, :-1], 0.5, plane[:, 1:], 0.5, 0)
    return np.ascontiguousarray(wide[:, :cols])
