"""From a take and its timing to plates: decode once, rebuild every flash, take ambient light off, gather into rounds.

A clip of any length streams through in constant memory.
"""

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from itertools import chain, islice, pairwise
from typing import TypeVar

import numpy as np

from psvideo.clip import Clip, Frame, Take, check_take, demosaic, holds_plain_codes, read_frames
from psvideo.compute.progress import Watch, unwatched
from psvideo.compute.threads import thread_count
from psvideo.errors import check_kind
from psvideo.model.camera import Camera
from psvideo.model.choices import SplitMethod
from psvideo.model.recipe import frames_of
from psvideo.model.shutter import frames_touched
from psvideo.model.timing import Flash, Timing, places_in_time, timed_camera
from psvideo.plates import hudon2015
from psvideo.plates.align.comb import Comb, Schedule, schedule_of
from psvideo.plates.align.opened import opened
from psvideo.plates.align.rounds import Aligning, aligned
from psvideo.plates.ambient import update
from psvideo.plates.ambient_off import subtract, with_darks_ahead
from psvideo.plates.ambient_regression import Design, Separated, design_of, separated, windows_of
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixture import made
from psvideo.plates.nearest_rows import has_blind_time, with_nearest_rows
from psvideo.plates.sequence import AMBIENT, FIRST_NUMBER, Round, check_separable, coming, gathered, light_plates
from psvideo.plates.split import Plate, plate_of, split
from psvideo.plates.unmixed import slot_names, slot_plates, unmixed
from psvideo.plates.upright import upright

AnyPlate = TypeVar("AnyPlate", Plate, LightPlate)

MOST_WAITING = 24
"""Plates that may wait for the next dark slot; frames are held for them, and farther ones are read before."""
EARLY_DARKS = 2
"""Dark slots at the clip's start whose few frames are read on their own where that is quick, so that no plate waits
for them: two show whether the ambient light is steady, and where it is none waits later."""
AHEAD = 2
"""Frames that are decoded in advance while plates are rebuilt; each costs memory. Files that hold plain codes are read
so quickly that one is enough."""


def gather(
    take: Take,
    timing: Timing,
    *,
    aligning: Aligning | None = None,
    with_ambient: bool = True,
    method: SplitMethod = "weights",
    start_number: int = FIRST_NUMBER,
    watch: Watch = unwatched,
    each_flash: Callable[[Plate], None] | None = None,
    each_plate: Callable[[LightPlate], None] | None = None,
    each_window: Callable[[Separated], None] | None = None,
) -> Iterator[Round]:
    """Yield a take's rounds: one plate per light at its full flash, ambient light taken off. The take is decoded once.

    Parameters
    ----------
    take, timing
        What ``open_take`` and ``find_timing`` give.
    aligning
        How plates are brought to one instant; then only complete rounds come. Left out, all rounds in which any light
        is complete come as they are.
    with_ambient
        Whether rounds wait for their dark slots, and hold them.
    method
        "weights", or "hudon2015": Algorithm 1 of that paper, to compare with.
    start_number
        The number of the first round.
    watch
        Is handed the loop over the frames, to show progress.
    each_flash
        Is shown every single plate on its way, demosaiced.
    each_plate
        Is shown every light's plate, and every dark slot's, before any is moved.
    each_window
        Is shown what every window of frames gives of ambient light, where the plan has no dark slot.

    Yields
    ------
    Round
        ``number``; ``time_s``, its instant on the camera's clock; ``lights``, fewer than the plan's at the clip's ends;
        ``plates``, each with ``light``, ``time_s`` and ``image`` (row, col[, 3]), float32, linear light, 1.0 = sensor
        saturation; ``ambient``, such a plate where the plan has dark slots, else None.

    Raises
    ------
    PsvideoError
        Where the plan's patterns of lights cannot be separated, or a frame cannot be read.

    Examples
    --------
    >>> import psvideo as ps
    >>> take = ps.open_take("take3/")
    >>> for one in ps.gather(take, ps.find_timing(take)):
    ...     print(one.number, one.lights, one.plates[0].image.shape)
    1001 ('left', 'top') (120, 160, 3)
    1002 ('key', 'left', 'top') (120, 160, 3)
    1003 ('key', 'left', 'top') (120, 160, 3)
    """
    check_take(take)
    check_kind("timing", timing, Timing, "a Timing: ps.find_timing(take) or ps.read_timing(path) gives one")
    plan, flashes = take.plan, timing.flashes
    if take.unmixing is None:
        check_separable(plan)
    made = clip_plates(take, timing, method=method, watch=watch, each_window=each_window)
    single, turn = _shown(made, each_flash), take.clip.turn
    names, plates = plan.lights, light_plates(single, plan, flashes, start=start_number)
    if take.unmixing is not None:
        names, plates = slot_names(plan), slot_plates(single, flashes, start=start_number)
    borrows = aligning is not None and plan.mode != "synced" and has_blind_time(timed_camera(plan, timing))
    if borrows and turn.transposed:  # rows are borrowed while they are rows
        plates, borrows = with_nearest_rows(plates), False
    plates = _shown(map(partial(upright, turn=turn), plates), each_plate)
    if not with_ambient:
        plates = filter(lambda plate: plate.light != AMBIENT, plates)
    if aligning is not None:
        plates = with_nearest_rows(plates) if borrows else plates
        due = scheduled(take, timing, aligning, start_number=start_number)
        rounds = aligned(plates, names, aligning, first=start_number, with_ambient=with_ambient, schedule=due)
        rounds = _apart(rounds, take)
        return opened(rounds) if isinstance(aligning.rate, Comb) and aligning.rate.open_s else rounds
    if take.unmixing is not None:
        return _apart(gathered(plates, names, expected=lambda _: {*names, AMBIENT}, whole=True), take)
    expected = coming(plan, flashes, start=start_number)
    return gathered(plates, names, expected=expected.__getitem__)


