"""Rounds of plates brought to one instant each: a window of three rounds slides over the clip.

A round's flashes show different instants. Each light's plate at the wanted instant is made from the two plates of that
light around it; at the clip's ends, and beside a gap, from the two that are nearest.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Literal

from psvideo.align.between import Ends, plate_at, track
from psvideo.align.flow import Flow, Sketch, flow_between, moved, sketch_of, white_of
from psvideo.sequence import LightPlate, Round

Align = Literal["none", "flow", "auto"]
Rate = Literal["round", "flash"]
Flows = dict[tuple[str, int], Flow | None]
"""Flow from the plate of a light in a round (its number) to the next one; None where nothing moved."""


@dataclass(frozen=True, kw_only=True)
class Aligning:
    """How plates are brought to one instant. ``auto`` looks for flow between plates that differ by more than noise.

    ``rate`` says which instants are shown: the middle of every round's flashes, or every flash.
    """

    align: Align = "auto"
    rate: Rate = "round"


@dataclass(frozen=True, kw_only=True)
class _Held:
    """A round in the window: its plates as far as they are needed still, and the sketches of all, by light."""

    round: Round
    sketches: dict[str, Sketch]

    def plate(self, light: str) -> LightPlate | None:
        """Return a light's plate, None where the round has none or has let it go."""
        return next((plate for plate in self.round.plates if plate.light == light), None)


@dataclass(frozen=True)
class _Window:
    """The round that is shown, and those before and after it, if any."""

    before: _Held | None
    current: _Held
    after: _Held | None

    def around(self, light: str, time_s: float) -> tuple[_Held, _Held] | None:
        """Return the two rounds with a plate of the light, one round apart, that lie around an instant or nearest."""
        number = self.current.round.number
        near = [
            held
            for held in (self.before, self.current, self.after)
            if held is not None and light in held.sketches and abs(held.round.number - number) <= 1
        ]
        if len(near) < 2:
            return None
        later = next((n for n, held in enumerate(near) if held.sketches[light].time_s > time_s), len(near))
        end = min(max(later, 1), len(near) - 1)
        return near[end - 1], near[end]

    def nearest(self, light: str, time_s: float) -> LightPlate:
        """Return the light's plate that is nearest in time."""
        held = (one.plate(light) for one in (self.before, self.current, self.after) if one is not None)
        return min((plate for plate in held if plate is not None), key=lambda plate: abs(plate.time_s - time_s))


def aligned(gathered: Iterable[Round], lights: tuple[str, ...], how: Aligning, *, first: int) -> Iterator[Round]:
    """Yield rounds whose plates all show one instant: one for every complete round, or for every flash of it.

    ``first`` is the number of the clip's first round. One result per flash takes numbers of its own from there on, as
    many a round as there are lights. Two rounds are held, the parts of the round before that are needed still, and what
    is yielded. Plates between which nothing moved pass as they are.
    """
    if how.align == "none" and how.rate == "round":
        return filter(lambda one: one.lights == lights, gathered)
    return _slid(gathered, lights, how, first)


def _slid(gathered: Iterable[Round], lights: tuple[str, ...], how: Aligning, first: int) -> Iterator[Round]:
    whites: dict[str, float] = {}
    flows: Flows = {}
    before: _Held | None = None
    current: _Held | None = None
    for one in gathered:
        after = _hold(one, whites)
        del one
        if current is not None:
            yield from _shown(_Window(before, current, after), lights, how, flows, first)
            before = _let_go(current, how)
            for key in [key for key in flows if key[1] < before.round.number]:
                del flows[key]
        current = after
        del after
    if current is not None:
        yield from _shown(_Window(before, current, None), lights, how, flows, first)


def _hold(one: Round, whites: dict[str, float]) -> _Held:
    for plate in one.plates:
        whites.setdefault(plate.light, white_of(plate))
    return _Held(round=one, sketches={plate.light: sketch_of(plate, white=whites[plate.light]) for plate in one.plates})


def _let_go(held: _Held, how: Aligning) -> _Held:
    """Keep of a round only the plates from which a later instant is made: those after its middle, or all."""
    one = held.round
    kept = tuple(plate for plate in one.plates if how.rate == "flash" or plate.time_s > one.time_s)
    return replace(held, round=Round(number=one.number, plates=kept))


def _shown(window: _Window, lights: tuple[str, ...], how: Aligning, flows: Flows, first: int) -> Iterator[Round]:
    """Make every instant of the window's middle round, if that has all lights."""
    one = window.current.round
    if one.lights != lights:
        return iter(())
    instants = [(one.number, one.time_s)]
    if how.rate == "flash":
        start = first + (one.number - first) * len(lights)
        instants = [(start + n, time_s) for n, time_s in enumerate(sorted(plate.time_s for plate in one.plates))]

    def at(number: int, time_s: float) -> Round:
        plates = [replace(_plate(window, light, time_s, how, flows), number=number, time_s=time_s) for light in lights]
        return Round(number=number, plates=tuple(plates), ambient=one.ambient)

    return (at(*instant) for instant in instants)


def _plate(window: _Window, light: str, time_s: float, how: Aligning, flows: Flows) -> LightPlate:
    """Return a light's plate at an instant."""
    pair = window.around(light, time_s)
    nearest = window.nearest(light, time_s)
    if how.align == "none" or pair is None or nearest.time_s == time_s:
        return nearest
    before, after = (held.sketches[light] for held in pair)
    key = light, before.number
    if key not in flows:
        flows[key] = flow_between(before, after) if how.align == "flow" or moved(before, after) else None
    flow = flows[key] if how.rate == "flash" else flows.pop(key)
    if flow is None:
        return nearest
    share = (time_s - before.time_s) / (after.time_s - before.time_s)
    ends = Ends(before=pair[0].plate(light), after=pair[1].plate(light), share=share)
    return plate_at(ends, track(before, after, flow, time_s), time_s=time_s, number=nearest.number)
