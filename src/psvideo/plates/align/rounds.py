"""Plates brought to one instant each: a window of about two rounds slides over the clip, plate by plate.

A round's flashes show different instants. Each light's plate at the wanted instant is made from the two plates of that
light around it, as soon as the second one is there; at the clip's ends, and beside a gap, from the two nearest ones.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from psvideo.compute.threads import over_ranges
from psvideo.model.arrays import Codes8, Flags, Floats
from psvideo.model.choices import Align, Rate
from psvideo.model.irradiance.ground import Ground
from psvideo.model.rig import Light
from psvideo.plates.align.as_they_are import (
    AsTheyAre,
    BothWays,
    fits_as_it_is,
    nearest_of,
    seen_by_all,
    stands_under,
)
from psvideo.plates.align.between import Ends, plate_at
from psvideo.plates.align.by_surface import BySurface
from psvideo.plates.align.comb import Comb, Schedule
from psvideo.plates.align.doubt.lone_edges import InstantSketch, unsure_by_lone_edges
from psvideo.plates.align.doubt.turning import PlateEnds, arc_deg
from psvideo.plates.align.doubt.unsure import UNKNOWN
from psvideo.plates.align.left_out import AtInstant, better_without
from psvideo.plates.align.light_history import Around, DueInstant, Held
from psvideo.plates.align.own_ways import along_own_ways
from psvideo.plates.align.packed import PutBy
from psvideo.plates.align.pixel_sources import Taken, taken_of, without_doubtful
from psvideo.plates.align.plate_lamps import Lamps
from psvideo.plates.align.rigid.with_bodies import with_bodies
from psvideo.plates.align.shake.steadied import Steadied, steady_at
from psvideo.plates.align.velocity.all_lights import AllLights
from psvideo.plates.align.velocity.brightness import evened
from psvideo.plates.align.velocity.flow import Sketch
from psvideo.plates.align.velocity.followed import Followed, Pair
from psvideo.plates.align.velocity.moving import Choosing, followed_at
from psvideo.plates.align.velocity.moving_kernel import BOTH, NOWHERE
from psvideo.plates.align.velocity.own_flow import OwnFlow
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.sequence import AMBIENT, Round, gathered, handed_over


@dataclass(frozen=True, kw_only=True)
class Aligning:
    """How plates are brought to one instant. ``auto`` looks for flow between plates that differ by more than noise.

    ``rate`` says which instants are shown: the middle of every round's flashes, every flash, or those of a steady rate.
    ``lights`` are those of the plates where it is known how they shine: four and more tell where plates as they are
    show one surface, and plates brought to the instant do not; three and more tell how a body moves. Near ones tell it
    where the ``ground`` is given that they shine on.
    """

    align: Align = "auto"
    rate: Rate | Comb = "round"
    lights: tuple[Light, ...] = ()
    ground: Ground | None = None

    @property
    def leaves_plates(self) -> bool:
        """Whether complete rounds are shown, their plates as they are."""
        return self.align == "none" and self.rate == "round"


UNMOVED = Aligning(align="none")
"""Complete rounds, their plates as they are."""


def aligned(
    plates: Iterable[LightPlate],
    lights: tuple[str, ...],
    how: Aligning,
    *,
    first: int,
    with_ambient: bool = False,
    schedule: Schedule | None = None,
    whites: dict[str, float] | None = None,
    put_by: PutBy | None = None,
    coded: bool = False,
) -> Iterator[Round]:
    """Yield rounds whose plates all show one instant: one for every complete round, or for every flash of it.

    ``plates`` come in the order of their rounds. ``first`` is the number of the clip's first round; ``schedule`` are
    the instants of a steady rate, by round. One result per flash takes numbers of its own from there on, as many a
    round as there are lights. Plates between which nothing moved pass as they are. Held are, in plates per light, one
    without alignment, one where nothing moves (one and a half at the clip's start), one and a half and as many in 16
    bits where all does, and two at other rates than the rounds'. ``with_ambient`` says that dark slots come as well:
    every round waits for its own, and takes it along as it is. ``whites`` (by light) are those of the clip's first
    plates, where ``plates`` begin later; what it lacks is put in. ``put_by`` takes the codes of plates that were moved;
    without it they lie in memory. ``coded``: the plates are made of a movie's frames.
    """
    if how.leaves_plates:
        return gathered(
            plates, lights, expected=lambda _: {*lights, AMBIENT} if with_ambient else {*lights}, whole=True
        )
    held = Held(
        lights=lights,
        sketched=how.align != "none",
        keep_all=how.rate != "round",
        trusts_rest=how.align == "auto" and how.rate == "round",
        with_ambient=with_ambient,
        whites={} if whites is None else whites,
        put_by=put_by,
        lamps=Lamps.of(how.lights, lights, how.ground),
        coded=coded,
    )
    return _slid(plates, held, how, first, schedule)


def _slid(
    plates: Iterable[LightPlate], held: Held, how: Aligning, first: int, schedule: Schedule | None
) -> Iterator[Round]:
    for plate in plates:
        number, times_s = plate.number, held.take(plate)
        del plate
        if times_s is not None:
            held.waiting.extend(_instants(number, list(times_s.values()), how, first, schedule))
        yield from _complete(held, how)
    held.ended = True
    yield from _complete(held, how)


def _instants(
    number: int, times_s: list[float], how: Aligning, first: int, schedule: Schedule | None
) -> list[DueInstant]:
    """Return the instants that are shown of a complete round."""
    if schedule is not None:
        due = schedule.by_round.get(number, ())
        return [
            DueInstant(number=own, time_s=time_s, round=number, guessed=_is_beside(how, own - first, time_s))
            for own, time_s in due
        ]
    if how.rate == "round":
        return [DueInstant(number=number, time_s=float(np.mean(times_s)), round=number)]
    start = first + (number - first) * len(times_s)
    return [DueInstant(number=start + n, time_s=time_s, round=number) for n, time_s in enumerate(sorted(times_s))]


def _is_beside(how: Aligning, k: int, time_s: float) -> bool:
    """Return whether an instant is looked at for an open shutter only, beside the one whose surface is solved."""
    return isinstance(how.rate, Comb) and time_s != how.rate.time_s(k)


def _complete(held: Held, how: Aligning) -> Iterator[Round]:
    """Make what can be made by now, release what that needed, and yield the instants that are complete, in order."""
    held.let_go()
    while held.waiting:
        instant = held.waiting[0]
        _pass_rest(held, instant, how)
        if instant.moving and len(instant.made) + len(instant.moving) == len(held.lights):
            _make_moving(held, instant)
        if len(instant.made) < len(held.lights) or held.lacks_ambient(instant):
            return
        if instant.round in held.ambient:
            instant.made[AMBIENT] = held.ambient[instant.round]
        held.waiting.popleft()
        stood, calm = (held.stood(instant.round), held.calm(instant.round)) if held.sketched else (None, None)
        held.let_go()
        one = handed_over(instant.made, instant.number, held.lights, stood)
        yield replace(one, motion=instant.motion, unsure=instant.unsure, calm=calm)


def _pass_rest(held: Held, instant: DueInstant, how: Aligning) -> None:
    """Hand on the plates of lights under which nothing moves, and note those under which something does.

    At other rates than the rounds' plates are held for other instants anyway: none is judged before all can be.
    """
    undone = [light for light in held.lights if light not in instant.made and light not in instant.moving]
    undone.sort(key=lambda light: held.shots[light][instant.round].time_s)
    if how.rate != "round" and any(held.around(light, instant) is None for light in undone):
        return
    for light in undone:
        around = held.around(light, instant)
        if around is None:
            continue
        if _moves(held, light, around, how):
            instant.moving.add(light)
            held.pack(light, around)
        else:
            _hand_on(instant, around.nearest(instant.time_s))
        held.let_go()


def _moves(held: Held, light: str, around: Around, how: Aligning) -> bool:
    """Return whether anything moves between two shots of a light, where that is asked for."""
    if around.before is around.after or around.before.sketch is None:
        return False
    return how.align == "flow" or bool(held.moved_since(light, around.after.round))


def _pair(around: Around) -> Pair:
    before, after = around.before.sketch, around.after.sketch
    if before is None or after is None:
        raise ValueError("there is no motion without sketches")
    return Pair(before=before, after=evened(before, after))


def _pairs_of(held: Held, instant: DueInstant) -> dict[str, Pair]:
    """Return the sketches around an instant of all lights under which something moves."""
    return {light: _pair(held.sure_around(light, instant)) for light in held.lights if light in instant.moving}


def _make_moving(held: Held, instant: DueInstant) -> None:
    """Make the plates of all lights under which something moves; each is let go as soon as it was used."""
    by_light = _pairs_of(held, instant)
    steady = steady_at(held, instant, by_light)
    if steady is not None:
        by_light = {light: steady.pair(pair) for light, pair in _pairs_of(held, instant).items()}
    lights, pairs = [*by_light], [*by_light.values()]
    by_surface = BySurface.of(held.lamps, by_light, _standing(held, instant))
    choose = None if by_surface is None else _choosing(by_surface)
    motion = followed_at(pairs, instant.time_s, others=len(held.lights) - len(lights), choose=choose)
    instant.motion = motion
    if steady is not None:
        instant.motion = motion = replace(motion, carried=steady.per_s(motion.step))
    shown = over_ranges(lambda n, _: taken_of(pairs[n], motion, guessed=instant.guessed), len(pairs), each=1)
    guesses = sources = [one.source for one in shown]
    unknown = np.zeros_like(motion.moves)
    if not instant.guessed:
        better = _better_without(held, instant, dict(zip(lights, shown, strict=True)))
        sources, unknown = without_doubtful(shown, motion, len(held.lights) - len(lights), better)
        kept = _as_they_are(held, instant, motion, dict(zip(lights, pairs, strict=True)), shown)
        instant.motion = motion = motion.without(kept.fits)
        shown = [kept.taken(one, pair, motion) for one, pair in zip(shown, pairs, strict=True)]
        sources = [kept.source(one, own) for one, own in zip(shown, sources, strict=True)]
        unknown, guesses = unknown & ~kept.stands, [one.source for one in shown]
    taken = dict(zip(lights, shown, strict=True))
    instant.motion = motion = replace(motion, arc_deg=_arc_deg(held, instant, taken, sources))
    instant.unsure = _unsure(held, instant, taken, sources)
    instant.unsure[:, unknown] = UNKNOWN
    own = dict[str, OwnFlow]()
    if instant.guessed and steady is None:
        own = held.own_flows.of(dict(zip(lights, pairs, strict=True)))
    for light, source, guess in zip(lights, sources, guesses, strict=True):
        around = held.sure_around(light, instant)
        plate = _moved_to(around, (source, guess), motion, steady, held.put_by)
        if light in own and around.before.plate is not None and around.after.plate is not None:
            ends = around.before.plate, around.after.plate
            plate = along_own_ways(plate, ends, own[light], motion, put_by=held.put_by)
        _hand_on(instant, plate)
        instant.moving.remove(light)
        held.let_go()


def _choosing(surface: BySurface) -> Choosing:
    """Return what chooses between velocities by the surface: of bodies that turn, and then piece by piece."""

    def choose(lights: AllLights, proposals: Sequence[Floats], found: Followed, still: Flags) -> Followed:
        return surface.chosen(lights, proposals, with_bodies(surface, lights, found, still), still)

    return choose


def _standing(held: Held, instant: DueInstant) -> dict[str, Sketch | None]:
    """Return the sketches of an instant of all lights under which nothing moves."""
    still = [light for light in held.lights if light not in instant.moving]
    return {light: held.shots[light][instant.round].sketch for light in still}


def _better_without(held: Held, instant: DueInstant, taken: dict[str, Taken]) -> Callable[[Flags], Flags] | None:
    """Return what says of the lights that are used, (light, row, col) of those taken, where a normal of them and of
    what stands is better than one of all; None where the lights do not tell."""
    motion, lamps, lights = instant.motion, held.lamps, list[AtInstant]()
    if lamps is None or not lamps.checked or motion is None:
        return None
    for light in held.lights:
        sketch, shape = held.shots[light][instant.round].sketch, motion.moves.shape
        if light in taken:
            share = held.sure_around(light, instant).share(instant.time_s)
            lights.append(AtInstant(shows=taken[light].shows, unsure=taken[light].unsure, share=share))
        elif sketch is not None:
            still = InstantSketch.standing(sketch, shape)
            lights.append(AtInstant(shows=still, unsure=np.zeros(shape, np.float32), share=1.0))
    if len(lights) < len(held.lights):
        return None
    places = [held.lights.index(light) for light in taken]

    def better(used: Flags) -> Flags:
        every = np.ones((len(lights), *used.shape[1:]), np.bool_)
        every[places] = used
        return better_without(lamps, lights, every)

    return better


def _as_they_are(
    held: Held, instant: DueInstant, motion: Followed, pairs: dict[str, Pair], shown: Sequence[Taken]
) -> AsTheyAre:
    """Return where plates as they are show one surface, and those that are taken do not, which is nowhere where the
    lights do not tell; and what stands still."""
    seen = seen_by_all([*pairs.values()], motion)
    stands = stands_under(motion, len(held.lights)) & seen
    nowhere = AsTheyAre(fits=np.zeros((1, 1), np.bool_), stands=stands)
    if held.lamps is None or not held.lamps.checked:
        return nowhere
    ways, both = dict(zip(pairs, shown, strict=True)), []
    for light in held.lights:
        if light in ways:
            both.append(BothWays(rest=nearest_of(pairs[light], motion), moved=ways[light].shows))
        elif (sketch := held.shots[light][instant.round].sketch) is not None:
            both.append(BothWays.standing(InstantSketch.standing(sketch, motion.moves.shape)))
    if len(both) < len(held.lights):
        return nowhere
    return AsTheyAre(fits=fits_as_it_is(held.lamps, both) & seen, stands=stands)


def _unsure(held: Held, instant: DueInstant, taken: dict[str, Taken], sources: Sequence[Codes8]) -> Floats:
    """Return by how much every light's plate may be off, (light, row, col): where its two plates disagree, and where
    the lights do; what is left out is not."""
    moves = np.zeros(sources[0].shape, np.bool_) if instant.motion is None else instant.motion.moves
    shape = moves.shape
    used = (source != NOWHERE for source in sources)
    shown = {light: replace(one.shows, used=where) for (light, one), where in zip(taken.items(), used, strict=True)}
    for light in held.lights:
        sketch = held.shots[light][instant.round].sketch
        if light not in shown and sketch is not None:
            shown[light] = InstantSketch.standing(sketch, shape)
    unsure = np.zeros((len(held.lights), *shape), np.float32)
    for light, off in zip(shown, unsure_by_lone_edges(list(shown.values()), moves), strict=True):
        unsure[held.lights.index(light)] = off
    for (light, one), source in zip(taken.items(), sources, strict=True):
        own = unsure[held.lights.index(light)]
        own[:] = np.hypot(own, one.unsure) * (source != NOWHERE)
    return unsure


def _arc_deg(held: Held, instant: DueInstant, taken: dict[str, Taken], sources: Sequence[Codes8]) -> Floats | None:
    """Return by how many degrees normals may be off because what is blended turns between two plates of a light, (row,
    col); None where the lights do not tell."""
    if held.lamps is None or not held.lamps.checked:
        return None
    ends, shape = list[PlateEnds](), sources[0].shape
    for light in held.lights:
        sketch = held.shots[light][instant.round].sketch
        if light in taken:
            ends.append((*taken[light].ends, taken[light].shows.white))
        elif sketch is not None:
            still = InstantSketch.standing(sketch, shape)
            ends.append((still.codes, still.codes, still.white))
    if len(ends) < len(held.lights):
        return None
    blended = np.any([source == BOTH for source in sources], axis=0)
    return np.asarray(arc_deg(held.lamps, ends) * blended, np.float32)


def _moved_to(
    around: Around, sources: tuple[Codes8, Codes8], motion: Followed, steady: Steadied | None, put_by: PutBy | None
) -> LightPlate:
    before, after = around.before, around.after
    share = (motion.time_s - before.time_s) / (after.time_s - before.time_s)
    ends, times_s = Ends(before=before.plate, after=after.plate, share=share), (before.time_s, after.time_s)
    if steady is not None:
        ends = replace(ends, shifts=steady.shifts(*times_s))
        there = before.plate is not None, after.plate is not None
        taken, shown = (steady.source(one, motion, times_s, there) for one in sources)
        sources = taken, shown
    return plate_at(ends, sources[0], motion, number=after.round, guess=sources[1], put_by=put_by)


def _hand_on(instant: DueInstant, plate: LightPlate) -> None:
    shown_s = plate.flashed_s
    instant.made[plate.light] = replace(plate, number=instant.number, time_s=instant.time_s, shown_s=shown_s)
