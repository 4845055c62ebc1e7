"""A run cut into ranges of instants that are solved apart, in any order and on any machine, to the same bytes.

What every piece solves and reads beside its own instants is in ``piece_frames``.
"""

import shutil
from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

from psvideo.compute.progress import Watch, unwatched
from psvideo.errors import UsageError
from psvideo.export.sequences.result_files import is_written
from psvideo.runs.instants.job import Beginning, Found, Job
from psvideo.runs.instants.piece_frames import piece_of
from psvideo.runs.instants.piece_notes import FOLDER, note_subject, note_timing, noted, noted_subject, write_notes
from psvideo.runs.instants.reporting import observing
from psvideo.runs.instants.solving import beginning_of, knowing_subject, write_instants
from psvideo.runs.instants.succession import Succession


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
    piece = piece_of(job, beginning, numbers)
    found = write_instants(job, folder, piece=piece, resume=True, watch=watch)
    write_notes(folder, numbers, found)
    return found
