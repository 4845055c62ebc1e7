"""The steps composed over a clip: decode, time, rebuild, take ambient off, gather into rounds, solve.

Every step is a function or a generator; nothing here holds state, and a clip of any length streams through in
constant memory.
"""

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Literal, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from psvideo import hudon2015
from psvideo.align.denoise import Average, averaged
from psvideo.ambient import subtract, update
from psvideo.calibrate.strobed_readout import StrobedReadout, readout_of
from psvideo.camera import Camera
from psvideo.clip import (
    ALL_CORES,
    Clip,
    Frame,
    Kept,
    demosaic,
    holes,
    keeping_near,
    open_clip,
    parse_range,
    read_frames,
)
from psvideo.falloff import Falloff
from psvideo.near_surface import NearSurface, solve_near
from psvideo.normals.illumination import Illumination, illumination
from psvideo.normals.solving import Solving
from psvideo.plan import Plan
from psvideo.profiles import collect_with_doubt
from psvideo.rig import Light, Rig
from psvideo.sequence import (
    FIRST_NUMBER,
    LightPlate,
    Round,
    check_separable,
    light_plates,
    reference_duration_s,
    rounds,
)
from psvideo.shutter import frames_touched
from psvideo.split import Image, Plate, plate_of, split
from psvideo.strobe.runlog import as_played
from psvideo.surface import Surface
from psvideo.sync import find_timing
from psvideo.timing import DroppedFrames, Timing, places_in_time
from psvideo.view.timing_picture import timing_picture, write_sheet

Method = Literal["weights", "hudon2015"]
Item = TypeVar("Item")
AHEAD = 2
"""Frames that are decoded in advance while plates are rebuilt; each costs memory."""


class Watch(Protocol):
    """Passes items through and shows progress on the way."""

    def __call__(self, items: Iterable[Item], *, total: int, what: str, unit: str = "frames") -> Iterator[Item]:
        """Return the items as they come; ``what`` names the step."""


def unwatched(items: Iterable[Item], *, total: int, what: str, unit: str = "frames") -> Iterator[Item]:
    """Pass items through and show nothing."""
    return iter(items)


@dataclass(frozen=True, kw_only=True)
class Take:
    """A clip that is open, and the numbers of its frames that are to be used.

    ``kept`` holds pictures that are decoded already, and takes those that will be looked at again.
    """

    clip: Clip
    numbers: tuple[int, ...]
    kept: Kept | None = None

    @property
    def plan(self) -> Plan:
        """The plan that the strobe played."""
        return self.clip.plan


def open_take(path: Path, *, plan: Path | None = None, frames: str | None = None) -> Take:
    """Open a clip; ``frames`` is a range of file numbers such as ``1-100``.

    Where the strobe's log (strobe.json) lies beside the plan, the plan takes the times and powers that were played.
    """
    clip = _as_played(open_clip(path, plan=plan))
    numbers = clip.numbers if frames is None else parse_range(frames, clip.numbers)
    return Take(clip=clip, numbers=numbers)


def _as_played(clip: Clip) -> Clip:
    played = as_played(clip.plan, clip.plan_path)
    warnings = clip.warnings if played.warning is None else (*clip.warnings, played.warning)
    notes = clip.notes if played.note is None else (*clip.notes, played.note)
    return replace(clip, plan=played.plan, warnings=warnings, notes=notes)


@contextmanager
def decoded_once(take: Take, *, output: Path) -> Iterator[Take]:
    """Give the take with a store for its decoded frames, on the disk of ``output``; at the end the store is gone."""
    with keeping_near(output) as kept:
        yield replace(take, kept=kept)


def find_clip_timing(
    take: Take, *, first_light: str | None = None, watch: Watch = unwatched, picture: Path | None = None
) -> Timing:
    """Decode a take once and return when every flash fired. Raises PsvideoError where no strobe is found.

    ``picture`` is a PNG file to write that shows how well the flashes were found.
    """
    clip = take.clip
    dropped = tuple(DroppedFrames(after=after, count=count) for after, count in holes(clip.numbers))
    if clip.plan.mode == "synced":
        indices = np.array([clip.index_of(number) for number in take.numbers], np.int64)
        profiles, doubt = np.zeros((len(indices), clip.height_px)), None
    else:
        frames = read_frames(clip, take.numbers, ahead=ALL_CORES, threads=ALL_CORES, kept=take.kept, keep=True)
        watched = watch(frames, total=len(take.numbers), what="finding the flashes")
        indices, profiles, doubt = collect_with_doubt(watched)
    timing = find_timing(
        clip.plan,
        indices,
        profiles,
        clip=clip.name,
        first_light=first_light,
        dropped=dropped,
        numbers=take.numbers,
        doubt=doubt,
    )
    if picture is not None and clip.plan.mode != "synced":
        places = places_in_time(timing, clip.numbers)
        shown = [n for n, number in enumerate(take.numbers) if number in places]
        index = np.array([places[take.numbers[n]] for n in shown], np.int64)
        write_sheet(picture, timing_picture(clip.plan, timing, index, profiles[shown]))
    return timing


