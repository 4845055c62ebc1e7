"""Where a light that was taken out of flashes of several says nothing, since one of them is clipped.

Its value there is a ceiling, in one round and not in the next: a flash that two frames share clips neither. So two
rounds are not compared there.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Bytes
from psvideo.plates.light_plate import LightPlate

FULL, NEARLY_FULL = 2, 1
NEARLY_CLIPPED = 0.45
"""What is clipped in one round shows at least this share of saturation in the next: half, where two frames share the
flash, less noise."""
ROWS_AT_ONCE = 256


def filled_of(plate: LightPlate, rows: range) -> Bytes | None:
    """Return what is ``FULL`` in some rows of a plate, and ``NEARLY_FULL`` where it may be in another round, shape
    (row, col); None where every value is light."""
    if not plate.unmixed:
        return None
    if plate.filled is not None:
        some = plate.filled[rows.start : rows.stop : rows.step]
        return some if some.any() else None
    lower = replace(plate.picture, clips_from=NEARLY_CLIPPED * plate.picture.clips_from)
    nearly = _at_ceiling(replace(plate, picture=lower), rows)
    if not nearly.any():
        return None
    return np.where(_at_ceiling(plate, rows), FULL, np.where(nearly, NEARLY_FULL, 0)).astype(np.uint8)


def with_filled(plate: LightPlate) -> LightPlate:
    """Return a plate that carries what is filled of it, as it must before it gets another picture."""
    if not plate.unmixed or plate.filled is not None:
        return plate
    filled = filled_of(plate, range(plate.shape[0]))
    return replace(plate, filled=np.broadcast_to(np.uint8(0), plate.shape[:2]) if filled is None else filled)


def vague_between(before: Bytes | None, after: Bytes | None) -> NDArray[np.bool_] | None:
    """Return where one of two rounds says nothing, as the other may as well, (row, col); None where both always speak.

    Where one says nothing and the other is far from clipped, something changed.
    """
    if before is None or after is None:
        return None
    return np.asarray((np.minimum(before, after) >= NEARLY_FULL) & (np.maximum(before, after) == FULL))


def coarser(filled: Bytes | None, rows: int, cols: int) -> Bytes | None:
    """Return the fullest of every ``rows`` by ``cols`` pixels; what is left over at the ends goes.

    >>> coarser(np.array([[0, 1, 2, 0, 2]], np.uint8), 1, 2)
    array([[1, 2]], dtype=uint8)
    """
    if filled is None:
        return None
    high, wide = filled.shape[0] // rows, filled.shape[1] // cols
    return np.asarray(filled[: high * rows, : wide * cols].reshape(high, rows, wide, cols).max(axis=(1, 3)))


def _at_ceiling(plate: LightPlate, rows: range) -> NDArray[np.bool_]:
    """Return where any channel is clipped, (row, col)."""
    full = np.empty((len(rows), plate.shape[1]), np.bool_)
    for first in range(0, len(rows), ROWS_AT_ONCE):
        some = rows[first : first + ROWS_AT_ONCE]
        clipped = plate.picture.rows(some) >= np.float32(plate.saturation)
        full[first : first + len(some)] = clipped.reshape(*clipped.shape[:2], -1).any(axis=2)
    return full
