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

from psvideo.model.arrays import Image
from psvideo.plates.align.comb import SAMPLES
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.sequence import Round

GUESSED = 1 / 1024
"""What a plate shows where motion hid what it should counts so little beside what others know of that pixel."""


def with_open_shutter(rounds: Iterable[Round]) -> Iterator[Round]:
    """Yield of every ``SAMPLES`` rounds of one number the middle one, with the mean of all as ``open_plates``."""
    for _, several in groupby(rounds, key=lambda one: one.number):
        middle: Round | None = None
        sums: list[_Sum] = []
        for place, one in enumerate(several):
            sums = sums or [_Sum(first=plate) for plate in one.plates]
            for total, plate in zip(sums, one.plates, strict=True):
                total.add(plate)
            middle = one if place == SAMPLES // 2 else middle
            del one
        if middle is not None:
            yield replace(middle, open_plates=tuple(map(_Sum.mean, sums, middle.plates)))


@dataclass(kw_only=True)
class _Sum:
    """A light's plates while the shutter is open: as long as they are the same only counted, then summed.

    ``weight`` (row, col): of how many something is known there, guesses aside; 0 in rows that no frame saw.
    """

    first: LightPlate
    times: int = 0
    total: Image | None = None
    weight: NDArray[np.float32] | None = None

    def add(self, plate: LightPlate) -> None:
        if self.total is None and plate.picture is self.first.picture:
            self.times += 1
            return
        if self.total is None or self.weight is None:
            self.weight = self.times * _weight(self.first)
            self.total = self.first.image * _like(self.weight, self.first)
        own = _weight(plate)
        self.total += plate.image * _like(own, plate)
        self.weight += own

    def mean(self, middle: LightPlate) -> LightPlate:
        if self.total is None or self.weight is None:
            return middle
        mean = self.total / _like(np.maximum(self.weight, GUESSED), middle)
        return replace(middle, picture=mixture_of(np.asarray(mean, np.float32)), seen=self.weight > 0)


def _weight(plate: LightPlate) -> NDArray[np.float32]:
    known = np.where(plate.pixels_seen, np.float32(1), np.float32(GUESSED))
    return np.asarray(known * plate.lines_seen, np.float32)


def _like(weight: NDArray[np.float32], plate: LightPlate) -> NDArray[np.float32]:
    return weight if len(plate.shape) == 2 else weight[..., None]
