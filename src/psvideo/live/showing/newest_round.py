"""The newest round: of the latest frames and the clock as it is known now, by the recipes that every clip goes through.

Rounds for which there is no time are left out; the ambient light is that of the latest dark slots that were looked at.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from psvideo.model.coded import Coded
from psvideo.model.plan import Plan
from psvideo.model.timing import Flash, Timing, timed_camera
from psvideo.plates.ambient.ambient_followed import Ambient, update
from psvideo.plates.ambient.ambient_off import subtract
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import shown_level
from psvideo.plates.sequence import AMBIENT, FIRST_NUMBER, Round, gathered, light_plates
from psvideo.plates.split import plate_of


@dataclass(frozen=True, kw_only=True)
class PlacedFrame:
    """A frame at its place in time, as plates take it."""

    index: int
    coded: Coded


@dataclass(kw_only=True)
class LiveRounds:
    """Makes rounds of one camera at one size; ``plan`` is that of this size. ``number`` is the next round's."""

    plan: Plan
    ambient: Ambient | None = None
    number: int = FIRST_NUMBER
    done_s: float = float("-inf")
    dark_s: float = float("-inf")

    def newest(self, frames: Mapping[int, Coded], timing: Timing) -> Round | None:
        """Return the newest round that the frames (by place in time) hold whole, None where there is no new one."""
        lit = _newest_whole(timing.flashes, self.plan)
        if not lit or lit[0].start_s < self.done_s:
            return None
        self.done_s = lit[-1].start_s + 0.5 * self.plan.dark_s
        placed = [PlacedFrame(index=place, coded=coded) for place, coded in sorted(frames.items())]
        camera = timed_camera(self.plan, timing)
        for dark in _latest_dark(timing.flashes, self.dark_s, lit[-1].start_s + self.plan.cycle_s):
            self.dark_s = dark.start_s + 0.5 * self.plan.dark_s
            plate = plate_of(dark, placed, camera, timing)
            self.ambient = self.ambient if plate is None else update(self.ambient, plate)
        plates = [plate for flash in lit if (plate := plate_of(flash, placed, camera, timing)) is not None]
        free = subtract(plates, known=self.ambient, waits=False)
        named = light_plates(free, self.plan, timing.flashes)
        one = next(gathered(named, self.plan.lights, expected=lambda _: set(self.plan.lights), whole=True), None)
        if one is None:
            return None
        number, self.number = self.number, self.number + 1
        lights = tuple(replace(plate, number=number) for plate in one.plates)
        return replace(one, number=number, plates=lights, ambient=self._ambient_plate(number))

    def _ambient_plate(self, number: int) -> LightPlate | None:
        if self.ambient is None:
            return None
        ambient = self.ambient
        time_s = float(ambient.middle_s.mean())
        return LightPlate(
            light=AMBIENT, number=number, time_s=time_s, picture=shown_level(ambient.level), seen=ambient.known
        )


def _newest_whole(flashes: tuple[Flash, ...], plan: Plan) -> list[Flash]:
    """Return the lit flashes of the newest round of which all are complete, none where there is no such round."""
    rounds: list[list[Flash]] = []
    for flash, before in zip(flashes, (None, *flashes), strict=False):
        if before is None or flash.slot <= before.slot:
            rounds.append([])
        rounds[-1].append(flash)
    for one in reversed(rounds):
        lit = [flash for flash in one if not flash.is_dark and flash.complete]
        if len(lit) == len(plan.lit_slots):
            return lit
    return []


def _latest_dark(flashes: tuple[Flash, ...], after_s: float, until_s: float) -> list[Flash]:
    """Return the last complete dark slot between two times, if any: a newer picture of it is worth more than all."""
    dark = [flash for flash in flashes if flash.is_dark and flash.complete and after_s < flash.start_s < until_s]
    return dark[-1:]
