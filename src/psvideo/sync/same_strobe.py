"""Whether cameras' plans tell of one strobe, and whether a clip's flashes can be found in it.

A plan beside a log of the board has what was played: whole ticks, and powers as bursts gave them. One without has what
was asked for. Both are the same strobe's.
"""

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import replace

from psvideo.errors import PsvideoError
from psvideo.model.marker import cycle_places, first_break, why_guessed
from psvideo.model.plan import Plan, PlannedFlash
from psvideo.model.rows.shutter import frames_touched
from psvideo.model.timing import Timing, places_in_time, timed_camera
from psvideo.model.units import counted
from psvideo.strobe.bursts import POWER_TOLERANCE
from psvideo.strobe.link.boards import BOARDS
from psvideo.strobe.program import PS_PER_S

SAME_S = max(board.tick_ps for board in BOARDS.values()) / PS_PER_S
"""Times that differ by no more than a board's longest tick are the same: what was asked for, and what was played."""


def refuse_other_strobe(first: tuple[Plan, Timing], other: tuple[Plan, Timing]) -> None:
    """Raise PsvideoError where a plan's strobe is not the first one's."""
    difference = _first_difference(first[0], other[0])
    if difference:
        raise PsvideoError(
            f"{other[1].clip}: its plan's strobe is not {first[1].clip}'s: expected {difference}, as one strobe played "
            "both. Put the plan that was played beside every clip, with each camera's own [camera] table and dark_s "
            "written out."
        )


def refuse_unnumbered(plan: Plan, timing: Timing, numbers: Sequence[int] | None = None) -> None:
    """Raise PsvideoError where the numbers of a clip's flashes are a guess, or do not follow one another.

    ``numbers`` are those of all the clip's frames, ascending, by which it says where; left out, their places in time.
    """
    if timing.order == "guess":
        raise PsvideoError(
            f"{timing.clip}: which flash is which is a guess, so nothing says which flashes two cameras share. "
            f"{why_guessed(timing.flashes)} Plan with a coded marker (`marker` coded)."
        )
    slots = [flash.slot for flash in timing.flashes]
    last = first_break(plan, slots)
    if last is not None:
        first = min(last, bisect_left(range(len(slots)), 1, key=lambda n: len(cycle_places(plan, slots[n:])) > 0))
        before, after = _frames_around(plan, timing, first - 1, last, numbers)
        raise PsvideoError(
            f"{timing.clip}: its strobe started again, or skipped flashes, between frames {before} and {after}: "
            "the flashes do not follow one another there as in the strobe's cycle, so which ones two cameras share "
            "is not known across it. Put the frames before, or those after, into a folder of their own with the plan "
            "beside them, and name that folder."
        )


def _frames_around(
    plan: Plan, timing: Timing, before: int, after: int, numbers: Sequence[int] | None
) -> tuple[int, int]:
    """Return the numbers of the last frame that saw a flash ``before`` a break, and of the first that saw one
    ``after`` it; flashes beside the break that are not complete may not have fired."""
    whole = [flash.index for flash in timing.flashes if flash.complete]
    before = max((n for n in whole if n <= before), default=before)
    after = min((n for n in whole if n >= after), default=after)
    first, last = frames_touched(timed_camera(plan, timing), timing.start_s, timing.duration_s)
    seen = {n: n for n in range(int(last.max()) + 1)} if numbers is None else places_in_time(timing, numbers)
    early = [number for number, place in seen.items() if place <= last[before]]
    late = [number for number, place in seen.items() if place >= first[after]]
    return max(early, default=min(seen)), min(late, default=max(seen))


def _first_difference(one: Plan, other: Plan) -> str:
    """Return what of the first plan's strobe another plan has otherwise, and what was found in that; else ''."""
    if len(one.flashes) != len(other.flashes):
        return f"a round of {counted(len(one.flashes), 'flash')}, found {len(other.flashes)}"
    for number, (first, found) in enumerate(zip(one.flashes, other.flashes, strict=True), 1):
        if not _same_lights(first, found):
            return f"{_lit_words(first)} in flash {number} of the round, found {_lit_words(found)}"
        if not _same_s(first.duration_s, found.duration_s):
            return f"{first.duration_s * 1e3:.6g} ms of flash {number}, found {found.duration_s * 1e3:.6g} ms"
    if not _same_s(one.dark_s, other.dark_s):
        return f"a dark time of {one.dark_s * 1e3:.6g} ms, found {other.dark_s * 1e3:.6g} ms"
    rest = replace(other, camera=one.camera, clock_tolerance_ppm=one.clock_tolerance_ppm)
    if replace(rest, flashes=one.flashes, dark_s=one.dark_s) != one:
        return "the same mode, dark slots, and rise and fall times"
    return ""


def _same_s(one_s: float, other_s: float) -> bool:
    return abs(one_s - other_s) < SAME_S * (1 + 1e-6)


def _same_lights(one: PlannedFlash, other: PlannedFlash) -> bool:
    """Return whether two flashes light the same lamps with powers of which one was played for the other."""
    pairs = [(one.lights.get(name, 0.0), other.lights.get(name, 0.0)) for name in {*one.lights, *other.lights}]
    return all(abs(a - b) <= POWER_TOLERANCE * min(a, b) / (1 - POWER_TOLERANCE) for a, b in pairs)


def _lit_words(flash: PlannedFlash) -> str:
    lit: Sequence[str] = [light if power == 1 else f"{light} at {power:g}" for light, power in flash.lights.items()]
    return " + ".join(lit) or "dark"
