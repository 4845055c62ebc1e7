"""A take's ambient light, read ahead of its plates: from dark slots or, without any, from windows of frames."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from psvideo.clip import Clip, Frame, Take, holds_plain_codes, read_frames
from psvideo.compute.threads import thread_count
from psvideo.model.camera import Camera
from psvideo.model.rows.recipe import frames_of
from psvideo.model.rows.ripple import Ripple
from psvideo.model.timing import Flash, Timing, places_in_time, timed_camera
from psvideo.plates.ambient.ambient_followed import Ambient, update
from psvideo.plates.ambient.ambient_regression import Design, Separated, design_of, separated, windows_of
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.split import Plate, plate_of
from psvideo.plates.used_flashes import used_of

AHEAD = 2
"""Frames that are decoded in advance while plates are rebuilt; each costs memory. Files that hold plain codes are read
so quickly that one is enough."""


def ambient_shown(
    take: Take, timing: Timing, show: Callable[[Separated], None] | None, *, after: int = -1
) -> Iterator[Plate]:
    """Read ahead what shows a take's ambient light after the flash with the index ``after``."""
    if all(flash.lit for flash in take.plan.flashes):
        return _separated_plates(take, timing, show, after)
    return dark_plates(take, timing, after)


def dark_plates(take: Take, timing: Timing, after: int = -1) -> Iterator[Plate]:
    """Read ahead, from the few frames that they touch, the dark slots, between which ambient light is interpolated."""
    camera, places = timed_camera(take.plan, timing), places_in_time(timing, take.clip.numbers)
    timing, in_files = used_of(take, timing), holds_plain_codes(take.clip)  # a slot's frames wait for the next slot
    number_at = {places[number]: number for number in take.numbers if number in places}
    for dark in timing.flashes[after + 1 :]:
        if dark.complete and dark.is_dark:
            near = tuple(number_at[place] for place in frames_of(camera, timing, dark) if place in number_at)
            frames = at_true_places(read_frames(take.clip, near, kept=take.kept, in_files=in_files), places)
            plate = plate_of(dark, frames, camera, timing) if near else None
            if plate is not None:
                yield evenly_exposed(plate, take.clip)
            del plate


def has_one_dark_slot(take: Take, timing: Timing) -> bool:
    """Return whether a single dark slot shows a take's ambient light: rounds that are judged by it wait for it."""
    return sum(flash.complete and flash.is_dark for flash in used_of(take, timing).flashes) == 1


def evenly_exposed(plate: Plate, clip: Clip) -> Plate:
    """Return a plate that counts ambient light in usual exposures, also where each of a clip's photographs was exposed
    in its own way: a dark one is brought to the usual exposure, and of a lit one its share is."""
    if not clip.exposures:
        return plate
    times = clip.exposures[plate.flash.index]
    if not plate.flash.is_dark:
        return replace(plate, shares=plate.shares * times)
    return replace(plate, picture=replace(plate.picture, coefficients=plate.picture.coefficients / times))


def _separated_plates(
    take: Take, timing: Timing, show: Callable[[Separated], None] | None, after: int
) -> Iterator[Plate]:
    """Read windows of frames ahead, and give the ambient light of each as if a dark slot in its middle had shown it.

    A triggered clip has no rows that saw a part of a flash, and shows no ambient light.
    """
    if take.plan.mode == "synced":
        return
    camera, places = timed_camera(take.plan, timing), places_in_time(timing, take.clip.numbers)
    timing = used_of(take, timing)
    windows = windows_of([number for number in take.numbers if number in places])
    before: Separated | None = None
    for window in windows[_begin(windows, camera, timing, places, after) :]:
        design = design_of(take.plan, camera, timing, [places[number] for number in window])
        if not design.known.any():
            continue
        frames = at_true_places(
            read_frames(take.clip, window, ahead=AHEAD, threads=thread_count(), kept=take.kept), places
        )
        images = (frame.image for frame in frames)
        before = separated(design, images, before=before, mosaic=take.clip.cfa is not None)
        last = _last_flash(places[window[-1]], camera, timing)
        if last <= after:
            continue
        if show is not None:
            show(before)
        yield _as_dark_slot(before, design, camera, last)


def _begin(
    windows: Sequence[Sequence[int]], camera: Camera, timing: Timing, places: Mapping[int, int], after: int
) -> int:
    """Return with which window to begin for those after a flash: the one before the first of them, for a window takes
    from the one before it what itself does not show, and from no other."""
    later = (n for n, window in enumerate(windows) if _last_flash(places[window[-1]], camera, timing) > after)
    return max(next(later, len(windows)) - 1, 0)


def _last_flash(frame: int, camera: Camera, timing: Timing) -> int:
    """Return the index of the last flash that begins before a frame ends."""
    end_s = (frame + 1) * camera.frame_period_s
    return max((flash.index for flash in timing.flashes if flash.start_s < end_s), default=0)


def _as_dark_slot(found: Separated, design: Design, camera: Camera, last: int) -> Plate:
    begin_s, end_s = (index * camera.frame_period_s for index in (design.frames[0], design.frames[-1] + 1))
    middle_s = (begin_s + end_s) / 2
    return Plate(
        flash=Flash(index=last, slot=0, lights={}, start_s=middle_s, duration_s=0.0, complete=True),
        picture=mixture_of(found.image),
        shares=np.ones((1, camera.height_px)),
        middles_s=np.full((1, camera.height_px), middle_s),
        seen=found.known,
    )


def ambient_before(take: Take, timing: Timing, index: int) -> Ambient | None:
    """Return what the dark slots before a flash show of the ambient light, None where there is none; decodes them."""
    ambient: Ambient | None = None
    for dark in ambient_shown(take, timing, None):
        if dark.flash.index >= index:
            break
        ambient = update(ambient, dark, ripple=ripple_of(take, timing))
    return ambient


def ambient_near(take: Take, timing: Timing, index: int) -> Ambient | None:
    """Return what the last dark slot before a flash shows by itself, None where there is none; without dark slots what
    the window of frames around it shows."""
    dark = [flash.index for flash in used_of(take, timing).flashes if flash.complete and flash.is_dark]
    slots = not all(flash.lit for flash in take.plan.flashes)
    if slots and not (before := [one for one in dark if one < index]):
        return None
    plate = next(ambient_shown(take, timing, None, after=(before[-1] if slots else index) - 1), None)
    return None if plate is None else update(None, plate, ripple=ripple_of(take, timing))


def ripple_of(take: Take, timing: Timing) -> Ripple | None:
    """Return the ripple that dark slots hold; what windows of frames show in their place is a mean over it."""
    return None if all(flash.lit for flash in take.plan.flashes) else timing.mains


def at_true_places(frames: Iterable[Frame], places: Mapping[int, int]) -> Iterator[Frame]:
    """Put frames where they truly are in time; repeated ones, which are nowhere, are left out."""
    for frame in frames:
        if frame.number in places:
            yield frame if frame.index == places[frame.number] else replace(frame, index=places[frame.number])
