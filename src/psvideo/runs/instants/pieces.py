"""A run cut into ranges of instants that are solved apart, in any order and on any machine, to the same bytes.

An instant depends on those around it, but no further than is known: results at rest are pooled over blocks of rounds,
averages over blocks of their own, plates are aligned with those of the neighbouring rounds, borrow rows that their
flash missed, and wait for the next dark slot. So a piece solves some instants before its own, and reads some frames
after. All else comes from the clip's first instant and from earlier dark slots.
"""

import shutil
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path

import numpy as np

from psvideo.compute.progress import Watch, unwatched
from psvideo.errors import UsageError
from psvideo.export.sequences.result_files import is_written
from psvideo.model.rows.shutter import frames_touched
from psvideo.model.timing import Timing, places_in_time, timed_camera
from psvideo.plates.align.comb import Schedule
from psvideo.plates.ambient.ambient_shown import ambient_before
from psvideo.plates.gather import scheduled
from psvideo.plates.nearest_rows import MOST_LATER, has_blind_time
from psvideo.plates.part import Part
from psvideo.plates.sequence import POOLED_ROUNDS, round_numbers
from psvideo.plates.several_lights.unmixed import slot_names
from psvideo.plates.used_flashes import used_of
from psvideo.runs.instants.job import Beginning, Found, Job, Piece
from psvideo.runs.instants.piece_notes import FOLDER, note_subject, note_timing, noted, noted_subject, write_notes
from psvideo.runs.instants.reporting import observing
from psvideo.runs.instants.solving import beginning_of, knowing_subject, write_instants

BESIDE = 3
"""Rounds on either side that aligning looks at: two, and one that the cut leaves incomplete."""
ROWS_SEEN = 16
"""Rounds in which every row that a flash missed is taken to have been seen by another, where the shutter is closed for
a part of every frame."""


