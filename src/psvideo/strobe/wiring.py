"""Which of a board's lines each light hangs on: as the user says, the others in the plan's order on what is left."""

from collections.abc import Mapping

from psvideo.errors import PsvideoError, UsageError, nearest
from psvideo.model.plan import Plan
from psvideo.strobe.link.replies import Capabilities


def wire(plan: Plan, caps: Capabilities, given: Mapping[str, int]) -> dict[str, int]:
    """Return the line of every light of the plan. Raises UsageError where the wiring given cannot be."""
    refuse_unknown_lights(plan, given)
    for name, line in given.items():
        if not 0 <= line < caps.lines:
            raise UsageError(
                f"`line` {name}={line}: this board has {caps.lines} lines with {caps.wiring} wiring, numbered 0 to "
                f"{caps.lines - 1}."
            )
        twin = next((other for other, taken in given.items() if taken == line and other != name), None)
        if twin is not None and plan.powers(twin) != plan.powers(name):
            raise UsageError(
                f"`line` {name}={line}: {twin} has line {line} already, and the two do not flash together at one power "
                "in every flash. Give each its own line."
            )
    free = [line for line in range(caps.lines) if line not in given.values()]
    others = [name for name in plan.lights if name not in given]
    if len(others) > len(free):
        raise PsvideoError(
            f"The plan has {len(plan.lights)} lights and this board has {caps.lines} lines with {caps.wiring} wiring. "
            f"{_how_with_fewer(plan, caps)}Take another wiring or board, or plan fewer lights."
        )
    rest = dict(zip(others, free, strict=False))
    return {name: given[name] if name in given else rest[name] for name in plan.lights}


def refuse_unknown_lights(plan: Plan, given: Mapping[str, int]) -> None:
    """Raise UsageError where a wiring names a light that the plan has not, whatever the board."""
    for name, line in given.items():
        if name not in plan.lights:
            raise UsageError(f"`line` {name}={line}: the plan has no such light: {nearest(name, plan.lights)}")


def _how_with_fewer(plan: Plan, caps: Capabilities) -> str:
    """Return how lights that always flash together share lines, where that is enough; else nothing."""
    together: dict[tuple[float, ...], list[str]] = {}
    for name in plan.lights:
        together.setdefault(plan.powers(name), []).append(name)
    if not len(together) <= caps.lines < len(plan.lights):
        return ""
    words = ", ".join(f"`line` {','.join(names)}={line}" for line, names in enumerate(together.values()))
    return (
        f"Lights that always flash together, at one power, can share one line, each with a driver of its own: wire "
        f"{len(together)} lines, and say {words}. "
    )
