"""From a take and its timing to plates: decode once, rebuild every flash, take ambient light off, gather into rounds.

A clip of any length streams through in constant memory.
"""

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import partial
from itertools import chain, islice, pairwise
from typing import TypeVar

from psvideo.clip import Clip, Take, check_take, demosaic, holds_plain_codes, read_frames
from psvideo.compute.progress import Watch, unwatched
from psvideo.compute.threads import thread_count
from psvideo.errors import check_kind
from psvideo.model.choices import SplitMethod
from psvideo.model.timing import Timing, places_in_time, timed_camera
from psvideo.plates import hudon2015
from psvideo.plates.align.comb import Comb, Schedule, schedule_of
from psvideo.plates.align.open_shutter import with_open_shutter
from psvideo.plates.align.rounds import Aligning, aligned
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
from psvideo.plates.nearest_rows import has_blind_time, with_nearest_rows
from psvideo.plates.part import Part
from psvideo.plates.sequence import AMBIENT, FIRST_NUMBER, Round, check_separable, coming, gathered, light_plates
from psvideo.plates.several_lights.unmixed import slot_names, slot_plates, unmixed
from psvideo.plates.split import Plate, split
from psvideo.plates.upright import upright, upright_window
from psvideo.plates.used_flashes import used_of

AnyPlate = TypeVar("AnyPlate", Plate, LightPlate)

MOST_WAITING = 24
"""Plates that may wait for the next dark slot; frames are held for them, and farther ones are read before."""
EARLY_DARKS = 2
"""Dark slots at the clip's start whose few frames are read on their own where that is quick, so that no plate waits
for them: two show whether the ambient light is steady, and where it is none waits later."""


def gather(
    take: Take,
    timing: Timing,
    *,
    aligning: Aligning | None = None,
    with_ambient: bool = True,
    method: SplitMethod = "weights",
    start_number: int = FIRST_NUMBER,
    part: Part | None = None,
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
    part
        Which of the take's frames are gathered, to the same plates as all would give; left out, all.
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
    plan = take.plan
    if take.unmixing is None:
        check_separable(plan)
    borrows = aligning is not None and plan.mode != "synced" and has_blind_time(timed_camera(plan, timing))
    turn = take.clip.turn
    window = None if each_window is None else lambda found: each_window(upright_window(found, turn))
    made = clip_plates(take, timing, method=method, part=part, watch=watch, each_window=window, unseen=borrows)
    plates = _named_plates(take, timing, _shown(made, each_flash), start_number=start_number)
    if borrows and turn.transposed:  # rows are borrowed while they are rows
        plates, borrows = with_nearest_rows(plates), False
    plates = _shown(map(partial(upright, turn=turn), plates), each_plate)
    if not with_ambient:
        plates = filter(lambda plate: plate.light != AMBIENT, plates)
    if aligning is None:
        return _rounds_as_they_are(take, timing, plates, start_number=start_number)
    rounds = aligned(
        with_nearest_rows(plates) if borrows else plates,
        _names(take),
        aligning,
        first=start_number,
        with_ambient=with_ambient,
        schedule=scheduled(take, timing, aligning, start_number=start_number),
        whites=None if part is None else part.whites,
        put_by=None if take.kept is None else take.kept.passing_codes,
    )
    rounds = _apart(rounds, take)
    return with_open_shutter(rounds) if isinstance(aligning.rate, Comb) and aligning.rate.open_s else rounds


def _names(take: Take) -> tuple[str, ...]:
    """Return the names of a round's plates: its lights, or where flashes hold several colours, its slots."""
    return take.plan.lights if take.unmixing is None else slot_names(take.plan)


def _named_plates(take: Take, timing: Timing, single: Iterator[Plate], *, start_number: int) -> Iterator[LightPlate]:
    """Yield the plates of flashes by their lights' names and rounds' numbers, or by those of their slots."""
    if take.unmixing is None:
        return light_plates(single, take.plan, timing.flashes, start=start_number)
    return slot_plates(single, timing.flashes, start=start_number)


def _rounds_as_they_are(
    take: Take, timing: Timing, plates: Iterator[LightPlate], *, start_number: int
) -> Iterator[Round]:
    """Yield rounds whose plates are each of their own flash's instant."""
    names = _names(take)
    if take.unmixing is not None:
        return _apart(gathered(plates, names, expected=lambda _: {*names, AMBIENT}, whole=True), take)
    expected = coming(take.plan, timing.flashes, start=start_number)
    return gathered(plates, names, expected=expected.__getitem__)


def _apart(rounds: Iterator[Round], take: Take) -> Iterator[Round]:
    return rounds if take.unmixing is None else map(partial(unmixed, how=take.unmixing), rounds)


def scheduled(take: Take, timing: Timing, aligning: Aligning, *, start_number: int) -> Schedule | None:
    """Return which instants ``gather`` will show, where they come at a steady rate; None where rounds decide."""
    if not isinstance(aligning.rate, Comb):
        return None
    camera, places = timed_camera(take.plan, timing), places_in_time(timing, take.clip.numbers)
    end_s = (max(places.values()) + 0.5) * camera.frame_period_s
    within = used_of(take, timing).flashes
    return schedule_of(take.plan, timing.flashes, aligning.rate, start=start_number, end_s=end_s, within=within)


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


def _shown(plates: Iterable[AnyPlate], show: Callable[[AnyPlate], None] | None) -> Iterator[AnyPlate]:
    for plate in plates:
        if show is not None:
            show(plate)
        yield plate
        del plate  # nothing holds it while the next one is made
