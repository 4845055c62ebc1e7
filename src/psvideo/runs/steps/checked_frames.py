"""Which frames of a take a check looks at, and what those of the rest say: holes, light and exposure."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from psvideo.clip import Clip, Take, read_frames
from psvideo.model.plan import Plan
from psvideo.model.timing import DroppedFrames, Timing
from psvideo.report.judge.of_frames import FrameLight, frame_light, later_frames
from psvideo.report.judgement import Judgement

LEAST_FRAMES, MOST_FRAMES = 30, 160
ROUNDS = 4
"""This many rounds are looked at, where the clip is long enough."""
WIDER = 2
"""So many times as many where these show no strobe."""
SPREAD = 6
"""More frames, over the rest of the take: whether light and exposure stay."""
EARLY_FRAMES = 16
"""About this many frames from the start are what later ones are compared with."""


def frames_to_check(plan: Plan, numbers: Sequence[int]) -> tuple[int, ...]:
    """Return the frames from a clip's start that show a few rounds, and a whole cycle with its marker."""
    if plan.mode == "synced":
        return tuple(numbers[: ROUNDS * len(plan.flashes)])
    per_frame = plan.camera.frame_period_s
    round_s = plan.cycle_s / len(plan.dark_rounds)
    wanted = max(ROUNDS * round_s / per_frame, 1.3 * plan.marker_s / per_frame + 6)
    return tuple(numbers[: min(max(math.ceil(wanted), LEAST_FRAMES), MOST_FRAMES)])


def numbers_from(clip: Clip, first: int, count: int) -> tuple[int, ...]:
    """Return the numbers of so many frames from the ``first`` place on, or before it where the clip ends sooner."""
    first = max(min(first, len(clip.numbers) - count), 0)
    return tuple(clip.numbers[first : first + count])


def more_frames(take: Take) -> tuple[int, ...]:
    """Return the frames to look at where some of a take's show no strobe: as many again, up to a bound; empty where
    the clip has no more."""
    wider = max(min(WIDER * len(take.numbers), MOST_FRAMES), len(take.numbers))
    more = numbers_from(take.clip, take.clip.numbers.index(take.numbers[0]), wider)
    return more if len(more) > len(take.numbers) else ()


def too_short(plan: Plan, numbers: Sequence[int]) -> bool:
    """Return whether so few frames cannot be expected to show the strobe."""
    return len(numbers) < 2 * len(plan.cycle_slots) / len(plan.dark_rounds) + 3


def later_numbers(clip: Clip, window: tuple[int, ...]) -> tuple[int, ...]:
    """Return a few frames from the rest; none of a movie, which would have to be decoded on the way there."""
    rest = clip.numbers[len(window) :]
    if clip.is_movie or len(rest) < SPREAD:
        return ()
    return tuple(rest[round(place)] for place in np.linspace(0, len(rest) - 1, SPREAD))


def with_later_holes(timing: Timing, clip: Clip) -> Timing:
    """Add the holes that the numbering shows after the frames that were looked at."""
    known = {hole.after for hole in timing.dropped_frames}
    more = [DroppedFrames(after=after, count=count) for after, count in clip.dropped if after not in known]
    return replace(timing, dropped_frames=(*timing.dropped_frames, *more))


def light_by_number(take: Take, numbers: Sequence[int]) -> dict[int, FrameLight]:
    """Measure single frames of a take."""
    return {one.number: frame_light(one.image) for one in read_frames(take.clip, numbers, kept=take.kept)}


def light_of_frames(take: Take, count: int) -> list[FrameLight]:
    """Measure about this many of a take's frames, spread over them."""
    numbers = take.numbers[:: max(len(take.numbers) // count, 1)]
    return [frame_light(frame.image) for frame in read_frames(take.clip, numbers, kept=take.kept)]


def later_light(take: Take, late: Sequence[FrameLight], *, elsewhere: bool) -> tuple[Judgement, ...]:
    """Judge frames from the rest of the take against those that were looked at; nothing where there are none.
    ``elsewhere``: these are not the take's start."""
    return (later_frames(light_of_frames(take, EARLY_FRAMES), late, elsewhere=elsewhere),) if late else ()
