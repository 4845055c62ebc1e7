"""Rows that a flash missed, from the nearest instant that saw them: for shutters below 360 degrees.

Below 360 degrees every row is blind for a part of every frame, so that each flash is missed by some rows. The dark row
rolls, and the light's next flashes, or those before, show what this one missed. A row is taken whole from the flash of
the same light that is nearest in time; ``LightPlate.flashed_s`` says which. Where something moves, ``align.lent``
brings such rows to the plate's own instant.
"""

import math
from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from psvideo.model.arrays import Bytes, Doubles, Flags
from psvideo.model.camera import Camera
from psvideo.plates.align.lent.bringing import Bringing
from psvideo.plates.align.lent.brought import brought
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.waiting_plate import WaitingPlate, pieces_lent

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


def waits_for(camera: Camera) -> int:
    """Return how many later plates of a light show every row, as a rule: as often as a row's light is caught."""
    return min(max(math.ceil(camera.frame_period_s / camera.exposure_s - BLIND), 1), MOST_LATER)


def with_nearest_rows(plates: Iterable[LightPlate], bringing: Bringing | None = None) -> Iterator[LightPlate]:
    """Yield plates in their order, the rows that they lack taken from the nearest plates of the same light.

    Held are the rows that the waiting plates' own flashes showed, and the latest that is known of each row of every
    light. Rows that no flash within reach showed stay unseen. ``bringing`` moves rows of what moves to the instant of
    the plate that lacks them; without it they come as they are.
    """
    held = _Held(bringing=bringing)
    for plate in plates:
        held.take(plate)
        del plate
        while held.can_go():
            yield held.released()
    while held.waiting:
        yield held.released()


@dataclass(kw_only=True)
class _Held:
    """What waits, in order, the latest that is ``known`` of every light, how many plates ``came``, and the place of the
    last one that rows are taken from as they are, ``until``: who waits longer for rows that are moved takes none from
    farther away where nothing moves."""

    bringing: Bringing | None
    waiting: deque[WaitingPlate] = field(default_factory=deque)
    known: dict[str, LightPlate] = field(default_factory=dict)
    came: int = 0
    until: int = 0

    def take(self, plate: LightPlate) -> None:
        """Hold one more plate."""
        if self.bringing is not None:
            self.bringing.look_at(plate)
        self.waiting.append(WaitingPlate.of(plate, self.came))
        self.came += 1

    def can_go(self) -> bool:
        """Return whether nothing nearer can come for the first plate, or it has waited enough."""
        if not self.waiting or self._enough(self.waiting[0]) is None:
            return False
        if self.bringing is None:
            return True
        first = self.waiting[0]
        later = self._later(first)
        if len(later) < self.bringing.waits and not first.plate.rows_seen.all():
            return False
        return self._has_whites() or len(later) > MOST_LATER

    def released(self) -> LightPlate:
        """Return the first plate with the rows that it lacks from the nearest others, and note what it showed."""
        self._has_whites(at_last=True)
        first, enough = self.waiting[0], self._enough(self.waiting[0])
        self.until = max(self.until, self.came if enough is None else enough)
        later = self._later(first)
        self.waiting.popleft()
        own, earlier = first.given(), self.known.get(first.plate.light)
        self.known[own.light] = own if earlier is None else _filled(own, earlier, ~own.rows_seen & earlier.rows_seen)
        if own.rows_seen.all():
            return own
        made = _with_rows(own, self.known[own.light], [one for one in later if one.place <= self.until])
        if self.bringing is None or own.light not in self.bringing.lights or own.filled is not None:
            return made
        motion = self.bringing.motion_in(own.number)
        if motion is None:
            return made
        lent = [*pieces_lent(earlier), *(rows for one in later for rows in one.lent())]
        return brought(made, own.rows_seen, lent, motion, self.bringing.reach_s(own.light))

    def _later(self, first: WaitingPlate) -> list[WaitingPlate]:
        """Return the later plates of a plate's light, in order."""
        return [one for one in self.waiting if one.plate.light == first.plate.light and one.place > first.place]

    def _enough(self, first: WaitingPlate) -> int | None:
        """Return the place of the plate with which a plate of its light, and those after it, lack nothing that is
        nearer, or have waited enough; None where that is still to come."""
        seen, earlier = first.plate.rows_seen.copy(), self.known.get(first.plate.light)
        if seen.all():
            return first.place
        for count, one in enumerate(self._later(first), start=1):
            seen |= one.plate.rows_seen
            if earlier is not None and count >= LATER:
                seen |= earlier.rows_seen
            if seen.all() or count >= MOST_LATER:
                return one.place
        return None

    def _has_whites(self, *, at_last: bool = False) -> bool:
        """Return whether the white of every light's sketches is known: that of its first plate with the rows that this
        lacks; note it once it is. ``at_last`` takes what there is."""
        if self.bringing is None:
            return True
        lacking = [light for light in self.bringing.lights if light not in self.bringing.whites]
        firsts = [next((one for one in self.waiting if one.plate.light == light), None) for light in lacking]
        here = [one for one in firsts if one is not None]
        if not at_last and (len(here) < len(lacking) or any(self._enough(one) is None for one in here)):
            return False
        if here:
            self.bringing.begin(map(self._whole, here), (one.given() for one in self.waiting))
        return True

    def _whole(self, first: WaitingPlate) -> LightPlate:
        """Return the first plate of a light with the rows that it lacks."""
        enough, own = self._enough(first), first.given()
        until = max(self.until, self.came if enough is None else enough)
        return _with_rows(own, own, [one for one in self._later(first) if one.place <= until])


def _with_rows(own: LightPlate, found: LightPlate, later: list[WaitingPlate]) -> LightPlate:
    """Return a plate with the rows that were ``found`` of it, or those of later ones where they are nearer."""
    image, shown_s, seen, full = found.image.copy(), found.flashed_s.copy(), found.rows_seen.copy(), found.filled
    for one in later:
        nearer = ~seen | (abs(one.plate.time_s - own.time_s) < np.abs(shown_s - own.time_s))
        wanted = one.plate.rows_seen & ~own.rows_seen & nearer
        one.put(image, wanted)
        shown_s[wanted], seen[wanted] = one.plate.time_s, True
        full = _full_of(full, one.plate.filled, wanted)
    return replace(own, picture=mixture_of(image), seen=seen, shown_s=shown_s, filled=full)


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
