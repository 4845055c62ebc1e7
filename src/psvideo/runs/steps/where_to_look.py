"""Where in a take a check looks: at its start, or where more is to be seen, as of a subject that enters late."""

from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import pairwise

import cv2
import numpy as np

from psvideo.clip import Take, read_frames
from psvideo.compute.progress import Watch
from psvideo.errors import NoStrobeError
from psvideo.model.arrays import Floats
from psvideo.model.timing import Timing
from psvideo.report.judge.of_frames import FrameLight, frame_light
from psvideo.runs.steps.checked_frames import EARLY_FRAMES, light_of_frames, more_frames, numbers_from, too_short
from psvideo.sync.take_timing import find_timing

PLACES, EACH = 8, 3
"""So many places of a take are glanced at, and so many frames in a row: flashes make each of them another picture."""
BLOCKS, MOST_LIT = 64, 0.98
"""Glances compare means of this many blocks along each side, and of these the fiftieth that changes most: a subject
may be small."""
MORE = 2.0
"""A place is worth a look where it changes by this many times what the start does, a stop. Frames of one strobe whose
pictures stay alike, some of them beside a dark slot, differ by less."""
MOST_TRIED = 2
"""At so many other parts of the take flashes are looked for: the bound on what is read."""


@dataclass(frozen=True, kw_only=True)
class LookedAt:
    """The frames of ``take`` are those that are judged, ``timing`` when their flashes fired, None where no strobe is
    seen. ``fault`` says why its start shows none, empty where it does; ``tried`` are the parts that show none, by their
    frames' numbers, and ``glances`` what was seen elsewhere. ``moved``: another part than the start is judged."""

    take: Take
    timing: Timing | None
    fault: str = ""
    tried: tuple[tuple[int, ...], ...] = ()
    glances: tuple["ShortLook", ...] = ()
    moved: bool = False

    @property
    def numbers(self) -> set[int]:
        """Numbers of all frames that were looked at."""
        parts = (self.take.numbers, *self.tried, *(one.numbers for one in self.glances))
        return {number for part in parts for number in part}


@dataclass(frozen=True, kw_only=True)
class ShortLook:
    """A few frames in a row, by their ``numbers``: how much the picture ``changes`` from one to the next where it does
    most, in linear light, and how bright each is."""

    numbers: tuple[int, ...]
    changes: float
    lights: tuple[FrameLight, ...]


def look(start: Take, later: Iterable[FrameLight], *, first_light: str | None, watch: Watch) -> LookedAt:
    """Find the flashes at a take's start or, where these are not seen or ``later`` frames are far brighter, at the part
    that shows most of them. Raises NoStrobeError where the take is too short to show a strobe."""
    try:
        take, timing = _timed(start, first_light, watch)
    except NoStrobeError as fault:
        if too_short(start.clip.plan, start.numbers):
            raise
        tried = replace(start, numbers=more_frames(start) or start.numbers)
        glances = _glances(start)
        return _elsewhere(
            LookedAt(take=start, timing=None, fault=str(fault), tried=(tried.numbers,), glances=glances),
            first_light,
            watch,
        )
    looked = LookedAt(take=take, timing=timing)
    if not _brighter(take, later):
        return looked
    return _elsewhere(replace(looked, glances=_glances(take)), first_light, watch)


def where_words(looked: LookedAt) -> tuple[str, ...]:
    """Say that another part than the start of a take is judged, and why; nothing where it is the start."""
    if not looked.moved:
        return ()
    why = "its start shows no strobe" if looked.fault else "its start shows far less light"
    return (
        f"All of this is of frames {_span(looked.take.numbers)}: {why}, as where the subject is not in the picture "
        "yet, or no lamp flashes.",
    )


def in_vain_words(looked: LookedAt) -> str:
    """Say why a take's start shows no strobe, and where else it was looked for."""
    others = [_span(part) for part in looked.tried[1:]]
    if others:
        return f"{looked.fault} Nor is it found in frames {' and '.join(others)}, where the picture changes most."
    if looked.glances:
        return f"{looked.fault} That is of frames {_span(looked.tried[0])}; glances at the rest show no more."
    return looked.fault


