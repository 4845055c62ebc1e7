"""Polynomial texture maps as .ptm: version 1.2, format LRGB (Malzbender and Gelb, "Polynomial Texture Map (.ptm) File
Format", Hewlett-Packard 2001), which RTIViewer and other desktop programs of museums and archives open.

A pixel's channels are its colour times L / 255, with L = a0 u² + a1 v² + a2 u v + a3 u + a4 v + a5 in the light's
direction (u, v). The file holds the six numbers of all pixels as bytes, then the colours of all, bottom row first.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from psvideo.formats.whole_files import whole_file

ORDER = [3, 5, 4, 1, 2, 0]
"""Where the file's a0 to a5 stand among 1, u, v, u², u v, v²."""
CODES = 255
BAND_ROWS = 256


def write_ptm(
    path: Path,
    colour: NDArray[np.uint8],
    terms: NDArray[np.float16],
    low: NDArray[np.float64],
    span: NDArray[np.float64],
) -> None:
    """Write codes of colour (row, col, 3) and the polynomials of 1, u, v, u², u v, v² that scale it (row, col, 6).

    Numbers of a term from ``low`` to so much more, (6), are told apart; others are cut.
    """
    least = np.minimum(low[ORDER], 0.0)
    step = np.maximum(low[ORDER] + span[ORDER] - least, 1e-3) / CODES
    bias = np.rint(-least / step)
    rows, cols = colour.shape[:2]
    header = (
        f"PTM_1.2\nPTM_FORMAT_LRGB\n{cols}\n{rows}\n"
        f"{' '.join(f'{CODES * one:.8g}' for one in step)}\n{' '.join(f'{int(one)}' for one in bias)}\n"
    )
    with whole_file(path) as beside, beside.open("wb") as file:
        file.write(header.encode("ascii"))
        for end in range(rows, 0, -BAND_ROWS):
            band = terms[max(end - BAND_ROWS, 0) : end][::-1].astype(np.float64)[..., ORDER]
            file.write(np.clip(np.rint(band / step + bias), 0, CODES).astype(np.uint8).tobytes())
        file.write(colour[::-1].tobytes())