def cut(numbers: range, count: int) -> tuple[range, ...]:
    """Return a range in this many pieces, as equal as they come; fewer where there are not this many numbers.

    >>> cut(range(1001, 1008), 3)
    (range(1001, 1003), range(1003, 1005), range(1005, 1008))
    """
    count = max(min(count, len(numbers)), 1)
    edges = [numbers.start + n * len(numbers) // count for n in range(count + 1)]
    return tuple(range(first, last) for first, last in pairwise(edges))


def piece_named(text: str, numbers: range) -> range:
    """Return the range that a word such as ``3/10`` names, the third of ten; empty where there are not this many
    numbers.

    ``0/10`` names none of them. Raises UsageError for other words.
    """
    place, slash, count = text.partition("/")
    if not (slash and place.isdecimal() and count.isdecimal() and int(place) <= int(count)):
        raise UsageError(
            f"`piece` {text}: expected which of how many, from 1/10 to 10/10, or 0/10 to find what all of them share."
        )
    pieces = (range(0), *cut(numbers, int(count)))
    return pieces[int(place)] if int(place) < len(pieces) else range(0)


def write_piece(job: Job, folder: Path, piece: str, *, watch: Watch = unwatched) -> Found:
    """Solve one piece into a folder that is not finished, and note what it found; return that."""
    numbers = piece_named(piece, Succession(job).numbers)
    note_timing(folder, job.timing)
    job = _knowing_subject(job, folder, watch=watch)
    return _written(job, folder, numbers, beginning_of(job) if numbers else None, watch=watch)


def pieces_begun(folder: Path) -> bool:
    """Return whether pieces of a run were solved into a folder."""
    return (folder / FOLDER).is_dir()


def pieced_together(job: Job, folder: Path, *, watch: Watch = unwatched) -> Found:
    """Solve what no piece has solved yet, and return what all of them found."""
    missing = [*_missing(Succession(job).numbers, _done(job, folder))]
    job = _knowing_subject(job, folder, watch=watch) if missing else job
    beginning = beginning_of(job) if missing else None
    for numbers in missing:
        _written(job, folder, numbers, beginning, watch=watch)
    whole, chosen = Found(observed=observing(job.take, job.lighting.rig, job.lighting.masks)), _done(job, folder)
    for numbers, found in noted(folder):
        if numbers in chosen:
            whole.followed_by(found)
    return whole


def forget_pieces(folder: Path) -> None:
    """Remove what pieces noted, once all is done."""
    shutil.rmtree(folder / FOLDER, ignore_errors=True)


def _knowing_subject(job: Job, folder: Path, *, watch: Watch) -> Job:
    """Return the job with what all rounds share of their subject, as the first piece found and noted it."""
    job = replace(job, subject=noted_subject(folder))
    if job.subject is None:
        job = knowing_subject(job, spare=folder, watch=watch)
    if job.subject is not None:
        note_subject(folder, job.subject)
    return job


def _done(job: Job, folder: Path) -> list[range]:
    """Return the numbers of the pieces that are done, none of which reaches into another: a folder's pieces may have
    been cut in several ways, and what is between those that are chosen is solved again."""
    done: list[range] = []
    for numbers, found in noted(folder):
        if numbers.start >= (done[-1].stop if done else 0) and _is_there(job, folder, found):
            done.append(numbers)
    return done


def _is_there(job: Job, folder: Path, found: Found) -> bool:
    """Return whether the files of all instants that were noted are there: somebody may have removed some."""
    clip = job.take.clip.name
    return all(is_written(folder, clip, one.number, job.delivery) for one in found.observed.facts)


def _missing(numbers: range, done: Iterable[range]) -> Iterator[range]:
    """Give the ranges of numbers that are in none of those done, which are in order."""
    start = numbers.start
    for one in done:
        if one.start > start:
            yield range(start, one.start)
        start = max(start, one.stop)
    if start < numbers.stop:
        yield range(start, numbers.stop)


def _written(job: Job, folder: Path, numbers: range, beginning: Beginning | None, *, watch: Watch) -> Found:
    if beginning is None:
        return Found(observed=observing(job.take, job.lighting.rig, job.lighting.masks))
    piece = Pieces(job=job, beginning=beginning).of(numbers)
    found = write_instants(job, folder, piece=piece, resume=True, watch=watch)
    write_notes(folder, numbers, found)
    return found


@dataclass(frozen=True, kw_only=True)
class Pieces:
    """A job to be cut, and what its first instant leaves to the others."""

    job: Job
    beginning: Beginning

    def of(self, numbers: range) -> Piece:
        """Return what is needed to solve a range of instants; decodes the dark slots before it."""
        frames = self._frames(numbers)
        if frames[0] == self.job.take.numbers[0]:
            begins_here = self.beginning.number in numbers
            part = Part(numbers=frames, whites={} if begins_here else dict(self.beginning.whites))
            return Piece(numbers=numbers, part=part, beginning=None if begins_here else self.beginning)
        complete = [flash.index for flash in used_of(self.job.take, self.job.timing, frames).flashes if flash.complete]
        ambient = ambient_before(self.job.take, self.job.timing, complete[0]) if complete else None
        part = Part(numbers=frames, whites=dict(self.beginning.whites), ambient=ambient)
        return Piece(numbers=numbers, part=part, beginning=self.beginning)

    def _frames(self, numbers: range) -> tuple[int, ...]:
        """Return the frames that a range of instants is made from."""
        job = self.job
        course = Succession(job)
        borrows = job.take.plan.mode != "synced" and has_blind_time(timed_camera(job.take.plan, job.timing))
        rounds = course.rounds_of(numbers)
        before = course.rounds_of(range(self._solved_from(numbers.start), numbers.start + 1)).start
        first = before // POOLED_ROUNDS * POOLED_ROUNDS - BESIDE - (ROWS_SEEN + MOST_LATER if borrows else 0)
        last = rounds.stop - 1 + BESIDE + (MOST_LATER + 1 if borrows else 0)
        return course.frames(first, rounds.start, last)

    def _solved_from(self, number: int) -> int:
        """Return the number of the first instant that one with this number depends on."""
        average = self.job.over_time.denoise
        if average > 1:
            number = (number // average - 1) * average
        return (number // POOLED_ROUNDS - 1) * POOLED_ROUNDS - 1


@dataclass(frozen=True)
class Succession:
    """How a job's instants, rounds and frames follow each other."""

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
