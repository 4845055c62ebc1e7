"""A take's timing: its frames are decoded once, for their row profiles, and the flashes are found in these."""

from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.clip import Take, check_take, read_frames
from psvideo.compute.progress import Watch, unwatched
from psvideo.compute.threads import thread_count
from psvideo.errors import NoStrobeError
from psvideo.model.arrays import Doubles
from psvideo.model.rows.row_profiles import collect_with_doubt
from psvideo.model.timing import DroppedFrames, Timing
from psvideo.model.units import counted
from psvideo.sync.find import timing_from_rows
from psvideo.sync.sideways import another_camera, refuse_sideways

MOST_NAMED = 8
"""Holes that a sentence names."""


@dataclass(frozen=True, kw_only=True)
class TakeProfiles:
    """What a take's frames show row by row.

    index: (frame,), places in time as the files' numbers say; value: (frame, row), row means in linear light.
    doubt: (frame, row), by how much a mean may be wrong because pixels are saturated; None where none is.
    """

    index: NDArray[np.int64]
    value: Doubles
    doubt: NDArray[np.float32] | None = None


def take_profiles(take: Take, *, watch: Watch = unwatched) -> TakeProfiles:
    """Decode a take once, and keep what was decoded where the take has a store; a synced clip is not decoded."""
    clip = take.clip
    if clip.plan.mode == "synced":
        index = np.array([clip.index_of(number) for number in take.numbers], np.int64)
        return TakeProfiles(index=index, value=np.zeros((len(index), clip.height_px)))
    frames = read_frames(clip, take.numbers, ahead=thread_count(), threads=thread_count(), kept=take.kept, keep=True)
    watched = watch(frames, total=len(take.numbers), what="finding the flashes")
    index, value, doubt = collect_with_doubt(watched)
    return TakeProfiles(index=index, value=value, doubt=doubt)


def timing_of_profiles(take: Take, profiles: TakeProfiles, *, first_light: str | None = None) -> Timing:
    """Return when every flash fired. Raises PsvideoError where no strobe is found, or one along the columns only."""
    try:
        timing = timing_from_rows(
            take.plan,
            profiles.index,
            profiles.value,
            clip=take.clip.name,
            first_light=first_light,
            dropped=tuple(DroppedFrames(after=after, count=count) for after, count in take.clip.dropped),
            numbers=take.numbers,
            doubt=profiles.doubt,
        )
    except NoStrobeError:
        if take.clip.is_movie and take.clip.dropped and _found_without_gaps(take, profiles):
            raise _stamps_are_false(take) from None
        refuse_sideways(take)
        raise
    if another_camera(take.plan, timing):
        refuse_sideways(take)
    return timing


def _found_without_gaps(take: Take, profiles: TakeProfiles) -> bool:
    """Return whether the strobe is found as if no frame had been left out, and none is missing then."""
    index = np.arange(len(profiles.index), dtype=np.int64)
    with suppress(NoStrobeError):
        found = timing_from_rows(take.plan, index, profiles.value, clip=take.clip.name, doubt=profiles.doubt)
        return not found.dropped_frames
    return False


def _stamps_are_false(take: Take) -> NoStrobeError:
    holes = take.clip.dropped
    shown = ", ".join(str(after) for after, _ in holes[:MOST_NAMED]) + (" …" if len(holes) > MOST_NAMED else "")
    missing = counted(sum(count for _, count in holes), "frame")
    return NoStrobeError(
        f"{take.clip.path}: its time stamps leave out {missing} (after number {shown}), and the picture shows that "
        "none is missing there: with frames evenly spaced the strobe is found, with the stamps it is not. So they are "
        "not the camera's. Use the file that the camera wrote, or extract the frames to a folder of numbered files, "
        "which have no stamps (ffmpeg -i FILE -fps_mode passthrough FOLDER/%06d.png), and put the plan beside them."
    )


def find_timing(take: Take, *, first_light: str | None = None, watch: Watch = unwatched) -> Timing:
    """Find when every flash fired, from the picture alone; the take is decoded once.

    Parameters
    ----------
    take
        What ``open_take`` gives.
    first_light
        The light of the clip's first complete flash, for plans without a marker (a dark slot).
    watch
        Is handed the loop over the frames, to show progress.

    Returns
    -------
    Timing
        ``flashes``, each with ``start_s`` and ``duration_s`` on the camera's clock (0 is when row 0 of the first frame
        begins to expose), ``lights`` and whether it is ``complete``; ``row_time_s``, ``clock_offset_ppm``,
        ``phase_error_rows``, ``order`` (how it is known which light is which) and ``notes`` on what to distrust.

    Raises
    ------
    PsvideoError
        Where no strobe is found (NoStrobeError), or the plan has no such light.

    Examples
    --------
    >>> import psvideo as ps
    >>> timing = ps.find_timing(ps.open_take("take3/"))
    >>> timing.order, [dict(flash.lights) for flash in timing.flashes if flash.complete][:2]
    ('marker', [{'left': 1.0}, {'top': 1.0}])
    """
    check_take(take)
    return timing_of_profiles(take, take_profiles(take, watch=watch), first_light=first_light)
