"""Pictures of a scene, one per light and round, from a synced or strobed clip, whose flashes are found first."""

from collections.abc import Iterator
from functools import partial
from itertools import islice

from psvideo.calibrate.light_pictures import LightPictures, pictures_of_round
from psvideo.clip import Take
from psvideo.clip.transfer import find_curve
from psvideo.compute.progress import Watch
from psvideo.errors import PsvideoError, UsageError
from psvideo.model.marker import why_guessed
from psvideo.model.plan import Plan, reference_duration_s
from psvideo.model.timing import Timing
from psvideo.plates.align.rounds import UNMOVED
from psvideo.plates.gather import gather
from psvideo.runs.photographs.opened_sets import LightSets, Reading
from psvideo.sync.take_timing import find_timing


def sets_of_clip(take: Take, reading: Reading, watch: Watch) -> LightSets:
    """Return the whole rounds of a clip as sets. Raises PsvideoError where no strobe is found in it."""
    timing = find_timing(take, first_light=reading.first_light, watch=watch)
    plan = take.plan
    whole = gather(take, timing, aligning=UNMOVED, watch=watch)
    shown = partial(pictures_of_round, flashes_s=_flashes_s(plan))
    sets = map(shown, islice(whole, None if reading.frames else reading.most))
    guessed = (_guess(take, timing),) if timing.order == "guess" else ()
    return LightSets(
        name=take.clip.name,
        names=plan.lights,
        sets=_at_least_one(sets, take),
        warnings=(*take.clip.warnings, *guessed),
        notes=(*take.clip.notes, *timing.notes),
    )


def refuse_other_curve(take: Take, transfer: str | None) -> None:
    """Raise UsageError where a clip's frames are to be read by another curve than they will be solved by."""
    planned = take.clip.encoding.transfer
    if transfer is not None and find_curve(transfer) is not find_curve(planned):
        raise UsageError(
            f"{take.clip.path}: is a clip, and its frames are read as {planned!r} as {take.clip.plan_path} says, not "
            f"as `transfer` {transfer!r}. Leave it out, or put the plan's [camera] transfer right: what is measured "
            "and what is solved must be read alike."
        )


def _flashes_s(plan: Plan) -> tuple[float, ...] | None:
    """Return the full flashes that plates show; of a synced plan only the exposure counts."""
    return None if plan.mode == "synced" else tuple(reference_duration_s(plan, light) for light in plan.lights)


def _guess(take: Take, timing: Timing) -> str:
    why = timing.order_note or why_guessed(timing.flashes)
    return (
        f"{take.clip.path}: which light is which is a guess. {why} Where you know the light of the first complete "
        "flash, name it with `first_light`."
    )


def _at_least_one(sets: Iterator[LightPictures], take: Take) -> Iterator[LightPictures]:
    count = 0
    for one in sets:
        count += 1
        yield one
    if not count:
        raise PsvideoError(
            f"{take.clip.path}: holds no round in which every light is complete, so there is nothing to calibrate "
            f"from. Use more frames: {len(take.numbers)} were read."
        )
