"""A run from the first word to the last: prepare the board, upload, arm, run, watch, and always stop.

Link -> prepare -> Ready (its capabilities make the Program) -> run_program -> Outcome, with Beats on the way
"""

import contextlib
import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from typing import Literal

from psvideo.errors import PsvideoError
from psvideo.model.plan import Plan
from psvideo.strobe.clock import ClockFit, ClockQuery, fit_clock
from psvideo.strobe.link.exchange import Link, RefusedError
from psvideo.strobe.link.greeting import START_WITHIN_S, greet
from psvideo.strobe.link.replies import Capabilities, Cleared, Identity, Started, Status, Stopped, WiringSet
from psvideo.strobe.link.requests import Caps, Clear, Run, Stat, Stop, Wiring
from psvideo.strobe.link.words import WiringName
from psvideo.strobe.program import Program

Ended = Literal["done", "stopped", "fault", "refused", "lost"]
ASK_EVERY_S = 0.2
"""How often the host asks for status and clock while lights run: several times within any keep-alive."""
FAULTS: Mapping[str, str] = {
    "silent": "it heard nothing from the host for the keep-alive time",
    "interlock": "its interlock was opened",
    "late": "it could not make an edge in time",
    "watchdog": "its watchdog restarted it",
}


@dataclass(frozen=True, kw_only=True)
class Ready:
    """A board that is known and dark. ``notes`` say what was found and put right."""

    identity: Identity
    caps: Capabilities
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class RunProgress:
    """How a run goes: seconds since it began, whole cycles played, flashes a second that light something, and how many
    seconds are left; None for a run until it is stopped."""

    elapsed_s: float
    cycles: int
    flash_rate_hz: float
    left_s: float | None


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What was played. ``fault`` says what ended a run that did not end well, and ``message`` explains it to people."""

    started_utc: str
    stopped_utc: str
    start_tick: int
    cycles: int
    ended: Ended
    fault: str | None
    message: str | None
    clock: ClockFit | None


def prepare(link: Link, *, wiring: WiringName | None = None, within_s: float = START_WITHIN_S) -> Ready:
    """Greet the board, make it dark and idle, clear what was latched, and set its wiring."""
    identity = greet(link, within_s=within_s)
    link.ask(Stop(), Stopped)
    notes = tuple(_clear(link))
    caps = link.ask(Caps(), Capabilities)
    if wiring is not None and wiring != caps.wiring:
        link.ask(Wiring(wiring=wiring), WiringSet)
        caps = link.ask(Caps(), Capabilities)
    return Ready(identity=identity, caps=caps, notes=notes)


def _clear(link: Link) -> list[str]:
    status = link.ask(Stat(), Status)
    if status.interlock == "open":
        raise PsvideoError(
            f"{link.port.name}: the interlock is open, so the board lights nothing. Close the door or the switch "
            "that it watches (or repair its wire), then run the command again."
        )
    if status.state != "fault":
        return []
    link.ask(Clear(), Cleared)
    return [f"the board was dark because of a fault, {status.fault}: {FAULTS[status.fault]}. It is cleared now."]


def cycles_for(plan: Plan, *, seconds: float | None, rounds: int | None) -> int | None:
    """Return how many whole cycles hold this many seconds, or rounds; None for a run until it is stopped."""
    if rounds is not None:
        return math.ceil(rounds / len(plan.dark_rounds))
    if seconds is not None:
        return max(1, math.ceil(seconds / plan.cycle_s))
    return None


def run_program(
    link: Link,
    program: Program,
    *,
    cycles: int | None,
    seconds: float | None,
    watch: Callable[[RunProgress], None],
    every_s: float = ASK_EVERY_S,
    stopped: Callable[[], bool] = lambda: False,
) -> Outcome:
    """Upload a program and play it for ``cycles`` cycles (None: until stopped), at most for ``seconds``.

    ``watch`` is called about every ``every_s``, and may ask the board itself; then ``stopped`` says whether to end.
    In every case the board is stopped. Ctrl-C ends a run well. Raises PsvideoError where nothing was played;
    what goes wrong after the first flash stands in the outcome, so that it can be logged.
    """
    record = _Record()
    try:
        for request in program.upload():
            link.ask(request, request.reply)
        record.start_tick = link.ask(Run(cycles=cycles or 0), Started).start
        record.began_s = time.monotonic()
        record.fault = _follow(
            link,
            record,
            program.played,
            cycles=cycles,
            seconds=seconds,
            watch=watch,
            every_s=every_s,
            stopped=stopped,
        )
        if record.fault is not None:
            record.ended, record.message = "fault", _went_dark(link.port.name, record)
    except KeyboardInterrupt:
        if record.began_s is None:
            raise
        record.ended = "stopped"
    except PsvideoError as fault:
        if record.began_s is None:
            raise
        record.ended, record.fault = _broken_off(fault)
        record.message = str(fault)
    finally:
        with contextlib.suppress(PsvideoError):
            record.cycles = max(record.cycles, link.ask(Stop(), Stopped).cycles)
    return _outcome(record, program)


@dataclass(kw_only=True)
class _Record:
    """What is gathered while a run goes on."""

    began_utc: datetime = field(default_factory=lambda: datetime.now(UTC))
    made_s: float = field(default_factory=time.monotonic)
    began_s: float | None = None
    start_tick: int = 0
    cycles: int = 0
    readings: list[ClockQuery] = field(default_factory=list)
    ended: Ended = "done"
    fault: str | None = None
    message: str | None = None

    def utc(self, host_s: float) -> str:
        """Return a moment of the host's clock as people write it."""
        return (self.began_utc + timedelta(seconds=host_s - self.made_s)).isoformat(timespec="milliseconds")