def measure_take_readout(take: Take, *, tolerance_ppm: float | None = None, watch: Watch = unwatched) -> StrobedReadout:
    """Measure a camera's readout time from a strobed take, whatever its plan says of it.

    ``tolerance_ppm`` is how far the strobe's clock may be from true seconds (left out: what the plan says of it).
    Raises PsvideoError where no strobe is found.
    """
    unknown = replace(take.plan, camera=replace(take.plan.camera, readout_s=None))
    timing = find_clip_timing(replace(take, clip=replace(take.clip, plan=unknown)), watch=watch)
    return readout_of(unknown, timing, frames=len(take.numbers), tolerance_ppm=tolerance_ppm)


def clip_rounds(
    take: Take,
    timing: Timing,
    *,
    method: Method = "weights",
    start_number: int = FIRST_NUMBER,
    watch: Watch = unwatched,
    each_flash: Callable[[Plate], None] | None = None,
) -> Iterator[Round]:
    """Decode a take once and yield its rounds: one plate per light at its full flash, ambient light taken off.

    ``each_flash`` is shown every single plate on its way, demosaiced.
    """
    check_separable(take.plan)
    shown = _shown(clip_plates(take, timing, method=method, watch=watch), each_flash)
    return rounds(shown, take.plan, timing.flashes, start=start_number)


def clip_light_plates(
    take: Take,
    timing: Timing,
    *,
    start_number: int = FIRST_NUMBER,
    with_ambient: bool = False,
    watch: Watch = unwatched,
) -> Iterator[LightPlate]:
    """Decode a take once and yield the plates of its lights as ``clip_rounds`` has them, each as soon as it is there.

    Dark slots come only where they are wanted. Nothing is held but what a light still waits for.
    """
    check_separable(take.plan)
    plates, flashes = clip_plates(take, timing, watch=watch), timing.flashes
    return light_plates(plates, take.plan, flashes, start=start_number, with_ambient=with_ambient)


def clip_plates(take: Take, timing: Timing, *, method: Method = "weights", watch: Watch = unwatched) -> Iterator[Plate]:
    """Decode a take once and yield the plate of every flash that it holds, ambient light taken off, demosaiced."""
    _decode_ahead(take, watch)
    clip, camera = take.clip, timed_camera(take.plan, timing)
    places = places_in_time(timing, clip.numbers)
    used = _within(timing, camera, take, places)
    decoded = read_frames(clip, take.numbers, ahead=AHEAD, threads=ALL_CORES, kept=take.kept)
    frames = _placed(watch(decoded, total=len(take.numbers), what="rebuilding flashes"), places)
    rebuild = split if method == "weights" else hudon2015.split
    plates = subtract(rebuild(frames, camera, used), darks=_dark_plates(take, camera, used, places))
    return map(_colour_of(clip), plates)


def first_ambient(take: Take, timing: Timing) -> LightPlate | None:
    """Return what the take's first dark slot shows of the ambient light, None where there is none; decodes its frames.

    A round that comes before any dark slot has no ambient plate of its own.
    """
    camera, places = timed_camera(take.plan, timing), places_in_time(timing, take.clip.numbers)
    dark = next(_dark_plates(take, camera, _within(timing, camera, take, places), places), None)
    if dark is None:
        return None
    plate = _colour_of(take.clip)(replace(dark, image=update(None, dark).image))
    return LightPlate(light="ambient", number=0, time_s=plate.time_s, image=plate.image, seen=plate.seen)


def _decode_ahead(take: Take, watch: Watch) -> None:
    """Decode all frames into the take's store, unless the fit did: dark slots are read ahead, out of order."""
    clip, kept = take.clip, take.kept
    dark = len(take.plan.lit_slots) < len(take.plan.flashes)
    if kept is not None and dark and not (len(kept) or kept.missed):
        frames = read_frames(clip, take.numbers, ahead=ALL_CORES, threads=ALL_CORES, kept=kept, keep=True)
        deque(watch(frames, total=len(take.numbers), what="decoding"), maxlen=0)


def timed_camera(plan: Plan, timing: Timing) -> Camera:
    """Return the plan's camera with the exposure and readout that the timing found."""
    readout_s = timing.row_time_s * plan.camera.height_px
    return replace(plan.camera, exposure_s=timing.exposure_s, readout_s=readout_s)


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


def _dark_plates(take: Take, camera: Camera, timing: Timing, places: Mapping[int, int]) -> Iterator[Plate]:
    """Read ahead, from the few frames that they touch, the dark slots, between which ambient light is interpolated."""
    first, last = frames_touched(camera, timing.start_s, timing.duration_s)
    number_at = {places[number]: number for number in take.numbers if number in places}
    for dark in timing.flashes:
        if dark.complete and not any(dark.lights.values()):
            touched = range(first[dark.index], last[dark.index] + 1)
            near = tuple(number_at[place] for place in touched if place in number_at)
            frames = _placed(read_frames(take.clip, near, kept=take.kept), places)
            plate = plate_of(dark, frames, camera, timing) if near else None
            if plate is not None:
                yield plate
            del plate


