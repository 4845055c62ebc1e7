"""A shutter that the flashes froze, open again: plates at many instants while it is open, and their mean.

Linz et al. 2010 give pictures from flashes the blur of any exposure by summing in-between pictures along the motion.
Here every picture in between is made by the alignment, from the two flashes around it, so that what comes out from
behind something else while the shutter is open is seen as well.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from psvideo.model.coded import Image
from psvideo.plates.align.comb import SAMPLES
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixture import Mixture, made
from psvideo.plates.sequence import Round


def opened(rounds: Iterable[Round]) -> Iterator[Round]:
    """Yield of every ``SAMPLES`` rounds of one number the middle one, with the mean of all as ``open_plates``."""
    for _, several in groupby(rounds, key=lambda one: one.number):
        middle: Round | None = None
        sums: list[_Sum] = []
        for place, one in enumerate(several):
            sums = sums or [_Sum.of(plate) for plate in one.plates]
            for total, plate in zip(sums, one.plates, strict=True):
                total.add(plate)
            middle = one if place == SAMPLES // 2 else middle
            del one
        if middle is not None:
            yield replace(middle, open_plates=tuple(map(_Sum.mean, sums, middle.plates)))


@dataclass(kw_only=True)
class _Sum:
    """A light's plates while the shutter is open, as long as they are the same only counted; then summed where known.

    ``count`` (row, col): how many of them are known there.
    """

    same: Mixture | None
    times: int = 0
    total: Image | None = None
    count: NDArray[np.float32] | None = None

    @classmethod
    def of(cls, plate: LightPlate) -> "_Sum":
        return cls(same=plate.picture)

    def add(self, plate: LightPlate) -> None:
        if self.same is plate.picture:
            self.times += 1
            return
        if self.same is not None:
            whole = np.ones(plate.shape[:2], np.float32) * np.float32(self.times)
            self.total, self.count, self.same = self.times * self.same.image(), whole, None
        if self.total is None or self.count is None:
            raise ValueError("a sum needs its first plate")
        known = plate.pixels_seen.astype(np.float32)
        self.total += plate.image * (known if self.total.ndim == 2 else known[..., None])
        self.count += known

    def mean(self, middle: LightPlate) -> LightPlate:
        if self.total is None or self.count is None:
            return middle
        count = np.maximum(self.count, 1.0)
        mean = np.asarray(self.total / (count if self.total.ndim == 2 else count[..., None]), np.float32)
        return replace(middle, picture=made(mean), seen=self.count > 0)
