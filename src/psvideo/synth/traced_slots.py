"""Which light hangs on which line of a trace, and which flash of the plan its pulses belong to.

A trace says when lights were on and nothing else. A flash is what lies closer together than half the plan's dark time;
its slot follows from counting, and the lights that are lit must be those of the plan.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from psvideo.errors import PsvideoError, UsageError, nearest
from psvideo.plan import Plan
from psvideo.tracefile import Trace

Pulse = tuple[int, int, int]
"""On cycle, off cycle, line."""


def wired_lines(plan: Plan, given: Mapping[str, int]) -> dict[int, str]:
    """Return which light hangs on which line: the plan's order, but for those that are given."""
    for name in given:
        if name not in plan.lights:
            raise UsageError(f"--line {name}={given[name]}: the plan has no such light; {nearest(name, plan.lights)}")
    free = iter(n for n in range(len(plan.lights) + max(given.values(), default=0) + 1) if n not in given.values())
    wired = {given[name] if name in given else next(free): name for name in plan.lights}
    if len(wired) < len(plan.lights):
        raise UsageError("--line: two lights have the same line. Give every light a line of its own.")
    return wired


def check_lines(path: Path, trace: Trace, wired: Mapping[int, str]) -> None:
    """Raise PsvideoError where a line is lit on which no light hangs."""
    unknown = [line for line in trace.lights if line not in wired]
    if unknown:
        shown = ", ".join(f"{name} on line {line}" for line, name in sorted(wired.items()))
        raise PsvideoError(
            f"{path}: line {unknown[0]} is lit, and no light of the plan hangs on it ({shown}). Name the lines with "
            "--line NAME=NUMBER, or take the trace of this plan."
        )


def flash_pulses(
    path: Path, plan: Plan, trace: Trace, wired: Mapping[int, str], pulses: Sequence[Pulse]
) -> Iterator[tuple[int, list[Pulse]]]:
    """Yield each flash's slot and pulses. A pause longer than any within a cycle begins a new run at its start."""
    lit = [slot for slot in plan.cycle_slots if not plan.flashes[slot].is_dark]
    new_flash = 0.5 * plan.dark_s * trace.hz
    new_run = (plan.cycle_s + plan.dark_s) * trace.hz
    count, end = 0, None
    for number, group in enumerate(_groups(pulses, new_flash), start=1):
        count = 0 if end is not None and group[0][0] - end > new_run else count
        slot = lit[count % len(lit)]
        names = {wired[line] for _, _, line in group}
        meant = {name for name, power in plan.flashes[slot].lights.items() if power > 0}
        if names != meant:
            raise PsvideoError(
                f"{path}: flash {number} of the trace lights {' and '.join(sorted(names))}, where the plan's round "
                f"lights {' and '.join(sorted(meant))}. Take the trace of this plan, or name the lines with "
                "--line NAME=NUMBER."
            )
        yield slot, group
        count, end = count + 1, max(off for _, off, _ in group)


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
