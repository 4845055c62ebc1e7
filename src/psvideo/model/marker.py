"""The marker: what distinguishes the flashes of a cycle by when light comes, without looking at the picture.

Timing sees of a flash how long it lasts and whether it is dark. A dark slot, a flash of another length, or rounds that
skip their dark slots mark the cycle. Where turning the cycle by some flashes gives a cycle that looks the same, the
lights' names are not in the timing: their powers, a rig's directions or a person must say it.
"""

from collections.abc import Iterable, Sequence, Set
from dataclasses import dataclass

from psvideo.model.plan import HasLights, Plan

NOT_FIRING = 0.01
"""Of the strongest light's, what a light that fires gives at least: with less it looks like a dark slot."""
HIDDEN_MARKER = (
    "The plan has a dark slot, and the picture does not show which one it is: see that every light fires, for one that "
    "gives no light looks as dark."
)


@dataclass(frozen=True, kw_only=True)
class SlotKind:
    """What timing sees of a flash: its length on the strobe's clock, and whether it is a dark slot."""

    duration_s: float
    is_dark: bool


def slot_kinds(plan: Plan) -> tuple[SlotKind, ...]:
    """Return what timing sees of every flash of one cycle, in order."""
    flashes = (plan.flashes[slot] for slot in plan.cycle_slots)
    return tuple(SlotKind(duration_s=flash.duration_s, is_dark=flash.is_dark) for flash in flashes)


def alike_turns(plan: Plan) -> tuple[int, ...]:
    """Return by how many flashes the cycle can be turned without a change in when light comes, 0 first."""
    kinds = slot_kinds(plan)
    return tuple(turn for turn in range(len(kinds)) if kinds[turn:] + kinds[:turn] == kinds)


def turns_in_the_dark(plan: Plan, dead: Set[int]) -> tuple[int, ...]:
    """Return by how many flashes the cycle can be turned where the lights of some slots are ``dead``, which look like
    dark slots: every slot that is then named dark must be. 0 is among them; without a dead slot, ``alike_turns``."""
    kinds, slots = slot_kinds(plan), plan.cycle_slots
    dark = [kind.is_dark or slot in dead for kind, slot in zip(kinds, slots, strict=True)]

    def fits(turn: int) -> bool:
        later = kinds[turn:] + kinds[:turn]
        same = all(kind.duration_s == named.duration_s for kind, named in zip(kinds, later, strict=True))
        return same and all(is_dark or not named.is_dark for is_dark, named in zip(dark, later, strict=True))

    return tuple(turn for turn in range(len(kinds)) if fits(turn))


def has_marker(plan: Plan) -> bool:
    """Return whether every turn of the cycle looks unlike it, so that timing alone distinguishes the flashes."""
    return len(alike_turns(plan)) == 1


def why_guessed(flashes: Iterable[HasLights]) -> str:
    """Say why timing did not show which light is which, of flashes of a plan or of a clip that have such a guess."""
    return HIDDEN_MARKER if any(flash.is_dark for flash in flashes) else "The picture shows no marker."


def turned_slot(plan: Plan, slot: int, turn: int) -> int:
    """Return the slot that stands ``turn`` places further on in the cycle; negative turns go back."""
    cycle = plan.cycle_slots
    return cycle[(cycle.index(slot) + turn) % len(cycle)]


def first_break(plan: Plan, slots: Sequence[int]) -> int | None:
    """Return the first of consecutive flashes that no place in the cycle puts behind those before; None: there is none.

    Where rounds look alike it may be some flashes after the true break.
    """
    cycle = plan.cycle_slots
    places = list(range(len(cycle)))
    for number, slot in enumerate(slots):
        places = [place for place in places if cycle[(place + number) % len(cycle)] == slot]
        if not places:
            return number
    return None


def cycle_places(plan: Plan, slots: Sequence[int]) -> tuple[int, ...]:
    """Return the places in the cycle, from 0, at which consecutive flashes of these slots may begin."""
    cycle = plan.cycle_slots
    around = cycle * (1 + -(-len(slots) // len(cycle)))
    seen = tuple(slots)
    return tuple(place for place in range(len(cycle)) if around[place : place + len(seen)] == seen)
