"""strobe.json: what a board played, kept beside the footage for ``sync`` to start from.

Its schema is ``psvideo-strobe/1``; docs/formats.md says what its keys mean.
"""

import hashlib
import json
from pathlib import Path
from typing import Annotated, Self

from pydantic import Field, model_validator

from psvideo.formats.contract import Contract, parse_record, read_json
from psvideo.strobe.clock import ClockFit
from psvideo.strobe.limits import CHECKED_LINES, LONGEST_DARK_TICKS, lit_ticks
from psvideo.strobe.link.words import WiringName
from psvideo.strobe.program import PS_PER_S, Program
from psvideo.strobe.session import Ended, Outcome, Ready

SCHEMA = "psvideo-strobe/1"
ADVICE = "Take it away, or write it again."
LOG_NAME = "strobe.json"
MOST_TICKS = 2**32 - 1
"""Boards count a flash's ticks in 32 bits."""


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
