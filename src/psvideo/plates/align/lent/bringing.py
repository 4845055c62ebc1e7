"""Rounds whose plates lack rows, and how everything moves in them."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from psvideo.plates.align.lent.brought import LentRows, brought
from psvideo.plates.align.lent.row_sightings import motion_by_rows
from psvideo.plates.align.velocity.flow import Sketch, sketch_of, white_of
from psvideo.plates.align.velocity.followed import Followed
from psvideo.plates.light_plate import LightPlate

HELD = 5


@dataclass(kw_only=True)
class Bringing:
    lights: tuple[str, ...]
    whites: dict[str, float] = field(default_factory=dict)
    sketches: dict[tuple[str, int], Sketch] = field(default_factory=dict)
    motions: dict[int, Followed | None] = field(default_factory=dict)

    def look_at(self, plate: LightPlate) -> None:
        """Sketch a plate of which only its own rows are there."""
        if plate.light in self.lights:
            if plate.light not in self.whites:
                self.whites[plate.light] = white_of(plate)
            self.sketches[plate.light, plate.number] = sketch_of(plate, white=self.whites[plate.light])

    def motion_in(self, number: int) -> Followed | None:
        if number not in self.motions:
            for key in [key for key in self.sketches if key[1] < number - HELD]:
                del self.sketches[key]
            self.motions = {}
            own = [sketch.time_s for (_, n), sketch in self.sketches.items() if n == number]
            shots = [
                [sketch for (light, n), sketch in self.sketches.items() if light == name and n <= number + HELD]
                for name in self.lights
            ]
            self.motions[number] = motion_by_rows(shots, float(np.mean(own))) if own else None
        return self.motions[number]