def _span(numbers: Sequence[int]) -> str:
    return f"{numbers[0]} to {numbers[-1]}"


def _timed(take: Take, first_light: str | None, watch: Watch) -> tuple[Take, Timing]:
    """Return when a take's flashes fired, and the take with the frames that showed it: as many again, up to a bound,
    where the first ones are too few, as beside frames that are missing. Raises NoStrobeError where neither show it."""
    try:
        return take, find_timing(take, first_light=first_light, watch=watch)
    except NoStrobeError:
        more = more_frames(take)
        if not more:
            raise
        wider = replace(take, numbers=more)
        with suppress(NoStrobeError):
            return wider, find_timing(wider, first_light=first_light, watch=watch)
        raise


def _elsewhere(looked: LookedAt, first_light: str | None, watch: Watch) -> LookedAt:
    """Look at the parts that change most, one after the other, until one shows the flashes; else return the start."""
    start = looked.take
    for part in _parts(looked):
        take = replace(start, numbers=part)
        try:
            take, timing = _timed(take, first_light, watch)
        except NoStrobeError:
            looked = replace(looked, tried=(*looked.tried, more_frames(take) or part))
            continue
        return replace(looked, take=take, timing=timing, moved=True)
    return looked


def _parts(looked: LookedAt) -> list[tuple[int, ...]]:
    """Return the numbers of the frames of other parts that are worth a look, best first, each as long as the start."""
    clip, size = looked.take.clip, len(looked.take.numbers)
    here = max(one.changes for one in _over(looked.take, looked.take.numbers))
    changes = [0.0, *(one.changes for one in looked.glances), 0.0]
    firsts = list[int]()
    for n in sorted(range(1, len(changes) - 1), key=lambda n: -changes[n]):
        place = clip.numbers.index(looked.glances[n - 1].numbers[0])
        first = place if changes[n + 1] >= changes[n - 1] else place + EACH - size  # on the side where more is seen
        first = min(max(first, 0), len(clip.numbers) - size)
        if changes[n] > MORE * here and all(abs(first - other) >= size for other in firsts):
            firsts.append(first)
    return [numbers_from(clip, first, size) for first in firsts[:MOST_TRIED]]


def _glances(take: Take) -> tuple[ShortLook, ...]:
    """Glance at places over the rest of the take, the last frames among them."""
    numbers = take.clip.numbers
    return _over(take, numbers[len(take.numbers) :])


def _over(take: Take, numbers: Sequence[int]) -> tuple[ShortLook, ...]:
    """Glance at places spread evenly over some frames; at none where these are too few."""
    if len(numbers) < EACH:
        return ()
    firsts = np.unique(np.linspace(0, len(numbers) - EACH, PLACES).round().astype(int)).tolist()
    return tuple(_glance(take, tuple(numbers[first : first + EACH])) for first in firsts)


def _glance(take: Take, numbers: tuple[int, ...]) -> ShortLook:
    blocks, lights = list[Floats](), list[FrameLight]()
    for frame in read_frames(take.clip, numbers, kept=take.kept):  # a movie is sought, not decoded on the way there
        image = np.nan_to_num(frame.image, nan=0.0)
        lights.append(frame_light(image))
        grey = image if image.ndim == 2 else image.mean(axis=2)
        size = (min(BLOCKS, grey.shape[1]), min(BLOCKS, grey.shape[0]))
        blocks.append(np.asarray(cv2.resize(grey, size, interpolation=cv2.INTER_AREA), np.float32))
    steps = np.max([np.abs(after - before) for before, after in pairwise(blocks)], axis=0)
    return ShortLook(numbers=numbers, changes=float(np.quantile(steps, MOST_LIT)), lights=tuple(lights))


def _brighter(take: Take, later: Iterable[FrameLight]) -> bool:
    """Return whether later frames are brighter than all at the start by so much that more is to be seen there."""
    most = max((one.top for one in later), default=0.0)
    return most > MORE * max(1e-6, *(one.top for one in light_of_frames(take, EARLY_FRAMES)))
