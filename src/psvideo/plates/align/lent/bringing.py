"""How everything moves in every round of plates that lack rows, by what the flashes around it showed of theirs."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from psvideo.plates.align.lent.row_sightings import motion_by_rows
from psvideo.plates.align.plate_lamps import Lamps
from psvideo.plates.align.velocity.flow import Sketch, sketch_of, white_of
from psvideo.plates.align.velocity.followed import Followed
from psvideo.plates.light_plate import LightPlate

HELD = 5
"""Motion is found between flashes that are no more rounds from an instant, and rows come from no farther away."""


@dataclass(kw_only=True)
class Bringing:
    """Of the plates of ``lights``, which shine as the ``lamps`` (None where that is not known), by light and round the
    ``sketches`` of rows that their own flashes showed, and how everything moves in the last round that was asked for.

    A plate ``waits`` for so many later ones of its light. ``whites`` are the light of the sketches' brightest code."""

    lights: tuple[str, ...]
    waits: int
    lamps: Lamps | None = None
    whites: dict[str, float] = field(default_factory=dict)
    sketches: dict[tuple[str, int], Sketch] = field(default_factory=dict)
    motions: dict[int, Followed | None] = field(default_factory=dict)

    def begin(self, firsts: Iterable[LightPlate], waiting: Iterable[LightPlate]) -> None:
        """Note the whites of lights' first plates, which are whole, and sketch what waits of these."""
        self.whites |= {plate.light: white_of(plate) for plate in firsts}
        for plate in waiting:
            self.look_at(plate)
            del plate  # none is held while the next one is made

    def look_at(self, plate: LightPlate) -> None:
        """Sketch a plate of which only its own rows are there; for now it is left out where its white is not known."""
        place = plate.light, plate.number
        if plate.light in self.lights and plate.light in self.whites and place not in self.sketches:
            self.sketches[place] = sketch_of(plate, white=self.whites[plate.light])

    def motion_in(self, number: int) -> Followed | None:
        """Return how everything moves in the middle of a round; None where nothing does. Rounds come in order."""
        if number not in self.motions:
            self.sketches = {place: sketch for place, sketch in self.sketches.items() if place[1] >= number - HELD}
            self.motions = {number: self._found(number)}
        return self.motions[number]

    def reach_s(self, light: str) -> float:
        """Return how far from a plate flashes may be whose rows are moved to it."""
        times_s = {number: sketch.time_s for (name, number), sketch in self.sketches.items() if name == light}
        first, last = min(times_s), max(times_s)
        return HELD * (times_s[last] - times_s[first]) / max(last - first, 1)

    def _found(self, number: int) -> Followed | None:
        own_s = [sketch.time_s for (_, of_round), sketch in self.sketches.items() if of_round == number]
        if not own_s:
            return None
        shots = {
            light: [one for (name, at), one in self.sketches.items() if name == light and at <= number + HELD]
            for light in self.lights
        }
        return motion_by_rows(shots, float(np.mean(own_s)), self.lamps)
