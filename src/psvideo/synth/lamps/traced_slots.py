"""Which light hangs on which line of a trace, and which flash of the plan its pulses belong to.

A trace says when lights were on and nothing else. A flash is what lies closer together than half the plan's dark time;
its slot follows from counting, and the lights that are lit must be those of the plan.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from psvideo.errors import PsvideoError, UsageError, nearest
from psvideo.formats.trace_csv import Trace
from psvideo.model.plan import Plan

Pulse = tuple[int, int, int]
"""On cycle, off cycle, line."""
TIME_TOLERANCE = 0.01
"""Traces and plans agree when times do within this share: boards count ticks, and their clocks run a little off."""


Wired = Mapping[int, tuple[str, ...]]
"""Which lights hang on which line: one, but where several that flash together share it."""


def wired_lines(plan: Plan, given: Mapping[str, int]) -> Wired:
    """Return which lights hang on which line: the plan's order, but for those that are given."""
    for name in given:
        if name not in plan.lights:
            raise UsageError(f"`line` {name}={given[name]}: the plan has no such light; {nearest(name, plan.lights)}")
    free = iter(n for n in range(len(plan.lights) + max(given.values(), default=0) + 1) if n not in given.values())
    wired: dict[int, tuple[str, ...]] = {}
    for name in plan.lights:
        line = given[name] if name in given else next(free)
        wired[line] = (*wired.get(line, ()), name)
    return wired


def check_lines(path: Path, trace: Trace, wired: Wired) -> None:
    """Raise PsvideoError where a line is lit on which no light hangs."""
    unknown = [line for line in trace.lights if line not in wired]
    if unknown:
        shown = ", ".join(f"{' and '.join(names)} on line {line}" for line, names in sorted(wired.items()))
        raise PsvideoError(
            f"{path}: line {unknown[0]} is lit, and no light of the plan is wired to it ({shown}). Name the lines with "
            "`line` NAME=NUMBER, or take the trace of this plan."
        )


def flash_pulses(
    path: Path, plan: Plan, trace: Trace, wired: Wired, pulses: Sequence[Pulse]
) -> Iterator[tuple[int, list[Pulse]]]:
    """Yield each flash's slot and pulses. A pause longer than any within a cycle begins a new run at the cycle's start.

    Raises PsvideoError where a flash lights others than the plan's, comes at another time after the one before it, or
    lasts longer.
    """
    lit = [slot for slot in plan.cycle_slots if not plan.flashes[slot].is_dark]
    pauses_s = _pauses_s(plan)
    place = 0
    before_s: float | None = None
    for number, group in enumerate(_groups(pulses, 0.5 * plan.dark_s * trace.hz), start=1):
        begin_s, names = group[0][0] / trace.hz, {name for _, _, line in group for name in wired[line]}
        pause_s = None if before_s is None else begin_s - before_s
        if pause_s is not None and _is_later(pause_s, max(pauses_s)) and not _other_lights(plan, lit[0], names):
            place, pause_s = 0, None
        slot, length_s = lit[place], max(off for _, off, _ in group) / trace.hz - begin_s
        fault = (
            _other_pause(pause_s, pauses_s[place])
            or _other_lights(plan, slot, names)
            or _longer(length_s, plan.flashes[slot].duration_s)
        )
        if fault:
            raise PsvideoError(
                f"{path}: flash {number} of the trace {fault}. Take the trace of this plan, or name the lines with "
                "`line` NAME=NUMBER."
            )
        yield slot, group
        place, before_s = (place + 1) % len(lit), begin_s


def _pauses_s(plan: Plan) -> list[float]:
    """Return for each lit flash of the cycle how long before it the one before it starts."""
    train = plan.train(0, len(plan.cycle_slots))
    lit = [not plan.flashes[slot].is_dark for slot in train.slot]
    starts_s = train.start_s[lit]
    return [float(pause_s) for pause_s in np.diff(starts_s, prepend=starts_s[-1] - plan.cycle_s)]


def _is_later(found_s: float, wanted_s: float) -> bool:
    return found_s > (1 + TIME_TOLERANCE) * wanted_s


def _other_lights(plan: Plan, slot: int, names: set[str]) -> str | None:
    meant = set(plan.flashes[slot].lit)
    if names == meant:
        return None
    return f"lights {' and '.join(sorted(names))}, where the plan's round lights {' and '.join(sorted(meant))}"


def _other_pause(found_s: float | None, wanted_s: float) -> str | None:
    if found_s is None or abs(found_s - wanted_s) <= TIME_TOLERANCE * wanted_s:
        return None
    return f"starts {found_s * 1e3:.5g} ms after the one before, where the plan has {wanted_s * 1e3:.5g} ms"


def _longer(found_s: float, wanted_s: float) -> str | None:
    if not _is_later(found_s, wanted_s):
        return None
    return f"lasts {found_s * 1e3:.5g} ms, where the plan has {wanted_s * 1e3:.5g} ms"


def _groups(pulses: Sequence[Pulse], gap: float) -> Iterator[list[Pulse]]:
    group: list[Pulse] = []
    end = 0
    for pulse in pulses:
        if group and pulse[0] - end > gap:
            yield group
            group = []
        group.append(pulse)
        end = max(end, pulse[1])
    yield group
