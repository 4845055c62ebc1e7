"""What a range of instants needs beside its own frames, so that it is solved to the same bytes as in a whole run.

An instant depends on those around it, but no further than is known:

- results at rest are pooled over blocks of rounds, averages are over blocks of their own;
- plates are aligned with those of the neighbouring rounds;
- rows that a flash missed are borrowed from other rounds;
- ambient light is taken between two dark slots.

So a piece solves some instants before its own, and reads some frames after. All else comes from the clip's first
instant and from earlier dark slots.
"""

from psvideo.model.timing import timed_camera
from psvideo.plates.ambient.ambient_shown import ambient_before
from psvideo.plates.nearest_rows import MOST_LATER, has_blind_time
from psvideo.plates.part import Part
from psvideo.plates.sequence import POOLED_ROUNDS, VOTING_BLOCKS
from psvideo.plates.used_flashes import used_of
from psvideo.runs.instants.job import Beginning, Job, Piece
from psvideo.runs.instants.succession import Succession

BESIDE = 3
"""Rounds on either side that aligning looks at: two, and one that the cut leaves incomplete."""
ROWS_SEEN = 16
"""Rounds in which every row that a flash missed is taken to have been seen by another, where the shutter is closed for
a part of every frame."""


def piece_of(job: Job, beginning: Beginning, numbers: range) -> Piece:
    """Return what is needed to solve a range of instants; decodes the dark slots before it.

    ``beginning`` is what the clip's first instant leaves to all others.
    """
    frames = frames_of(job, numbers)
    whites = dict(beginning.whites)
    if frames[0] == job.take.numbers[0]:
        if beginning.number in numbers:  # the first instant itself is solved here: it finds all this once more
            return Piece(numbers=numbers, part=Part(numbers=frames, whites={}), beginning=None)
        return Piece(numbers=numbers, part=Part(numbers=frames, whites=whites), beginning=beginning)
    complete = [flash.index for flash in used_of(job.take, job.timing, frames).flashes if flash.complete]
    ambient = ambient_before(job.take, job.timing, complete[0]) if complete else None
    return Piece(numbers=numbers, part=Part(numbers=frames, whites=whites, ambient=ambient), beginning=beginning)


def frames_of(job: Job, numbers: range) -> tuple[int, ...]:
    """Return the frames that a range of instants is made from, those that it depends on included."""
    course = Succession(job)
    own = course.rounds_of(numbers)
    earliest = course.rounds_of(range(_solved_from(job, numbers.start), numbers.start + 1)).start
    first, last = _first_of_block(earliest) - BESIDE, own.stop - 1 + BESIDE
    borrows = job.take.plan.mode != "synced" and has_blind_time(timed_camera(job.take.plan, job.timing))
    if borrows:  # rows come from other rounds, of which the latest must be whole
        first, last = first - ROWS_SEEN - MOST_LATER, last + MOST_LATER + 1
    return course.frames(first, own.start, last)


def _solved_from(job: Job, number: int) -> int:
    """Return the number of the first instant that the one with this number depends on.

    It is pooled with its own block of rounds and the one before, and VOTING_BLOCKS before its own vote on its classes.
    What moves at the start of the first block is known from the two instants before it: in the first of these, nothing
    is known to move yet. Where results are averaged, all this is so of the first instant of the average before.
    """
    average = job.over_time.denoise
    if average > 1:
        number = (number // average - 1) * average
    return _first_of_block(number) - VOTING_BLOCKS * POOLED_ROUNDS - 2


def _first_of_block(number: int) -> int:
    """Return the first of the block of rounds whose results are pooled, in which one with this number stands."""
    return number // POOLED_ROUNDS * POOLED_ROUNDS
