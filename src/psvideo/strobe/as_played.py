"""A plan with what its log knows better: the times and powers that a board played."""

from dataclasses import dataclass, replace
from pathlib import Path

from psvideo.model.plan import UNKNOWN_CLOCK_PPM, Plan, PlannedFlash
from psvideo.strobe.bursts import POWER_TOLERANCE
from psvideo.strobe.limits import cycle_check, cycle_ticks
from psvideo.strobe.link.requests import Lit, Slot
from psvideo.strobe.program import PS_PER_S, to_ticks
from psvideo.strobe.runlog import LOG_NAME, PlayedFlash, RunLog, plan_sha256, read_log

CAMERA_CLOCK_PPM = 100.0
"""How far a camera's clock, a crystal, may be off."""


@dataclass(frozen=True, kw_only=True)
class AsPlayed:
    """A plan with what its log knows better. ``warning`` says that the log is another plan's, or that the run broke."""

    plan: Plan
    warning: str | None = None
    note: str | None = None


def as_played(plan: Plan, plan_path: Path) -> AsPlayed:
    """Return a plan with the times and powers that the log beside it says were played, where there is a log."""
    path = plan_path.with_name(LOG_NAME)
    if plan.mode == "synced" or not path.is_file():
        return AsPlayed(plan=plan)
    log = read_log(path)
    if not _fits(plan, log) or not _plays(plan, log):
        return AsPlayed(plan=plan, warning=_why_unused(log, path, plan_path))
    broke = f"the strobe's run broke off ({log.fault}), says {path.name}" if log.fault is not None else None
    return AsPlayed(
        plan=_played(plan, log),
        warning=broke,
        note=f"{path.name}: times as {log.board} played them, {_clock_words(log)}",
    )


def _why_unused(log: RunLog, path: Path, plan_path: Path) -> str:
    if log.plan_sha256 == plan_sha256(plan_path):
        return (
            f"{path.name} names the checksum of {plan_path.name}, but its ticks or its check are not what that plan "
            "gives, so it was changed, and is not used; put the log beside the footage as it was written, or take it "
            "away"
        )
    return (
        f"{path.name} is the log of another plan than {plan_path.name} beside it, and is not used; put the plan that "
        "the strobe played beside the footage, or take the log away"
    )


def _fits(plan: Plan, log: RunLog) -> bool:
    return [set(flash.lit) for flash in plan.flashes] == [set(flash.lit_ticks) for flash in log.flashes]


def _plays(plan: Plan, log: RunLog) -> bool:
    """Return whether a plan asks for the very ticks of a log: what it says of the camera may have been put right."""
    if to_ticks(plan.dark_s, log.tick_ps) != log.dark_ticks:
        return False
    for planned, played in zip(plan.flashes, log.flashes, strict=True):
        if to_ticks(planned.duration_s, log.tick_ps) != played.duration_ticks:
            return False
        for name, ticks in played.lit_ticks.items():
            asked = planned.lights[name]
            if abs(ticks / played.duration_ticks - asked) > POWER_TOLERANCE * asked:
                return False
    slots = [_slot_of(flash, log) for flash in log.flashes]
    cycle = [slots[slot] for slot in plan.cycle_slots]
    return (cycle_check(cycle), cycle_ticks(cycle)) == (log.check, log.cycle_ticks)


def _slot_of(flash: PlayedFlash, log: RunLog) -> Slot:
    """Return what was sent for a flash: no burst is ever cut short, and at full power there are none."""
    bursts = -(-flash.duration_ticks // flash.period_ticks)
    pairs = sorted(
        {
            (log.lines[name], flash.period_ticks if ticks == flash.duration_ticks else ticks // bursts)
            for name, ticks in flash.lit_ticks.items()
        }
    )
    lit = tuple(Lit(line=line, on=on) for line, on in pairs)
    return Slot(slot=0, duration=flash.duration_ticks, dark=log.dark_ticks, period=flash.period_ticks, lit=lit)


def _played(plan: Plan, log: RunLog) -> Plan:
    tick_s = log.tick_ps / PS_PER_S
    flashes = tuple(
        PlannedFlash(
            lights={name: flash.lit_ticks.get(name, 0) / flash.duration_ticks for name in planned.lights},
            duration_s=flash.duration_ticks * tick_s,
        )
        for planned, flash in zip(plan.flashes, log.flashes, strict=True)
    )
    tolerance = None if plan.clock_tolerance_ppm is None else clock_range_ppm(plan, log)
    return replace(plan, flashes=flashes, dark_s=log.dark_ticks * tick_s, clock_tolerance_ppm=tolerance)


def clock_range_ppm(plan: Plan, log: RunLog) -> float:
    """Return how far the strobe's clock may be from the camera's: what the board is rated for and what the plan says,
    and by how much its steps were trimmed.

    What was measured against the host does not narrow it: the host's clock is not the camera's.
    """
    untrimmed_ppm = max(log.tolerance_ppm + CAMERA_CLOCK_PPM, plan.clock_range_ppm)
    return min(untrimmed_ppm + log.most_trim_ppm, UNKNOWN_CLOCK_PPM)


def _clock_words(log: RunLog) -> str:
    if log.clock is None:
        return f"its clock within {log.tolerance_ppm:g} ppm"
    return f"its clock measured at {log.clock.offset_ppm:+.0f} ± {log.clock.error_ppm:.0f} ppm"
