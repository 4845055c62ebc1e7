"""Rows that a flash missed, from the nearest instant that saw them: for shutters below 360 degrees.

Below 360 degrees every row is blind for a part of every frame, so that each flash is missed by some rows. The dark row
rolls, and the light's next flashes, or those before, show what this one missed. A row is taken whole from the flash of
the same light that is nearest in time; ``LightPlate.flashed_s`` says which. Nothing is moved: what is not at rest in
such rows is a matter for alignment, which goes by the rows that a plate's own flash showed.
"""

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from psvideo.model.camera import Camera, FloatArray
from psvideo.plates.sequence import LightPlate

LATER = 2
"""A plate waits for so many later ones of its light at most: each that waits costs memory."""
BLIND = 1e-3
"""Share of the frame period for which rows must be blind to be worth the wait."""


def has_blind_time(camera: Camera) -> bool:
    """Return whether rows are closed for a part of every frame, so that flashes may miss them."""
    return camera.exposure_s < (1 - BLIND) * camera.frame_period_s


def with_nearest_rows(plates: Iterable[LightPlate]) -> Iterator[LightPlate]:
    """Yield plates in their order, the rows that they lack taken from the nearest plates of the same light.

    Held are the plates that wait, two rounds of them at most, and for every light the latest that is known of each row.
    Rows that no flash around showed stay unseen.
    """
    waiting: deque[_Waiting] = deque()
    latest: dict[str, LightPlate] = {}
    for plate in plates:
        for one in waiting:
            one.offer(plate)
        known = latest.get(plate.light)
        now = _Waiting(plate=plate)
        if known is not None:
            now.fill(known)
        latest[plate.light] = _newer(known, plate)
        waiting.append(now)
        del plate, now
        while waiting and waiting[0].done:
            yield waiting.popleft().result
    while waiting:
        yield waiting.popleft().result


@dataclass(kw_only=True)
class _Waiting:
    """A plate with what was found so far of the rows that it lacks; ``later`` counts the plates of its light since."""

    plate: LightPlate
    filled: LightPlate | None = None
    later: int = field(default=0)

    @property
    def done(self) -> bool:
        """True where nothing better can come."""
        return self.later >= LATER or bool(self.plate.rows_seen.all())

    @property
    def result(self) -> LightPlate:
        """The plate as far as it is known."""
        return self.plate if self.filled is None else self.filled

    def offer(self, later: LightPlate) -> None:
        """Take the rows that a later plate shows and nothing nearer did."""
        if later.light == self.plate.light and not self.done:
            self.later += 1
            self.fill(later)

    def fill(self, other: LightPlate) -> None:
        """Take the rows of another plate of this light that are missing here, or nearer in time than what is held."""
        held = self.result
        away_s = np.abs(other.flashed_s - self.plate.time_s)
        nearer = ~held.rows_seen | (away_s < np.abs(held.flashed_s - self.plate.time_s))
        taken = ~self.plate.rows_seen & other.rows_seen & nearer
        if taken.any():
            self.filled = _with_rows(held, other, taken, copy=self.filled is None)


def _newer(known: LightPlate | None, plate: LightPlate) -> LightPlate:
    """Return the latest that is known of every row of a light."""
    if known is None or plate.rows_seen.all():
        return plate
    return _with_rows(plate, known, ~plate.rows_seen & known.rows_seen, copy=True)


def _with_rows(plate: LightPlate, other: LightPlate, rows: NDArray[np.bool_], *, copy: bool) -> LightPlate:
    image = plate.image.copy() if copy else plate.image
    image[rows] = other.image[rows]
    flashed_s: FloatArray = np.where(rows, other.flashed_s, plate.flashed_s)
    return replace(plate, image=image, seen=plate.rows_seen | rows, shown_s=flashed_s)
