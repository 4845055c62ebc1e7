"""Plates brought to one instant each: a window of about two rounds slides over the clip, plate by plate.

A round's flashes show different instants. Each light's plate at the wanted instant is made from the two plates of that
light around it, as soon as the second one is there; at the clip's ends, and beside a gap, from the two nearest ones.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from psvideo.model.choices import Align, Rate
from psvideo.plates.align.between import Ends, plate_at, track
from psvideo.plates.align.brightness import evened
from psvideo.plates.align.flow import Flow, flow_between
from psvideo.plates.align.held import Around, DueInstant, Held
from psvideo.plates.sequence import AMBIENT, LightPlate, Round, gathered, handed_over

Flows = dict[tuple[str, int], Flow | None]
"""Flow from the plate of a light in a round (its number) to the next one; None where nothing moved."""


@dataclass(frozen=True, kw_only=True)
class Aligning:
    """How plates are brought to one instant. ``auto`` looks for flow between plates that differ by more than noise.

    ``rate`` says which instants are shown: the middle of every round's flashes, or every flash.
    """

    align: Align = "auto"
    rate: Rate = "round"


UNMOVED = Aligning(align="none")
"""Complete rounds, their plates as they are."""


def aligned(
    plates: Iterable[LightPlate], lights: tuple[str, ...], how: Aligning, *, first: int, with_ambient: bool = False
) -> Iterator[Round]:
    """Yield rounds whose plates all show one instant: one for every complete round, or for every flash of it.

    ``plates`` come in the order of their rounds. ``first`` is the number of the clip's first round. One result per
    flash takes numbers of its own from there on, as many a round as there are lights. Plates between which nothing
    moved pass as they are. Held are, in plates per light, one without alignment, one where nothing moves (one and a
    half at the clip's start), one and a half and as many in 16 bits where all does, and two at one result per flash.
    ``with_ambient`` says that dark slots come as well: every round waits for its own, and takes it along as it is.
    """
    if how == UNMOVED:
        return gathered(
            plates, lights, expected=lambda _: {*lights, AMBIENT} if with_ambient else {*lights}, whole=True
        )
    return _slid(plates, lights, how, first, with_ambient)


def _slid(
    plates: Iterable[LightPlate], lights: tuple[str, ...], how: Aligning, first: int, with_ambient: bool
) -> Iterator[Round]:
    held = Held(
        lights=lights,
        sketched=how.align != "none",
        keep_all=how.rate == "flash",
        trusts_rest=how.align == "auto" and how.rate == "round",
        with_ambient=with_ambient,
    )
    flows: Flows = {}
    for plate in plates:
        number, times_s = plate.number, held.take(plate)
        del plate
        if times_s is not None:
            held.waiting.extend(_instants(number, list(times_s.values()), how, first))
        yield from _complete(held, how, flows)
    held.ended = True
    yield from _complete(held, how, flows)


def _instants(number: int, times_s: list[float], how: Aligning, first: int) -> list[DueInstant]:
    """Return the instants that are shown of a complete round."""
    if how.rate == "round":
        return [DueInstant(number=number, time_s=float(np.mean(times_s)), round=number)]
    start = first + (number - first) * len(times_s)
    return [DueInstant(number=start + n, time_s=time_s, round=number) for n, time_s in enumerate(sorted(times_s))]


def _complete(held: Held, how: Aligning, flows: Flows) -> Iterator[Round]:
    """Make what can be made by now, release what that needed, and yield the instants that are complete, in order."""
    held.let_go()
    while held.waiting:
        instant = held.waiting[0]
        while ready := _next_ready(held, instant, how):
            _make(held, ready, instant, how, flows)
            held.let_go()
        if len(instant.made) < len(held.lights) or held.lacks_ambient(instant):
            return
        if instant.round in held.ambient:
            instant.made[AMBIENT] = held.ambient[instant.round]
        held.waiting.popleft()
        held.let_go()
        for key in [key for key in flows if key[1] < instant.round - 1]:
            del flows[key]
        yield handed_over(instant.made, instant.number, held.lights)


def _next_ready(held: Held, instant: DueInstant, how: Aligning) -> str | None:
    """Return the first light whose plate at an instant is not made yet and can be; None where there is none.

    At one result per flash plates are held for other instants anyway: none is made before all can be.
    """
    undone = [light for light in held.lights if light not in instant.made]
    undone.sort(key=lambda light: held.shots[light][instant.round].time_s)
    if how.rate == "flash" and any(held.around(light, instant) is None for light in undone):
        return None
    return next((light for light in undone if held.around(light, instant) is not None), None)


def _make(held: Held, light: str, instant: DueInstant, how: Aligning, flows: Flows) -> None:
    """Make a light's plate at an instant."""
    around = held.around(light, instant)
    if around is None:
        raise ValueError(f"light {light} of instant {instant.number} is still to come")
    time_s = instant.time_s
    flow = None if around.before is around.after else _flow(held, around, light, how, flows)
    if flow is None:
        plate = around.nearest(time_s)
    else:
        instant.moves = True
        held.pack(light, around)
        plate = _moved_to(around, flow, time_s)
    instant.made[light] = replace(plate, number=instant.number, time_s=time_s, shown_s=plate.flashed_s)


def _flow(held: Held, around: Around, light: str, how: Aligning, flows: Flows) -> Flow | None:
    """Return the flow between two shots of a light, None where nothing moved or no flow is asked for."""
    before, after = around.before.sketch, around.after.sketch
    if before is None or after is None:
        return None
    key = light, around.before.round
    if key not in flows:
        flows[key] = None
        if how.align == "flow" or held.moved_since(light, around.after.round):
            flows[key] = flow_between(before, evened(before, after))
    return flows[key] if how.rate == "flash" else flows.pop(key)


def _moved_to(around: Around, flow: Flow, time_s: float) -> LightPlate:
    before, after = around.before, around.after
    if before.sketch is None or after.sketch is None:
        raise ValueError("there is no flow without sketches")
    way = track(before.sketch, evened(before.sketch, after.sketch), flow, time_s)
    ends = Ends(before=before.plate, after=after.plate, share=(time_s - before.time_s) / (after.time_s - before.time_s))
    return plate_at(ends, way, time_s=time_s, number=after.round)