def _apart(rounds: Iterator[Round], take: Take) -> Iterator[Round]:
    return rounds if take.unmixing is None else map(partial(unmixed, how=take.unmixing), rounds)


def scheduled(take: Take, timing: Timing, aligning: Aligning, *, start_number: int) -> Schedule | None:
    """Return which instants ``gather`` will show, where they come at a steady rate; None where rounds decide."""
    if not isinstance(aligning.rate, Comb):
        return None
    camera, places = timed_camera(take.plan, timing), places_in_time(timing, take.clip.numbers)
    used = _within(timing, camera, take, places)
    end_s = (max(places.values()) + 0.5) * camera.frame_period_s
    return schedule_of(take.plan, used.flashes, aligning.rate, start=start_number, end_s=end_s)


def clip_plates(
    take: Take,
    timing: Timing,
    *,
    method: SplitMethod = "weights",
    watch: Watch = unwatched,
    each_window: Callable[[Separated], None] | None = None,
) -> Iterator[Plate]:
    """Decode a take once and yield the plate of every flash that it holds, ambient light taken off, demosaiced."""
    clip, camera = take.clip, timed_camera(take.plan, timing)
    places = places_in_time(timing, clip.numbers)
    used = _within(timing, camera, take, places)
    has_dark = not all(flash.lit for flash in take.plan.flashes)
    come_often = has_dark and _come_often(used)
    if not come_often:
        _decode_ahead(take, watch)
    ahead = 1 if holds_plain_codes(clip) else AHEAD
    decoded = read_frames(clip, take.numbers, ahead=ahead, threads=thread_count(), kept=take.kept)
    frames = _placed(watch(decoded, total=len(take.numbers), what="rebuilding flashes"), places)
    single = (split if method == "weights" else hudon2015.split)(frames, camera, used)
    if come_often:
        known_early = EARLY_DARKS if holds_plain_codes(clip) else 0
        early = [flash.index for flash in used.flashes if flash.is_dark and flash.complete][:known_early]
        single, later = with_darks_ahead(single, used, beyond=max(early, default=-1))
        darks: Iterator[Plate] = chain(islice(_dark_plates(take, camera, used, places), len(early)), later)
    elif has_dark:
        darks = _dark_plates(take, camera, used, places)
    else:
        darks = _separated_plates(take, camera, used, places, each_window)
    return map(_colour_of(clip), subtract(single, darks=darks, waits=not come_often))


def first_ambient(take: Take, timing: Timing) -> LightPlate | None:
    """Return what the take's first dark slot shows of the ambient light, None where there is none; decodes its frames.

    A round that comes before any dark slot has no ambient plate of its own.
    """
    camera, places = timed_camera(take.plan, timing), places_in_time(timing, take.clip.numbers)
    dark = next(_dark_plates(take, camera, _within(timing, camera, take, places), places), None)
    if dark is None:
        return None
    plate = _colour_of(take.clip)(replace(dark, picture=made(update(None, dark).image)))
    shown = LightPlate(light=AMBIENT, number=0, time_s=plate.time_s, picture=plate.picture, seen=plate.seen)
    return upright(shown, take.clip.turn)


