"""How a job's instants, rounds and frames follow each other: which rounds some instants are made of, and which frames
some rounds."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from psvideo.model.rows.shutter import frames_touched
from psvideo.model.timing import Timing, places_in_time, timed_camera
from psvideo.plates.align.comb import Schedule
from psvideo.plates.gather import scheduled
from psvideo.plates.sequence import round_numbers
from psvideo.plates.several_lights.unmixed import slot_names
from psvideo.plates.used_flashes import used_of
from psvideo.runs.instants.job import Job


@dataclass(frozen=True)
class Succession:
    """The order of a job's instants. Numbers are those of results, rounds those of the clip, places those in time."""

    job: Job

    @cached_property
    def used(self) -> Timing:
        """The timing, with the flashes as complete that the take holds."""
        return used_of(self.job.take, self.job.timing)

    @cached_property
    def rounds(self) -> tuple[int, ...]:
        """Every flash's round."""
        return round_numbers(self.job.timing.flashes, start=self.job.start_number)

    @cached_property
    def due(self) -> Schedule | None:
        """The instants of a steady rate, by round; None where rounds decide."""
        job = self.job
        return scheduled(job.take, job.timing, job.over_time.aligning, start_number=job.start_number)

    @cached_property
    def numbers(self) -> range:
        """The range in which the numbers of all instants lie."""
        if self.due is not None:
            return range(self.due.numbers[0], self.due.numbers[-1] + 1) if self.due.numbers else range(0)
        lit = [n for flash, n in zip(self.used.flashes, self.rounds, strict=True) if flash.complete and flash.lit]
        start, each = self.job.start_number, self._each
        return range(start + (lit[0] - start) * each, start + (lit[-1] + 1 - start) * each) if lit else range(0)

    @property
    def _each(self) -> int:
        """How many instants a round has, at other than steady rates."""
        plan, apart = self.job.take.plan, self.job.take.unmixing is not None
        each_flash = self.job.over_time.aligning.rate == "flash"
        return len(slot_names(plan) if apart else plan.lights) if each_flash else 1

    def rounds_of(self, numbers: range) -> range:
        """Return the rounds that instants are made of."""
        if self.due is None:
            start, each = self.job.start_number, self._each
            return range(start + (numbers[0] - start) // each, start + (numbers[-1] - start) // each + 1)
        own = [one for one, several in self.due.by_round.items() if any(number in numbers for number, _ in several)]
        if own:
            return range(min(own), max(own) + 1)
        before = [one for one, several in self.due.by_round.items() if several[0][0] < numbers.start]
        return range(max(before, default=self.rounds[0]), max(before, default=self.rounds[0]) + 1)

    def frames(self, first: int, own: int, last: int) -> tuple[int, ...]:
        """Return the frames that rounds from the first to the last are made of, with a dark slot before the round
        ``own`` and one after the last, where there are such."""
        job = self.job
        places = places_in_time(job.timing, job.take.clip.numbers)
        camera = timed_camera(job.take.plan, job.timing)
        begin, end = frames_touched(camera, job.timing.start_s, job.timing.duration_s)
        within = [n for n, number in enumerate(self.rounds) if first <= number <= last]
        dark = [flash.index for flash in self.used.flashes if flash.complete and flash.is_dark]
        within += [n for n in dark if self.rounds[n] < own][-1:] + [n for n in dark if self.rounds[n] > last][:1]
        least, most = int(np.min(begin[within])), int(np.max(end[within]))
        return tuple(number for number in job.take.numbers if number in places and least <= places[number] <= most)
