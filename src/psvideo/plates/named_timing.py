"""A take's timing: given or found, and named by first light or rig."""

from pathlib import Path

from psvideo.clip import Take
from psvideo.compute.progress import Watch, unwatched
from psvideo.errors import PsvideoError
from psvideo.formats.timing_json import read_timing
from psvideo.model.rig import Rig
from psvideo.model.timing import Timing
from psvideo.plates.naming import named_by_rig, named_first
from psvideo.sync.take_timing import find_timing


def read_or_find_timing(
    take: Take, given: Path | None, *, first_light: str | None, rig: Rig | None = None, watch: Watch = unwatched
) -> Timing:
    """Return a take's timing: the file that is given, else found from the picture.

    ``first_light`` names the light of the first complete flash. Left out, and with no marker in the plan, the lights'
    order comes from the ``rig`` where it can. Raises PsvideoError where the file belongs to another clip.
    """
    if given is None:
        timing = find_timing(take, first_light=first_light, watch=watch)
    else:
        timing = read_timing(given)
        wrong = _misfit(timing, take)
        if wrong:
            raise PsvideoError(f"{given}: {wrong}. Leave `timing` out, or make it again with psvideo sync.")
        if first_light is not None:
            timing = named_first(take, timing, first_light)
    return timing if rig is None else named_by_rig(take, timing, rig)


def _misfit(timing: Timing, take: Take) -> str | None:
    """Return why a timing cannot be this clip's, None where it can."""
    plan = take.plan
    if timing.clip != take.clip.name:
        return f"is the timing of the clip {timing.clip!r}, and this clip is {take.clip.name!r}"
    if abs(timing.frame_period_s / plan.camera.frame_period_s - 1) > 1e-6:
        return f"has frames of {timing.frame_period_s:.6g} s, and the plan {plan.camera.frame_period_s:.6g} s"
    if [flash.index for flash in timing.flashes] != list(range(len(timing.flashes))):
        return "its flashes are not numbered 0, 1, 2 and so on without a hole"
    for flash in timing.flashes:
        if flash.slot >= len(plan.flashes) or dict(flash.lights) != dict(plan.flashes[flash.slot].lights):
            return f"its flash {flash.index} (slot {flash.slot}, {dict(flash.lights)}) is not in the plan's list"
    return None