def _decode_ahead(take: Take, watch: Watch) -> None:
    """Decode all frames into the take's store, unless the fit did, where what shows ambient light is read before."""
    clip, kept = take.clip, take.kept
    if kept is None or take.plan.mode == "synced" or holds_plain_codes(clip):
        return
    if not (len(kept) or kept.missed):
        frames = read_frames(clip, take.numbers, ahead=thread_count(), threads=thread_count(), kept=kept, keep=True)
        deque(watch(frames, total=len(take.numbers), what="decoding"), maxlen=0)


def _placed(frames: Iterable[Frame], places: Mapping[int, int]) -> Iterator[Frame]:
    """Put frames where they truly are in time; repeated ones, which are nowhere, are left out."""
    for frame in frames:
        if frame.number in places:
            yield frame if frame.index == places[frame.number] else replace(frame, index=places[frame.number])


def _within(timing: Timing, camera: Camera, take: Take, places: Mapping[int, int]) -> Timing:
    """Take as complete only the flashes whose frames all lie between the take's first frame and its last."""
    first, last = frames_touched(camera, timing.start_s, timing.duration_s)
    used = [places[number] for number in take.numbers if number in places]
    begin, end = used[0], used[-1]
    flashes = tuple(
        replace(flash, complete=flash.complete and bool(first[n] >= begin and last[n] <= end))
        for n, flash in enumerate(timing.flashes)
    )
    return replace(timing, flashes=flashes)


def _come_often(timing: Timing) -> bool:
    """Tell whether no more than so many flashes lie between complete dark slots that plates can wait for the next."""
    dark = [flash.index for flash in timing.flashes if flash.is_dark and flash.complete]
    return all(after - before <= MOST_WAITING for before, after in pairwise(dark))


def _dark_plates(take: Take, camera: Camera, timing: Timing, places: Mapping[int, int]) -> Iterator[Plate]:
    """Read ahead, from the few frames that they touch, the dark slots, between which ambient light is interpolated."""
    number_at = {places[number]: number for number in take.numbers if number in places}
    for dark in timing.flashes:
        if dark.complete and dark.is_dark:
            near = tuple(number_at[place] for place in frames_of(camera, timing, dark) if place in number_at)
            frames = _placed(read_frames(take.clip, near, kept=take.kept), places)
            plate = plate_of(dark, frames, camera, timing) if near else None
            if plate is not None:
                yield plate
            del plate


def _separated_plates(
    take: Take,
    camera: Camera,
    timing: Timing,
    places: Mapping[int, int],
    show: Callable[[Separated], None] | None,
) -> Iterator[Plate]:
    """Read windows of frames ahead, and give the ambient light of each as if a dark slot in its middle had shown it.

    A triggered clip has no rows that saw a part of a flash, and nothing is told.
    """
    if take.plan.mode == "synced":
        return
    numbers = [number for number in take.numbers if number in places]
    before: Separated | None = None
    for window in windows_of(numbers):
        design = design_of(take.plan, camera, timing, [places[number] for number in window])
        if not design.known.any():
            continue
        frames = _placed(read_frames(take.clip, window, ahead=AHEAD, threads=thread_count(), kept=take.kept), places)
        images = (frame.image for frame in frames)
        before = separated(design, images, before=before, mosaic=take.clip.cfa is not None)
        if show is not None:
            show(before)
        yield _as_dark_slot(before, design, camera, timing)


def _as_dark_slot(found: Separated, design: Design, camera: Camera, timing: Timing) -> Plate:
    begin_s, end_s = (index * camera.frame_period_s for index in (design.frames[0], design.frames[-1] + 1))
    middle_s = (begin_s + end_s) / 2
    last = max((flash.index for flash in timing.flashes if flash.start_s < end_s), default=0)
    return Plate(
        flash=Flash(index=last, slot=0, lights={}, start_s=middle_s, duration_s=0.0, complete=True),
        picture=made(found.image),
        shares=np.ones((1, camera.height_px)),
        middles_s=np.full((1, camera.height_px), middle_s),
        seen=found.known,
    )


def _colour_of(clip: Clip) -> Callable[[Plate], Plate]:
    """Return what makes colour of a clip's plates: demosaicing where its frames are mosaics, else nothing."""
    if clip.cfa is None:
        return lambda plate: plate
    pattern = clip.cfa
    return lambda plate: replace(plate, picture=made(demosaic(plate.image, pattern)))


def _shown(plates: Iterable[AnyPlate], show: Callable[[AnyPlate], None] | None) -> Iterator[AnyPlate]:
    for plate in plates:
        if show is not None:
            show(plate)
        yield plate
        del plate  # nothing holds it while the next one is made
