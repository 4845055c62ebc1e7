"""The latest frames in their codes, by their places in time: never more of them than rounds need."""

import math
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field

from psvideo.model.coded import Coded
from psvideo.model.plan import Plan

ROUNDS = 2.5
"""This many rounds are held: the newest whole one lies in them wherever it begins, while it is solved."""
SPARE = 6


@dataclass(frozen=True, kw_only=True)
class RingFrame:
    """A frame in the ring; ``came_s`` is when it came, by the machine's clock."""

    coded: Coded
    came_s: float


@dataclass(kw_only=True)
class Ring:
    """At most ``most`` frames by place in time; the oldest leave."""

    most: int
    frames: OrderedDict[int, RingFrame] = field(default_factory=OrderedDict)

    def add(self, place: int, frame: RingFrame) -> None:
        """Take in the newest frame."""
        self.frames[place] = frame
        while len(self.frames) > self.most:
            self.frames.popitem(last=False)

    def of_height(self, height_px: int) -> dict[int, RingFrame]:
        """Return the frames of so many rows: those of the size that is made now, and not of the one before."""
        return {place: frame for place, frame in self.frames.items() if frame.coded.shape[0] == height_px}

    def moved_from(self, first: int, later: int) -> None:
        """Put the frames from the place ``first`` on by so many places later."""
        self.placed(lambda place: later if place >= first else 0)

    def placed(self, later: Callable[[int], int]) -> None:
        """Give frames other places: each as many later as is returned for its own."""
        self.frames = OrderedDict((place + later(place), frame) for place, frame in self.frames.items())


def ring_of(plan: Plan) -> Ring:
    """Return an empty ring for a plan's rounds."""
    round_s = plan.cycle_s / len(plan.dark_rounds)
    return Ring(most=math.ceil(ROUNDS * round_s / plan.camera.frame_period_s) + SPARE)
