"""One plate per flash of a take, as frames are decoded: ambient light taken off, mosaics made colour.

A clip of any length streams through in constant memory. Plates wait for the dark slot after them, where these come
often; else what shows ambient light is read first.
"""

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import chain, islice, pairwise

from psvideo.clip import Clip, Take, demosaic, holds_plain_codes, read_frames
from psvideo.compute.progress import Watch, unwatched
from psvideo.compute.threads import thread_count
from psvideo.model.choices import SplitMethod
from psvideo.model.timing import Timing, places_in_time, timed_camera
from psvideo.plates import hudon2015
from psvideo.plates.ambient.ambient_followed import update
from psvideo.plates.ambient.ambient_off import subtract, with_darks_ahead
from psvideo.plates.ambient.ambient_regression import Separated
from psvideo.plates.ambient.ambient_shown import (
    AHEAD,
    ambient_shown,
    at_true_places,
    dark_plates,
    evenly_exposed,
    ripple_of,
)
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of, shown_level
from psvideo.plates.part import Part
from psvideo.plates.sequence import AMBIENT
from psvideo.plates.split import Plate, split
from psvideo.plates.upright import upright
from psvideo.plates.used_flashes import used_of

MOST_WAITING = 24
"""Plates that may wait for the next dark slot; frames are held for them, and farther ones are read before."""
EARLY_DARKS = 2
"""Dark slots at the clip's start whose few frames are read on their own where that is quick, so that no plate waits
for them: two show whether the ambient light is steady, and where it is none waits later."""


def clip_plates(
    take: Take,
    timing: Timing,
    *,
    method: SplitMethod = "weights",
    part: Part | None = None,
    watch: Watch = unwatched,
    each_window: Callable[[Separated], None] | None = None,
    unseen: bool = False,
) -> Iterator[Plate]:
    """Decode a take once and yield the plate of every flash that it holds, ambient light taken off, demosaiced.

    ``part`` decodes and yields no more than that; how ambient light is taken off depends on the whole take. ``unseen``
    gives flashes between two exposures an empty plate, whose rows others lend.
    """
    clip, camera = take.clip, timed_camera(take.plan, timing)
    places = places_in_time(timing, clip.numbers)
    numbers = take.numbers if part is None else part.numbers
    here = used_of(take, timing, numbers)
    come_often = _dark_slots_come_often(take, timing)
    if not come_often:
        _decode_ahead(take, numbers, watch)
    ahead = 1 if holds_plain_codes(clip) else AHEAD
    in_files = take.plan.mode != "synced"  # of flashes few frames are held at a time, of photographs all
    decoded = read_frames(clip, numbers, ahead=ahead, threads=thread_count(), kept=take.kept, in_files=in_files)
    frames = at_true_places(watch(decoded, total=len(numbers), what="rebuilding flashes"), places)
    single = (
        split(frames, camera, here, unseen=unseen) if method == "weights" else hudon2015.split(frames, camera, here)
    )
    single = map(partial(evenly_exposed, clip=clip), single)
    known = None if part is None else part.ambient
    if come_often:
        known_early = EARLY_DARKS if holds_plain_codes(clip) and part is None else 0
        early = [flash.index for flash in here.flashes if flash.is_dark and flash.complete][:known_early]
        single, later = with_darks_ahead(single, here, beyond=max(early, default=-1))
        darks: Iterator[Plate] = chain(islice(dark_plates(take, timing), len(early)), later)
    else:
        darks = ambient_shown(take, timing, each_window, after=-1 if known is None else known.index)
    ripple = ripple_of(take, timing)
    return map(_colour_of(clip), subtract(single, darks=darks, waits=not come_often, known=known, ripple=ripple))


def first_ambient(take: Take, timing: Timing) -> LightPlate | None:
    """Return what the take's first dark slot shows of the ambient light, None where there is none; decodes its frames.

    A round that comes before any dark slot has no ambient plate of its own.
    """
    dark = next(dark_plates(take, timing), None)
    if dark is None:
        return None
    plate = _colour_of(take.clip)(replace(dark, picture=shown_level(update(None, dark, ripple=timing.mains).level)))
    shown = LightPlate(light=AMBIENT, number=0, time_s=plate.time_s, picture=plate.picture, seen=plate.seen)
    return upright(shown, take.clip.turn)


def _decode_ahead(take: Take, numbers: tuple[int, ...], watch: Watch) -> None:
    """Decode frames into the take's store, unless the fit did, where what shows ambient light is read before."""
    clip, kept = take.clip, take.kept
    if kept is None or take.plan.mode == "synced" or holds_plain_codes(clip):
        return
    missing = [number for number in numbers if number not in kept]
    if missing and not kept.missed:
        frames = read_frames(clip, missing, ahead=thread_count(), threads=thread_count(), kept=kept, keep=True)
        deque(watch(frames, total=len(missing), what="decoding"), maxlen=0)


def _dark_slots_come_often(take: Take, timing: Timing) -> bool:
    """Return whether there are dark slots, and no more than this many flashes between the complete ones that plates can
    wait for the next."""
    dark = [flash.index for flash in used_of(take, timing).flashes if flash.is_dark and flash.complete]
    planned = not all(flash.lit for flash in take.plan.flashes)
    return planned and all(after - before <= MOST_WAITING for before, after in pairwise(dark))


def _colour_of(clip: Clip) -> Callable[[Plate], Plate]:
    """Return what makes colour of a clip's plates: demosaicing where its frames are mosaics, else nothing."""
    if clip.cfa is None:
        return lambda plate: plate
    pattern = clip.cfa
    return lambda plate: replace(plate, picture=mixture_of(demosaic(plate.image, pattern)))
