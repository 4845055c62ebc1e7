"""How a picture is turned to stand upright: the eight ways in which a rectangle can lie.

A rolling shutter works along the rows of the sensor, whichever way the camera was held: frames are timed and rebuilt as
the sensor read them, and plates are turned upright.
"""

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Number = TypeVar("Number", bound=np.generic)


@dataclass(frozen=True, kw_only=True)
class Turn:
    """Rows and columns change places first, then each axis may run backwards."""

    transposed: bool = False
    rows_flipped: bool = False
    cols_flipped: bool = False

    @property
    def is_none(self) -> bool:
        """Whether the picture stands upright already."""
        return not (self.transposed or self.rows_flipped or self.cols_flipped)

    def upright(self, picture: NDArray[Number]) -> NDArray[Number]:
        """Return a picture (row, col[, channel]) as it is to be seen, in memory of its own where it was turned.

        >>> CLOCKWISE.upright(np.array([[1, 2, 3], [4, 5, 6]])).tolist()
        [[4, 1], [5, 2], [6, 3]]
        """
        if self.is_none:
            return picture
        turned = picture.swapaxes(0, 1) if self.transposed else picture
        return np.ascontiguousarray(turned[:: -1 if self.rows_flipped else 1, :: -1 if self.cols_flipped else 1])

    def size(self, width_px: int, height_px: int) -> tuple[int, int]:
        """Return width and height of the upright picture."""
        return (height_px, width_px) if self.transposed else (width_px, height_px)

    def __str__(self) -> str:
        return WORDS[self.transposed, self.rows_flipped, self.cols_flipped]


UPRIGHT = Turn()
CLOCKWISE = Turn(transposed=True, cols_flipped=True)

WORDS = {
    (False, False, False): "upright",
    (False, False, True): "mirrored left to right",
    (False, True, False): "mirrored top to bottom",
    (False, True, True): "turned by 180 degrees",
    (True, False, False): "turned by 90 degrees and mirrored",
    (True, False, True): "turned by 90 degrees clockwise",
    (True, True, False): "turned by 90 degrees counter-clockwise",
    (True, True, True): "turned by 90 degrees the other way and mirrored",
}

EXIF = {
    1: UPRIGHT,
    2: Turn(cols_flipped=True),
    3: Turn(rows_flipped=True, cols_flipped=True),
    4: Turn(rows_flipped=True),
    5: Turn(transposed=True),
    6: CLOCKWISE,
    7: Turn(transposed=True, rows_flipped=True, cols_flipped=True),
    8: Turn(transposed=True, rows_flipped=True),
}
"""By the orientation that EXIF and TIFF write (TIFF 6.0, section 8; CIPA DC-008, Orientation)."""


def of_matrix(across: tuple[float, float], down: tuple[float, float]) -> Turn | None:
    """Return the turn of a container's matrix (ISO 14496-12, 6.2.2): where a step to the right and one down lead to.

    None where that is no turn by quarters: an angle between, or nothing at all.

    >>> of_matrix((0, 1), (-1, 0)) == CLOCKWISE
    True
    """
    straight = across[1] == 0 == down[0] and across[0] != 0 != down[1]
    quarter = across[0] == 0 == down[1] and across[1] != 0 != down[0]
    if straight:
        return Turn(cols_flipped=across[0] < 0, rows_flipped=down[1] < 0)
    return Turn(transposed=True, rows_flipped=across[1] < 0, cols_flipped=down[0] < 0) if quarter else None