def _colour_of(clip: Clip) -> Callable[[Plate], Plate]:
    """Return what makes colour of a clip's plates: demosaicing where its frames are mosaics, else nothing."""
    if clip.cfa is None:
        return lambda plate: plate
    pattern = clip.cfa
    return lambda plate: replace(plate, image=demosaic(plate.image, pattern))


def _shown(plates: Iterable[Plate], show: Callable[[Plate], None] | None) -> Iterator[Plate]:
    for plate in plates:
        if show is not None:
            show(plate)
        yield plate


def lights_as_planned(rig: Rig, plan: Plan) -> tuple[Light, ...]:
    """Return the plan's lights from the rig, their intensities scaled to the plan's full flashes.

    Raises PsvideoError where the rig lacks a light.
    """
    return tuple(_at_full_flash(light, reference_duration_s(plan, light.name)) for light in rig.select(plan.lights))


def _at_full_flash(light: Light, duration_s: float) -> Light:
    """A longer flash than the one a light was measured with gives proportionally more light."""
    if light.reference_duration_s is None:
        return light
    factor = duration_s / light.reference_duration_s
    return replace(
        light,
        intensity=tuple(strength * factor for strength in light.intensity),
        reference_duration_s=duration_s,
    )


CLIPPED_WITHIN = 1e-5
"""The largest code may come out a rounding below 1.0."""


@dataclass(frozen=True, kw_only=True)
class Instant:
    """The surface at one instant, and the round of plates that it was solved from."""

    round: Round
    surface: Surface


def surfaces(
    gathered: Iterable[Round],
    plan: Plan,
    rig: Rig,
    *,
    mask: NDArray[np.bool_] | None = None,
    solving: Solving = Solving(),
    near: NearSurface | None = None,
    falloff: Falloff | None = None,
) -> Iterator[Instant]:
    """Solve every round that has a plate of each of the plan's lights; the clip's start and end cut the others.

    ``near`` says where near lights find the surface, ``falloff`` what share of their light arrives where. Raises
    PsvideoError where the rig lacks a light, or its lights give no normals.
    """
    lights = lights_as_planned(rig, plan)
    shares = None if falloff is None else [falloff.field(light.name) for light in lights]
    if shares is not None:
        lights = tuple(_at_least(light, share) for light, share in zip(lights, shares, strict=True))

    def solved(one: Round) -> Instant:
        scaled = [_weaker(light, plate.saturation) for light, plate in zip(lights, one.plates, strict=True)]
        light = partial(illumination, scaled, channels=1 if one.plates[0].image.ndim == 2 else 3)
        whole = all(plate.seen.ndim == 1 for plate in one.plates)
        seen = np.stack([plate.seen if whole else plate.pixels_seen for plate in one.plates])
        plates = [_until_saturation(plate) for plate in one.plates]
        if shares is not None:
            plates = [_evened(plate, share) for plate, share in zip(plates, shares, strict=True)]
        shown = None if seen.all() else seen

        def solve(lit: Illumination) -> Surface:
            return solving.solve(plates, lit, seen=shown, mask=mask)

        if near is None:
            return Instant(round=one, surface=solve(light()))
        surface = solve_near(near.at(one.number), lambda ground: light(ground=ground), solve)
        return Instant(round=one, surface=surface)

    # map and filter hold no round while the next one gathers, as a loop's variable would
    return map(solved, filter(lambda one: one.lights == plan.lights, gathered))


def denoised(instants: Iterable[Instant], results: int) -> Iterator[Instant]:
    """Average every surface with those before it, up to so many ``results``, where nothing moves."""
    average: Average | None = None
    for instant in instants:
        average, surface = averaged(average, instant.surface, results)
        yield replace(instant, surface=surface)
        del instant, surface


def _weaker(light: Light, saturation: float) -> Light:
    """Return a light as the solver is to see it, whose plates are clipped at 1.0."""
    return replace(light, intensity=tuple(strength / saturation for strength in light.intensity))


def _at_least(light: Light, share: NDArray[np.float32]) -> Light:
    """Return a light as strong as where least of it arrives."""
    least = float(share.min())
    return replace(light, intensity=tuple(strength * least for strength in light.intensity))


def _evened(image: Image, share: NDArray[np.float32]) -> Image:
    """Return a plate as if everywhere as little light arrived as where least does; what is clipped stays clipped."""
    factor = share.min() / share
    even = image * (factor if image.ndim == 2 else factor[..., None])
    return np.where(image >= 1 - CLIPPED_WITHIN, image, even).astype(image.dtype, copy=False)


def _until_saturation(plate: LightPlate) -> Image:
    """Return a plate on a scale on which it is clipped at 1.0."""
    return plate.image if plate.saturation == 1.0 else plate.image / np.float32(plate.saturation)
