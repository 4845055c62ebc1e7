"""How far parts of a picture moved as a whole, however far: phase correlation of what changed, of all lights together.

C. D. Kuglin and D. C. Hines, "The phase correlation image alignment method", IEEE Cybernetics and Society 1975; here
with half of the whitening, which noise bears better.
"""

from collections.abc import Iterable

import cv2
import numpy as np

from psvideo.model.arrays import Floats

LARGEST_PX = 240
"""Pictures are made smaller until neither side is longer: a pixel more or less is left to flow."""
CHANGED_CODES, CHANGED_PX = 4.0, 5
"""Only what changes by more moved; what stands still would say that nothing does."""
LEVEL_PX = 31
AROUND_PX = 3
"""What is so near to one displacement, or to none, is no other."""


def displacements(pairs: Iterable[tuple[Floats, ...]], shape: tuple[int, ...], count: int) -> list[tuple[float, float]]:
    """Return the likeliest displacements (x right, y down, in pixels) from the first pictures to the second ones, all
    of a ``shape``; no pair is held when the next one is asked for."""
    from scipy import fft  # scipy takes 15 MB, which runs do without where nothing moves

    scale = max(-(-max(shape) // LARGEST_PX), 1)
    rows, cols = (max(side // scale, 1) for side in shape)
    size = cv2.getOptimalDFTSize(2 * rows), cv2.getOptimalDFTSize(2 * cols)
    total = np.zeros(size, np.float32)
    for pair in pairs:
        one, other = (cv2.resize(picture, (cols, rows), interpolation=cv2.INTER_AREA) for picture in pair)
        del pair
        change = cv2.blur(np.abs(other - one), (CHANGED_PX, CHANGED_PX)) > CHANGED_CODES
        one, other = ((part - cv2.blur(part, (LEVEL_PX, LEVEL_PX))) * change for part in (one, other))
        cross = fft.rfft2(other, size) * np.conj(fft.rfft2(one, size))
        found = fft.irfft2(cross / np.maximum(np.sqrt(np.abs(cross)), 1e-6), size)
        total += found / max(float(found.max()), 1e-6)
    _forget(total, 0, 0)
    places = []
    for _ in range(count):
        row, col = (int(place) for place in np.unravel_index(int(np.argmax(total)), size))
        _forget(total, row, col)
        y, x = row - size[0] * (row > size[0] // 2), col - size[1] * (col > size[1] // 2)
        places.append((float(scale * x), float(scale * y)))
    return places


def _forget(total: Floats, row: int, col: int) -> None:
    near = np.arange(-AROUND_PX, AROUND_PX + 1)
    total[np.ix_((row + near) % total.shape[0], (col + near) % total.shape[1])] = -np.inf
