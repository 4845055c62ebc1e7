"""A plate that waits until others have shown the rows that its own flash missed."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Flags
from psvideo.plates.align.lent.brought import LentRows
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.several_lights.clipped_flashes import with_filled


@dataclass(frozen=True, kw_only=True)
class WaitingPlate:
    """A plate, and how many came before it; where its own flash did not show all of it, only the ``rows`` are held that
    this showed, and ``plate`` has no picture."""

    plate: LightPlate
    rows: NDArray[np.float32] | None
    shape: tuple[int, ...]
    place: int

    @classmethod
    def of(cls, plate: LightPlate, place: int) -> "WaitingPlate":
        """Hold a plate."""
        plate = with_filled(plate)
        if plate.rows_seen.all():
            return cls(plate=plate, rows=None, shape=plate.shape, place=place)
        rows = plate.picture.rows(np.flatnonzero(plate.rows_seen))
        return cls(plate=replace(plate, picture=mixture_of(rows[:0])), rows=rows, shape=plate.shape, place=place)

    def given(self) -> LightPlate:
        """Return the plate with its own rows, the others 0."""
        if self.rows is None:
            return self.plate
        image = np.zeros(self.shape, np.float32)
        image[self.plate.rows_seen] = self.rows
        return replace(self.plate, picture=mixture_of(image))

    def put(self, image: NDArray[np.float32], wanted: Flags) -> None:
        """Write those of its rows that are wanted."""
        if self.rows is None:
            image[wanted] = self.plate.picture.rows(np.flatnonzero(wanted))
        else:
            image[wanted] = self.rows[wanted[self.plate.rows_seen]]

    def lent(self) -> list[LentRows]:
        """Return the pieces of rows that its own flash showed."""
        if self.rows is None:
            return pieces_lent(self.plate)
        places, rows, time_s = np.flatnonzero(self.plate.rows_seen), self.rows, self.plate.time_s
        some = _pieces(places - np.arange(len(places)))
        return [LentRows(image=rows[one], first=int(places[one.start]), time_s=time_s) for one in some]


def pieces_lent(plate: LightPlate | None) -> list[LentRows]:
    """Return the pieces of rows that a plate shows, each of one flash."""
    if plate is None:
        return []
    image, shown_s, seen = plate.image, plate.flashed_s, plate.rows_seen
    return [
        LentRows(image=image[some], first=some.start, time_s=float(shown_s[some.start]))
        for some in _pieces(np.where(seen, shown_s, np.inf))
        if seen[some.start]
    ]


def _pieces(values: NDArray[Any]) -> list[slice]:
    """Return the longest pieces of one value each.

    >>> _pieces(np.array([1.0, 1.0, 2.0]))
    [slice(0, 2, None), slice(2, 3, None)]
    """
    ends = [*(np.flatnonzero(values[1:] != values[:-1]) + 1).tolist(), len(values)]
    return [slice(first, last) for first, last in zip([0, *ends[:-1]], ends, strict=True) if first < last]
