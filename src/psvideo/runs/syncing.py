"""A whole sync: a take in, its timing out, with a picture of how well the flashes were found."""

from pathlib import Path

import numpy as np

from psvideo.clip import Take
from psvideo.compute.progress import Watch, unwatched
from psvideo.model.rig import Rig
from psvideo.model.timing import Timing, places_in_time
from psvideo.pictures.timing import timing_picture, write_sheet
from psvideo.plates.naming import named_by_rig
from psvideo.sync.of_take import TakeProfiles, take_profiles, timing_of_profiles


def sync_take(
    take: Take,
    *,
    first_light: str | None = None,
    rig: Rig | None = None,
    picture: Path | None = None,
    watch: Watch = unwatched,
) -> Timing:
    """Return when every flash of a take fired, named by first light or rig where the plan has no marker.

    ``picture`` is a PNG file to write that shows how well the flashes were found. Raises PsvideoError where no strobe
    is found.
    """
    profiles = take_profiles(take, watch=watch)
    timing = timing_of_profiles(take, profiles, first_light=first_light)
    if picture is not None and take.plan.mode != "synced":
        _draw(picture, take, timing, profiles)
    return timing if rig is None else named_by_rig(take, timing, rig)


def _draw(picture: Path, take: Take, timing: Timing, profiles: TakeProfiles) -> None:
    places = places_in_time(timing, take.clip.numbers)
    shown = [n for n, number in enumerate(take.numbers) if number in places]
    index = np.array([places[take.numbers[n]] for n in shown], np.int64)
    write_sheet(picture, timing_picture(take.plan, timing, index, profiles.value[shown]))
