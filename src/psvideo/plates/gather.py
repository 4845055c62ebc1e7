"""From a take and its timing to rounds: the plates of its flashes (``flash_plates``) named, turned, brought together.

A clip of any length streams through in constant memory.
"""

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import TypeVar

from psvideo.clip import Take, check_take
from psvideo.compute.progress import Watch, unwatched
from psvideo.errors import check_kind
from psvideo.model.choices import SplitMethod
from psvideo.model.timing import Timing, places_in_time, timed_camera
from psvideo.plates.align.comb import Comb, Schedule, schedule_of
from psvideo.plates.align.lent.bringing import Bringing
from psvideo.plates.align.open_shutter import with_open_shutter
from psvideo.plates.align.plate_lamps import Lamps
from psvideo.plates.align.rounds import Aligning, aligned
from psvideo.plates.ambient.ambient_regression import Separated
from psvideo.plates.flash_plates import clip_plates
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.nearest_rows import has_blind_time, waits_for, with_nearest_rows
from psvideo.plates.part import Part
from psvideo.plates.sequence import AMBIENT, FIRST_NUMBER, Round, check_separable, coming, gathered, light_plates
from psvideo.plates.several_lights.unmixed import slot_names, slot_plates, unmixed
from psvideo.plates.split import Plate
from psvideo.plates.upright import upright, upright_window
from psvideo.plates.used_flashes import used_of

AnyPlate = TypeVar("AnyPlate", Plate, LightPlate)


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
    whites = dict[str, float]() if part is None else part.whites
    bringing = _bringing(take, timing, aligning, whites) if borrows else None
    window = None if each_window is None else lambda found: each_window(upright_window(found, turn))
    made = clip_plates(take, timing, method=method, part=part, watch=watch, each_window=window, unseen=borrows)
    plates = _named_plates(take, timing, _shown(made, each_flash), start_number=start_number)
    if borrows and turn.transposed:  # rows are borrowed while they are rows
        plates, borrows = with_nearest_rows(plates, bringing), False
    plates = _shown(map(partial(upright, turn=turn), plates), each_plate)
    if not with_ambient:
        plates = filter(lambda plate: plate.light != AMBIENT, plates)
    if aligning is None:
        return _rounds_as_they_are(take, timing, plates, start_number=start_number)
    rounds = aligned(
        with_nearest_rows(plates, bringing) if borrows else plates,
        _names(take),
        aligning,
        first=start_number,
        with_ambient=with_ambient,
        schedule=scheduled(take, timing, aligning, start_number=start_number),
        whites=whites,
        put_by=None if take.kept is None else take.kept.passing_codes,
        coded=take.clip.is_movie,
    )
    rounds = _apart(rounds, take)
    return with_open_shutter(rounds) if isinstance(aligning.rate, Comb) and aligning.rate.open_s else rounds


def _bringing(take: Take, timing: Timing, aligning: Aligning | None, whites: dict[str, float]) -> Bringing | None:
    """Return what moves rows that other flashes lend; None where motion is not asked for."""
    if aligning is None or aligning.align == "none":
        return None
    names = _names(take)
    sideways = take.clip.turn.transposed  # near lights shine on what is upright
    return Bringing(
        lights=names,
        waits=waits_for(timed_camera(take.plan, timing)),
        lamps=None if sideways else Lamps.of(aligning.lights, names, aligning.ground),
        whites=whites,
    )


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


def _shown(plates: Iterable[AnyPlate], show: Callable[[AnyPlate], None] | None) -> Iterator[AnyPlate]:
    for plate in plates:
        if show is not None:
            show(plate)
        yield plate
        del plate  # nothing holds it while the next one is made
