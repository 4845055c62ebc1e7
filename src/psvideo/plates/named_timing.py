"""A take's timing: given or found, and named by first light or rig."""

from pathlib import Path

from psvideo.clip import Take
from psvideo.compute.progress import Watch, unwatched
from psvideo.errors import PsvideoError
from psvideo.formats.timing_json import read_timing
from psvideo.model.rig import Rig
from psvideo.model.timing import Timing
from psvideo.plates.naming import named_by_rig, named_first
from psvideo.plates.timing_misfit import misfit
from psvideo.sync.take_timing import find_timing


def read_or_find_timing(
    take: Take, given: Path | None, *, first_light: str | None, rig: Rig | None = None, watch: Watch = unwatched
) -> Timing:
    """Return a take's timing: the file that is given, else found from the picture.

    ``first_light`` names the light of the first complete flash. Left out, and with no marker in the plan, the lights'
    order comes from the ``rig`` where it can. Raises PsvideoError where the file cannot be this clip's.
    """
    if given is None:
        timing = find_timing(take, first_light=first_light, watch=watch)
    else:
        timing = read_timing(given)
        wrong = misfit(timing, take)
        if wrong:
            raise PsvideoError(f"{given}: {wrong}. Leave `timing` out, or make it again with psvideo sync.")
        if first_light is not None:
            timing = named_first(take, timing, first_light)
    return timing if rig is None else named_by_rig(take, timing, rig)
