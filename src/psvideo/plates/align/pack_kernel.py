"""The compiled loop that packs pictures into 16-bit codes."""

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.compiled import EXACT
from psvideo.compute.memory import lent

MOST_CODE = 65535


@EXACT.kept
def pack_rows(image: NDArray[np.float32], per_step: np.float32, zero: np.float32, codes: NDArray[np.uint16]) -> None:
    """Fill ``codes`` (sample,) with those of an ``image`` (sample,): ``zero`` more than so many per unit of light."""
    given, made = lent(image), lent(codes)
    least, most = np.float32(0), np.float32(MOST_CODE)
    for place in range(made.shape[0]):
        code = given[place] * per_step + zero
        made[place] = np.uint16(np.int32(min(max(code, least), most)))
