"""Which flashes of a clip the frames that are used hold whole: a run may be asked for a part of the frames."""

from collections.abc import Sequence
from dataclasses import replace

from psvideo.clip import Take
from psvideo.model.rows.shutter import frames_touched
from psvideo.model.timing import Timing, places_in_time, timed_camera


def used_of(take: Take, timing: Timing, numbers: Sequence[int] | None = None) -> Timing:
    """Take as complete only the flashes whose frames all lie between the take's first frame and its last, or between
    those of ``numbers``."""
    camera, places = timed_camera(take.plan, timing), places_in_time(timing, take.clip.numbers)
    first, last = frames_touched(camera, timing.start_s, timing.duration_s)
    used = [places[number] for number in (numbers or take.numbers) if number in places]
    begin, end = (used[0], used[-1]) if used else (0, -1)  # all of them are repeated, and show nothing new
    flashes = tuple(
        replace(flash, complete=flash.complete and bool(first[n] >= begin and last[n] <= end))
        for n, flash in enumerate(timing.flashes)
    )
    return replace(timing, flashes=flashes)