def _follow(
    link: Link,
    record: _Record,
    played: Plan,
    *,
    cycles: int | None,
    seconds: float | None,
    watch: Callable[[RunProgress], None],
    every_s: float,
    stopped: Callable[[], bool],
) -> str | None:
    """Ask for clock and status again and again until the run is over; return what fault ended it, if one did."""
    lasts_s = cycles * played.cycle_s if seconds is None and cycles is not None else seconds
    rate_hz = sum(not played.flashes[slot].is_dark for slot in played.cycle_slots) / played.cycle_s
    began_s = time.monotonic()
    while True:
        clock, asked_s, answered_s = link.read_clock()
        status = link.ask(Stat(), Status)
        if status.state == "fault":
            return f"{status.fault}: {FAULTS[status.fault]}"
        if status.state == "idle" and (cycles is None or status.cycles < cycles):
            return f"restarted: the board started again in the middle of the run (reset: {status.reset})"
        record.readings.append(ClockQuery(ticks=clock.ticks, asked_s=asked_s, answered_s=answered_s))
        record.cycles = status.cycles
        elapsed_s = time.monotonic() - began_s
        left_s = None if lasts_s is None else max(lasts_s - elapsed_s, 0.0)
        watch(RunProgress(elapsed_s=elapsed_s, cycles=status.cycles, flash_rate_hz=rate_hz, left_s=left_s))
        if status.state == "idle" or stopped() or (seconds is not None and elapsed_s >= seconds):
            return None
        pause_s = every_s if seconds is None else min(every_s, seconds - elapsed_s)
        time.sleep(max(pause_s, 0.0))


def _went_dark(name: str, record: _Record) -> str:
    return (
        f"{name}: the board went dark by itself in the middle of the run ({record.fault}), after {record.cycles} whole "
        "cycles. Find the cause, then run the command again, which clears the fault."
    )


def _broken_off(fault: PsvideoError) -> tuple[Ended, str]:
    """Return how a run ended that the host broke off, and why, for its log."""
    if isinstance(fault, RefusedError):
        return "refused", f"the board refused a request (E {int(fault.code)})"
    return "lost", "the connection to the board broke"


def _outcome(record: _Record, program: Program) -> Outcome:
    clock = fit_clock(record.readings, tick_ps=program.tick_ps)
    first_s = clock.host_s(record.start_tick) if clock else record.began_s or record.made_s
    return Outcome(
        started_utc=record.utc(first_s),
        stopped_utc=record.utc(time.monotonic()),
        start_tick=record.start_tick,
        cycles=record.cycles,
        ended=record.ended,
        fault=record.fault,
        message=record.message,
        clock=clock,
    )
