"""The light by which a user names a clip's first complete lit flash: one, or several that flash together (``a+b``)."""

from collections.abc import Iterable

from psvideo.errors import UsageError
from psvideo.model.plan import HasLights, Plan

TOGETHER = "+"
"""Joins the names of lights that flash together."""


def check_first_light(plan: Plan, first_light: str | None) -> None:
    """Raise UsageError where ``first_light`` names no flash of the plan; None is no name."""
    if first_light is None or any(is_called(flash, first_light) for flash in plan.flashes):
        return
    names = dict.fromkeys(TOGETHER.join(flash.lit) for flash in plan.flashes if not flash.is_dark)
    raise UsageError(
        f"`first_light` {first_light}: there is no such flash in the plan; its flashes are {', '.join(names)}."
    )


def is_called(flash: HasLights, first_light: str) -> bool:
    """Return whether these are the lights, in any order, of a flash.

    >>> from psvideo.model.plan import PlannedFlash
    >>> is_called(PlannedFlash(lights={"red": 1.0, "blue": 0.5}, duration_s=1e-3), "blue+red")
    True
    """
    return not flash.is_dark and set(first_light.split(TOGETHER)) == set(flash.lit)


def first_lit(flashes: Iterable[HasLights]) -> HasLights | None:
    """Return the first flash in which any light is on, None where there is none."""
    return next((flash for flash in flashes if not flash.is_dark), None)
