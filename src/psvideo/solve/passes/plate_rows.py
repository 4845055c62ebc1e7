"""Plates a band of rows at a time, whether they lie in memory or are made from codes as they are read."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.threads import over_ranges
from psvideo.model.arrays import Floats, Mask, Samples
from psvideo.plates.mixing.mixture import Mixture, Reader, mixture_of

BAND_PIXELS = 1 << 15


@dataclass(frozen=True, kw_only=True)
class PlateRows:
    """One plate per light: what makes its rows, and ``seen`` (light, row[, col]), None where all is."""

    shape: tuple[int, ...]
    readers: tuple[Reader, ...]
    seen: Mask | None

    @classmethod
    def of(cls, plates: Sequence[Samples] | Sequence[Mixture], seen: Mask | None) -> "PlateRows":
        """Hold plates; nothing is made yet."""
        mixtures = [plate if isinstance(plate, Mixture) else mixture_of(plate) for plate in plates]
        return cls(shape=mixtures[0].shape, readers=tuple(plate.reader() for plate in mixtures), seen=seen)

    def over_bands(self, run: Callable[[int, int], None]) -> None:
        """Call ``run(first, last)`` for bands of rows, side by side."""
        over_ranges(run, self.shape[0], each=max(BAND_PIXELS // self.shape[1], 1))

    def light(self, place: int, first: int, last: int) -> Floats:
        """Return a light's rows, (row, col, channel), in linear light."""
        return self.readers[place](first, last).reshape(last - first, self.shape[1], -1)

    def shown(self, place: int, first: int, last: int) -> NDArray[np.bool_]:
        """Return where a light's rows were seen, (row, col) or (row, 1)."""
        if self.seen is None:
            return np.ones((last - first, 1), np.bool_)
        return self.seen[place, first:last].reshape(last - first, -1)
