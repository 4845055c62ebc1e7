"""Pictures that wait for the next round, held in half the memory: 16-bit codes over the range of what they show."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.threads import over_ranges
from psvideo.model.coded import Coded, StoredCodes, Tone
from psvideo.plates.align.pack_kernel import MOST_CODE, pack_rows
from psvideo.plates.mixing.mixture import Mixture

BAND_ROWS = 64
PutBy = Callable[[NDArray[Any]], NDArray[Any] | StoredCodes]
"""Puts codes by where they take no memory, if there is such a place; else returns them."""


def packed(
    picture: Mixture, saturation: float, put_by: PutBy | None = None, *, span: tuple[float, float] | None = None
) -> Mixture:
    """Return a picture in half its memory, or none, good to half a step of its codes; black and what is saturated stay
    so. One that is not made yet is held by its frames, and comes back as it is. ``span`` is its least light and its
    most, where they are known.
    """
    if not picture.is_made:
        return picture
    image = picture.image()
    least, most = span or (float(image.min()), float(image.max()))
    least, most = min(least, 0.0), max(most, 0.0)
    step = max((most - least) / (MOST_CODE - 1), 1e-12)
    zero = float(np.ceil(-least / step))
    codes = np.empty(image.shape, np.uint16)

    def pack(first: int, last: int) -> None:
        band = np.ascontiguousarray(image[first:last]).reshape(-1)
        pack_rows(band, np.float32(1 / step), np.float32(zero + 0.5), codes[first:last].reshape(-1))

    over_ranges(pack, len(image), each=BAND_ROWS)
    tone = Tone(zero=np.full((1, 1), zero), gain=np.full((1, 1), step))
    return Mixture(
        frames=(Coded(codes=codes if put_by is None else put_by(codes), tone=tone),),
        coefficients=np.ones((1, len(image))),
        ceiling=saturation,
        clips_from=saturation - step if most >= saturation else np.inf,
    )
