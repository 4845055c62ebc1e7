"""The latest frames in their codes, by their places in time: never more of them than rounds need."""

import math
from collections import OrderedDict
from collections.abc import Mapping
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

    def moved(self, places: Mapping[int, int]) -> None:
        """Give frames other places in time: what stood at a key stands at its value, what is not named goes."""
        self.frames = OrderedDict((places[at], frame) for at, frame in self.frames.items() if at in places)


def ring_of(plan: Plan) -> Ring:
    """Return an empty ring for a plan's rounds."""
    round_s = plan.cycle_s / len(plan.dark_rounds)
    return Ring(most=math.ceil(ROUNDS * round_s / plan.camera.frame_period_s) + SPARE)
