"""The plates of one round by either method of splitting, computed from the few frames that the round touches.

Algorithm 1 follows the dark row from frame to frame, so it starts at the clip's first frame, as ``split`` does
by this method; in long clips it starts a few hundred frames before the round.
"""

import itertools
import threading
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.memory import HALF_MAX
from psvideo.errors import PsvideoError
from psvideo.formats.timing_json import timing_record
from psvideo.model.choices import SplitMethod
from psvideo.model.timing import Timing, places_in_time

if TYPE_CHECKING:
    from psvideo.clip import Take
    from psvideo.plates.light_plate import LightPlate

RUN_UP: Mapping[SplitMethod, int] = {"weights": 0, "hudon2015": 240}
"""Frames before a round that a method looks at, where there are this many."""


@dataclass(frozen=True, kw_only=True)
class ComparedPlate:
    """One light's plate of a round, as half floats (row, col[, channel])."""

    image: NDArray[np.float16]
    time_s: float
    number: int


class ComparedPlates:
    """Gives a clip's plates by time; the timing is found once, and of each method the last round is kept.

    What computes them is loaded when the first is asked for: it takes longer than the page itself.
    """

    def __init__(self, clip: Path, *, plan: Path | None = None, timing: Path | None = None) -> None:
        self._clip, self._plan, self._given = clip, plan, timing
        self._take: Take | None = None
        self._timing: Timing | None = None
        self._rounds: dict[SplitMethod, tuple[int, Mapping[str, ComparedPlate]]] = {}
        self._lock = threading.Lock()

    def timing(self) -> Timing:
        """Return when every flash fired: as given, else found from all frames of the clip, which takes its time."""
        with self._lock:
            return self._timed()[1]

    def record(self) -> Mapping[str, object]:
        """Return what the page's diagram of flashes is drawn from."""
        with self._lock:
            take, timing = self._timed()
        numbers = take.clip.numbers
        in_numbers = {after for after, following in itertools.pairwise(numbers) if following - after > 1}
        dropped = [
            {"after": hole.after, "count": hole.count, "numbered": hole.after in in_numbers}
            for hole in timing.dropped_frames
        ]
        return timing_record(timing) | {"first_number": numbers[0], "dropped_frames": dropped}

    def plate(self, method: SplitMethod, light: str, time_s: float, *, of: str | None = None) -> ComparedPlate:
        """Return a light's plate of the round at a time: the one whose flashes of the light ``of`` are nearest to it;
        None: the one whose middle is. Raises PsvideoError where there is none."""
        with self._lock:
            take, timing = self._timed()
            number = _nearest_round(timing, of, time_s)
            if method not in self._rounds or self._rounds[method][0] != number:
                self._rounds[method] = (number, _plates(take, timing, method, number))
            plates = self._rounds[method][1]
        if light not in plates:
            raise PsvideoError(f"Round {number} has no plate of {light} by this method.")
        return plates[light]

    def _timed(self) -> tuple["Take", Timing]:
        from psvideo.plates.named_timing import read_or_find_timing
        from psvideo.sync.open_take import open_take

        if self._take is None:
            self._take = open_take(self._clip, plan=self._plan)
        if self._timing is None:
            self._timing = read_or_find_timing(self._take, self._given, first_light=None)
        return self._take, self._timing


def _nearest_round(timing: Timing, light: str | None, time_s: float) -> int:
    """Return the number of the round whose complete flashes of a light, or whose middle (None), are nearest to a
    time."""
    from psvideo.plates.sequence import round_numbers

    by_round: dict[int, list[float]] = {}
    for number, flash in zip(round_numbers(timing.flashes), timing.flashes, strict=True):
        if flash.complete and (flash.lit if light is None else light in flash.lit):
            by_round.setdefault(number, []).append(flash.start_s + 0.5 * flash.duration_s)
    if not by_round:
        of = "" if light is None else f" of {light}"
        raise PsvideoError(f"The clip holds no complete flash{of}, so there is nothing to compare.")
    if light is None:
        by_round = {number: [sum(middles_s) / len(middles_s)] for number, middles_s in by_round.items()}
    return min(by_round, key=lambda number: min(abs(middle_s - time_s) for middle_s in by_round[number]))


def _plates(take: "Take", timing: Timing, method: SplitMethod, number: int) -> Mapping[str, ComparedPlate]:
    """Rebuild one round from the frames that it touches, and those before them that the method follows."""
    from psvideo.model.rows.shutter import frames_touched
    from psvideo.model.timing import timed_camera
    from psvideo.plates.gather import gather
    from psvideo.plates.sequence import round_numbers

    flashes = [place for place, found in enumerate(round_numbers(timing.flashes)) if found == number]
    first, last = frames_touched(timed_camera(take.plan, timing), timing.start_s, timing.duration_s)
    begin, end = int(first[flashes[0]]) - RUN_UP[method], int(last[flashes[-1]]) + 1
    places = places_in_time(timing, take.clip.numbers)
    near = tuple(one for one in take.numbers if one in places and begin <= places[one] <= end)
    if len(near) < 2:
        raise PsvideoError(f"Round {number} lies where frames are missing, so its plates cannot be rebuilt.")
    for one in gather(replace(take, numbers=near), timing, method=method):
        if one.number == number:
            return {plate.light: _kept(plate) for plate in one.plates}
    return {}


def _kept(plate: "LightPlate") -> ComparedPlate:
    image = np.clip(plate.image, -HALF_MAX, HALF_MAX).astype(np.float16)
    return ComparedPlate(image=image, time_s=plate.time_s, number=plate.number)
