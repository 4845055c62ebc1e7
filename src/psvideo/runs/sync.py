"""The whole of ``psvideo sync``: a clip in, its timing out, with a picture of how well the flashes were found."""

from pathlib import Path

import numpy as np

from psvideo.clip import Take
from psvideo.compute.progress import Watch, unwatched
from psvideo.errors import UsageError
from psvideo.formats.paths import path_if_given, path_of
from psvideo.formats.rig_folder import rig_of_take
from psvideo.formats.rig_toml import read_rig
from psvideo.formats.screen_pictures import write_png
from psvideo.formats.timing_json import format_timing
from psvideo.formats.whole_files import PICTURE_MARK, check_ending, refuse_existing, write_text
from psvideo.model.timing import Timing, places_in_time
from psvideo.pictures.timing_sheet import timing_picture
from psvideo.plates.naming import named_by_rig
from psvideo.runs.steps.caller import PYTHON, Caller, said_timing, say_of_clip
from psvideo.sync.open_take import open_take
from psvideo.sync.take_timing import TakeProfiles, take_profiles, timing_of_profiles

MARK = "psvideo-timing/"
"""By which a file is known for a timing, which may be replaced."""


def sync(
    clip: Path | str,
    *,
    out: Path | str | None = None,
    plan: Path | str | None = None,
    frames: str | None = None,
    first_light: str | None = None,
    rig: Path | str | None = None,
    picture: Path | str | None = None,
    force: bool = False,
    watch: Watch = unwatched,
    caller: Caller = PYTHON,
) -> Timing:
    """Find phase, clock offset, light order and dropped frames of a strobed clip, from the picture alone.

    - ``clip``: a folder of numbered frames with plan.toml, or a movie file. ``plan`` names the plan where it does not
      lie beside the footage. ``frames``: file numbers to use, such as ``"1-100"`` or ``"1-100x2"``; left out, all.
    - ``first_light`` names the light of the clip's first complete flash, for plans without a marker; ``rig``, where the
      lights are, gives their order where there is no marker.
    - ``out``: a timing.json to write. ``picture``: a PNG to write that shows how well the flashes were found. ``force``
      replaces either where it exists.

    ``watch`` is handed every long loop, and ``caller`` the sentences that come on the way.

    Returns
    -------
    Timing
        When every flash fired, in seconds on the camera's clock; see ``find_timing``.

    Raises
    ------
    UsageError
        Where an output exists or is no PNG, or there is nothing to draw.
    PsvideoError
        Where no strobe is found (NoStrobeError), or files cannot be used.

    Examples
    --------
    >>> import psvideo as ps
    >>> timing = ps.sync("take3/", out="found.json")
    >>> timing.phase_error_rows < 0.05
    True
    """
    timing_path, picture_path = path_if_given("out", out), path_if_given("picture", picture)
    if timing_path is not None:
        refuse_existing(timing_path, force=force, mark=MARK)
        check_ending(timing_path, ".json", "", name="out")
    if picture_path is not None:
        check_ending(picture_path, ".png", name="picture")
        refuse_existing(picture_path, force=force, mark=PICTURE_MARK)
    take = open_take(path_of("clip", clip), plan=path_if_given("plan", plan), frames=frames)
    if picture_path is not None and take.plan.mode == "synced":
        raise UsageError(
            f"`picture`: there is nothing to draw of {take.clip.name}: by its plan every frame holds one whole flash "
            '(mode = "synced"), and no times are searched in the picture. Leave the option out.'
        )
    say_of_clip(take.clip, caller)
    known = None if rig is None else read_rig(rig_of_take(rig, take.clip.path), plan_lights=take.plan.lights)
    profiles = take_profiles(take, watch=watch)
    timing = timing_of_profiles(take, profiles, first_light=first_light)
    if picture_path is not None:
        _draw(picture_path, take, timing, profiles)
    timing = said_timing(timing if known is None else named_by_rig(take, timing, known), caller)
    if timing_path is not None:
        write_text(timing_path, format_timing(timing))
    return timing


def _draw(picture: Path, take: Take, timing: Timing, profiles: TakeProfiles) -> None:
    places = places_in_time(timing, take.clip.numbers)
    shown = [n for n, number in enumerate(take.numbers) if number in places]
    index = np.array([places[take.numbers[n]] for n in shown], np.int64)
    write_png(picture, timing_picture(take.plan, timing, index, profiles.value[shown]))
