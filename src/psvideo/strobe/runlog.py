"""strobe.json: what a board played, kept beside the footage for ``sync`` to start from.

Its schema is ``psvideo-strobe/1``; docs/formats.md says what its keys mean.
"""

import hashlib
import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Self

from pydantic import Field, model_validator

from psvideo.formats.contract import Contract, parse_record, read_json
from psvideo.model.plan import UNKNOWN_CLOCK_PPM, Plan, PlannedFlash
from psvideo.strobe.bursts import POWER_TOLERANCE
from psvideo.strobe.clock import ClockFit
from psvideo.strobe.limits import CHECKED_LINES, LONGEST_DARK_TICKS, cycle_check, cycle_ticks, lit_ticks
from psvideo.strobe.link.requests import Lit, Slot
from psvideo.strobe.link.words import WiringName
from psvideo.strobe.program import PS_PER_S, Program, to_ticks
from psvideo.strobe.session import Ended, Outcome, Ready

SCHEMA = "psvideo-strobe/1"
ADVICE = "Take it away, or write it again."
LOG_NAME = "strobe.json"
MOST_TICKS = 2**32 - 1
"""Boards count a flash's ticks in 32 bits."""
CAMERA_CLOCK_PPM = 100.0
"""How far a camera's clock, a crystal, may be off."""


class PlayedFlash(Contract):
    """A flash of the plan's round as it was played: ``lit_ticks`` is how long each light was on, bursts summed."""

    duration_ticks: int = Field(gt=0, le=MOST_TICKS)
    period_ticks: int = Field(gt=0, le=MOST_TICKS)
    lit_ticks: dict[str, Annotated[int, Field(gt=0)]]

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        if self.period_ticks > self.duration_ticks:
            raise ValueError(f"period_ticks is {self.period_ticks}; expected at most duration_ticks")
        for name, ticks in self.lit_ticks.items():
            if ticks > self.duration_ticks:
                raise ValueError(f"lit_ticks.{name} is {ticks}; expected at most duration_ticks, {self.duration_ticks}")
        return self


class Clock(Contract):
    """The board's clock on the host's: a strobe second lasts ``1 + offset_ppm * 1e-6`` host seconds."""

    offset_ppm: float
    error_ppm: float = Field(ge=0)
    readings: int = Field(ge=0)


class RunLog(Contract):
    """What strobe.json holds."""

    schema_: str = Field(alias="schema", default=SCHEMA)
    plan: str
    plan_sha256: str
    board: str
    unit: str
    firmware: str
    wiring: WiringName
    lines: dict[str, Annotated[int, Field(ge=0, lt=CHECKED_LINES)]]
    tick_ps: int = Field(gt=0, le=PS_PER_S)
    tolerance_ppm: float = Field(ge=0)
    flashes: list[PlayedFlash] = Field(min_length=1)
    dark_ticks: int = Field(ge=0, le=LONGEST_DARK_TICKS)
    cycle_ticks: int = Field(gt=0)
    check: int = Field(ge=0, lt=2**16)
    started_utc: str
    stopped_utc: str
    start_tick: int
    cycles: int = Field(ge=0)
    ended: Ended
    fault: str | None = None
    clock: Clock | None = None
    most_trim_ppm: float = Field(ge=0, default=0.0)

    @model_validator(mode="after")
    def _wires_every_light(self) -> Self:
        lit = {name for flash in self.flashes for name in flash.lit_ticks}
        if lit - self.lines.keys():
            raise ValueError(
                f"lines has no {', '.join(sorted(lit - self.lines.keys()))}; expected every light that flashes"
            )
        return self


def run_log(plan_path: Path, ready: Ready, program: Program, outcome: Outcome, *, most_trim_ppm: float = 0.0) -> RunLog:
    """Return the log of a run; ``most_trim_ppm`` is by how much its steps were made longer or shorter at most."""
    flashes = [
        PlayedFlash(
            duration_ticks=slot.duration,
            period_ticks=slot.period,
            lit_ticks={name: lit_ticks(slot, program.lines[name]) for name in flash.lit},
        )
        for flash, slot in zip(program.played.flashes, (program.slots[n] for n in program.of_flash), strict=True)
    ]
    return RunLog(
        plan=plan_path.name,
        plan_sha256=plan_sha256(plan_path),
        board=ready.identity.board,
        unit=ready.identity.unit,
        firmware=ready.identity.firmware,
        wiring=ready.caps.wiring,
        lines=dict(program.lines),
        tick_ps=program.tick_ps,
        tolerance_ppm=ready.caps.tolerance_ppm,
        flashes=flashes,
        dark_ticks=program.slots[0].dark,
        cycle_ticks=program.cycle_ticks,
        check=program.check,
        started_utc=outcome.started_utc,
        stopped_utc=outcome.stopped_utc,
        start_tick=outcome.start_tick,
        cycles=outcome.cycles,
        ended=outcome.ended,
        fault=outcome.fault,
        clock=_clock(outcome.clock),
        most_trim_ppm=most_trim_ppm,
    )


def _clock(fit: ClockFit | None) -> Clock | None:
    if fit is None:
        return None
    return Clock(offset_ppm=fit.offset_ppm, error_ppm=fit.gain_error_ppm, readings=fit.readings)


def plan_sha256(path: Path) -> str:
    """Return the checksum by which a plan is known; line ends do not count, which some systems change in copying."""
    return hashlib.sha256(path.read_bytes().replace(b"\r\n", b"\n")).hexdigest()


def log_record(log: RunLog) -> dict[str, object]:
    """Return the log as what strobe.json holds; a strobe that nobody trimmed has no word on trims."""
    return log.model_dump(by_alias=True, exclude=None if log.most_trim_ppm else {"most_trim_ppm"})


def format_log(log: RunLog) -> str:
    """Return the log as JSON text; reading it back gives an equal log."""
    return json.dumps(log_record(log), indent=1) + "\n"


def read_log(path: Path) -> RunLog:
    """Read strobe.json. Raises PsvideoError that names the file, the key and what was expected."""
    return parse_record(read_json(path, advice=ADVICE), RunLog, SCHEMA, source=str(path), advice=ADVICE)


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
