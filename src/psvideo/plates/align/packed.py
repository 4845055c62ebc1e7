"""Pictures that wait for the next round, held in half the memory: 16-bit codes, in every band of rows over the range of
what it shows."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.compute.threads import over_ranges
from psvideo.model.arrays import Doubles, Image
from psvideo.model.coded import Coded, StoredCodes, Tone
from psvideo.plates.align.pack_kernel import MOST_CODE, pack_rows
from psvideo.plates.mixing.mixture import Mixture

BAND_ROWS = 64
"""Of lower bands more of what is read moves into its neighbours, higher ones fall out of the caches: 128 rows take a
twentieth longer, 192 a seventh."""
PutBy = Callable[[NDArray[Any]], NDArray[Any] | StoredCodes]
"""Puts codes by where they take no memory, if there is such a place; else returns them."""
LEAST_STEP = 1e-12


@dataclass(frozen=True, kw_only=True, eq=False)
class Packing:
    """Room for a picture that is packed as it is made, band by band: ``codes``, and of every row what they stand for:
    the code of no light, ``zero`` (row, 1), how much light a code is, ``step`` (row, 1), and the ``most`` that its band
    shows, (row, 1)."""

    codes: NDArray[np.uint16]
    zero: Doubles
    step: Doubles
    most: Doubles

    @classmethod
    def of(cls, shape: tuple[int, ...]) -> "Packing":
        """Return room for a picture of a shape, (row, col) or (row, col, channel)."""
        zero, step, most = np.empty((3, shape[0], 1), np.float64)
        return cls(codes=np.empty(shape, np.uint16), zero=zero, step=step, most=most)

    def put(self, first: int, band: Image) -> None:
        """Pack the rows from ``first`` on, C-contiguous: black stays black, and nothing is off by more than half a
        step."""
        least, most, _, _ = cv2.minMaxLoc(band.reshape(1, -1))  # one pass, many numbers at a time
        least, most = min(least, 0.0), max(most, 0.0)
        step = max((most - least) / (MOST_CODE - 1), LEAST_STEP)
        zero = float(np.ceil(-least / step))
        some = slice(first, first + len(band))
        self.zero[some], self.step[some], self.most[some] = zero, step, most
        pack_rows(band.reshape(-1), np.float32(1 / step), np.float32(zero + 0.5), self.codes[some].reshape(-1))

    def picture(self, saturation: float, put_by: PutBy | None = None) -> Mixture:
        """Return the picture, once all bands are in; what is saturated stays so."""
        codes = self.codes if put_by is None else put_by(self.codes)
        clips = bool(self.most.max() >= saturation)
        return Mixture(
            frames=(Coded(codes=codes, tone=Tone(zero=self.zero, gain=self.step)),),
            coefficients=np.ones((1, len(self.codes))),
            ceiling=saturation,
            clips_from=saturation - float(self.step.max()) if clips else np.inf,
        )


def packed(picture: Mixture, saturation: float, put_by: PutBy | None = None) -> Mixture:
    """Return a picture in half its memory, or none, good to half a step of its codes; black and what is saturated stay
    so. One that is not made yet is held by its frames, and comes back as it is.
    """
    if not picture.is_made:
        return picture
    image = picture.image()
    packing = Packing.of(image.shape)

    def pack(first: int, last: int) -> None:
        packing.put(first, np.ascontiguousarray(image[first:last]))

    over_ranges(pack, len(image), each=BAND_ROWS)
    return packing.picture(saturation, put_by)
