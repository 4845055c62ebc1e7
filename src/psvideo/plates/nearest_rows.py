"""Rows that a flash missed, from the nearest instant that saw them: for shutters below 360 degrees.

Below 360 degrees every row is blind for a part of every frame, so that each flash is missed by some rows. The dark row
rolls, and the light's next flashes, or those before, show what this one missed. A row is taken whole from the flash of
the same light that is nearest in time; ``LightPlate.flashed_s`` says which. Nothing is moved: what is not at rest in
such rows is a matter for alignment, which goes by the rows that a plate's own flash showed.
"""

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Bytes, Doubles, Flags
from psvideo.model.camera import Camera
from psvideo.plates.align.lent.bringing import Bringing
from psvideo.plates.align.lent.brought import LentRows, brought
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.several_lights.clipped_flashes import with_filled

LATER, MOST_LATER = 2, 8
"""A plate waits for later ones of its light: for two where earlier ones showed what it lacks, for eight at a clip's
start, where none did."""
BLIND = 1e-3
"""Share of the frame period for which rows must be blind to be worth the wait."""


def has_blind_time(camera: Camera) -> bool:
    """Return whether rows are closed for a part of frames, so that flashes may miss them.

    An exposure that is longer than the period is one of a movie whose rate varies: places are closer than its frames.
    """
    return abs(camera.exposure_s / camera.frame_period_s - 1) > BLIND


def with_nearest_rows(plates: Iterable[LightPlate], bringing: Bringing | None = None) -> Iterator[LightPlate]:
    """Yield plates in their order, the rows that they lack taken from the nearest plates of the same light.

    Held are the rows that the waiting plates' own flashes showed, and the latest that is known of each row of every
    light. Rows that no flash within reach showed stay unseen.
    """
    waiting: deque[_Waiting] = deque()
    known: dict[str, LightPlate] = {}
    for plate in plates:
        if bringing is not None:
            bringing.look_at(plate)
        waiting.append(_Waiting.of(plate))
        del plate
        while _can_go(waiting, known):
            yield _released(waiting, known, bringing)
    while waiting:
        yield _released(waiting, known, bringing)


@dataclass(frozen=True, kw_only=True)
class _Waiting:
    """A plate; where its own flash did not show all of it, only the ``rows`` are held that this showed, and ``plate``
    has no picture."""

    plate: LightPlate
    rows: NDArray[np.float32] | None
    shape: tuple[int, ...]

    @classmethod
    def of(cls, plate: LightPlate) -> "_Waiting":
        """Hold a plate."""
        plate = with_filled(plate)
        if plate.rows_seen.all():
            return cls(plate=plate, rows=None, shape=plate.shape)
        rows = plate.picture.rows(np.flatnonzero(plate.rows_seen))
        return cls(plate=replace(plate, picture=mixture_of(rows[:0])), rows=rows, shape=plate.shape)

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


def _later(waiting: deque[_Waiting]) -> list[_Waiting]:
    """Return the later plates of the first one's light, in order."""
    first = waiting[0].plate.light
    return [one for n, one in enumerate(waiting) if n and one.plate.light == first]


def _can_go(waiting: deque[_Waiting], known: dict[str, LightPlate]) -> bool:
    """Return whether nothing nearer can come for the first plate, or it has waited enough."""
    if not waiting:
        return False
    seen, later = waiting[0].plate.rows_seen.copy(), _later(waiting)
    for one in later:
        seen |= one.plate.rows_seen
    earlier = known.get(waiting[0].plate.light)
    if earlier is not None and len(later) >= LATER:
        seen |= earlier.rows_seen
    return bool(seen.all()) or len(later) >= MOST_LATER


def _released(waiting: deque[_Waiting], known: dict[str, LightPlate], bringing: Bringing | None) -> LightPlate:
    """Return the first plate with the rows that it lacks from the nearest others, and note what it showed itself."""
    later, first = _later(waiting), waiting.popleft()
    own = first.given()
    earlier = known.get(own.light)
    known[own.light] = own if earlier is None else _filled(own, earlier, ~own.rows_seen & earlier.rows_seen)
    if own.rows_seen.all():
        return own
    found = known[own.light]
    motion = None if bringing is None or own.filled is not None else bringing.motion_in(own.number)
    lent = [] if motion is None else [*_lent(earlier), *(run for one in later for run in _lent(one.given()))]
    image, shown_s, seen, full = found.image.copy(), found.flashed_s.copy(), found.rows_seen.copy(), found.filled
    for one in later:
        nearer = ~seen | (abs(one.plate.time_s - own.time_s) < np.abs(shown_s - own.time_s))
        wanted = one.plate.rows_seen & ~own.rows_seen & nearer
        one.put(image, wanted)
        shown_s[wanted], seen[wanted] = one.plate.time_s, True
        full = _full_of(full, one.plate.filled, wanted)
    filled = replace(own, picture=mixture_of(image), seen=seen, shown_s=shown_s, filled=full)
    return filled if motion is None else brought(filled, own.rows_seen, lent, motion)


def _lent(plate: LightPlate | None) -> list[LentRows]:
    """Return the pieces of rows that a plate shows, each of one flash."""
    if plate is None:
        return []
    image, shown_s, seen = plate.image, plate.flashed_s, plate.rows_seen
    ends = np.flatnonzero((np.diff(shown_s) != 0) | (np.diff(seen.astype(np.int8)) != 0)) + 1
    runs = zip([0, *ends], [*ends, len(seen)], strict=True)
    return [LentRows(image=image[a:b], first=int(a), time_s=float(shown_s[a])) for a, b in runs if seen[a]]


def _full_of(own: Bytes | None, other: Bytes | None, rows: Flags) -> Bytes | None:
    """Return what is filled of a plate with some rows of another."""
    return None if own is None or other is None else np.where(rows[:, None], other, own)


def _filled(plate: LightPlate, other: LightPlate, rows: Flags) -> LightPlate:
    """Return a plate with some rows of another."""
    if not rows.any():
        return plate
    image = np.array(plate.image)
    image[rows] = other.image[rows]
    shown_s: Doubles = np.where(rows, other.flashed_s, plate.flashed_s)
    full = _full_of(plate.filled, other.filled, rows)
    return replace(plate, picture=mixture_of(image), seen=plate.rows_seen | rows, shown_s=shown_s, filled=full)
