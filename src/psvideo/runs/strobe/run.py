"""The whole of ``psvideo strobe run``: a plan in, light that flashes, and a log of what was played."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from psvideo.errors import PsvideoError, UsageError
from psvideo.formats.plan_toml import read_plan
from psvideo.formats.whole_files import refuse_existing, write_text
from psvideo.model.plan import Plan
from psvideo.runs.steps.caller import PYTHON, Caller
from psvideo.runs.strobe.port import opened_port
from psvideo.strobe import confirmed
from psvideo.strobe.link.boards import board_called
from psvideo.strobe.link.exchange import Link
from psvideo.strobe.link.ports import AUTO, EMULATED
from psvideo.strobe.link.words import WiringName
from psvideo.strobe.program import Program, make_program
from psvideo.strobe.program_words import describe_program, program_cautions
from psvideo.strobe.runlog import RunLog, format_log, plan_sha256, run_log
from psvideo.strobe.seizures import seizure_warning
from psvideo.strobe.session import Outcome, Ready, RunProgress, cycles_for, prepare, run_program

LOG_MARK = "psvideo-strobe/"
"""By which a file is known for a log, which may be replaced."""


@dataclass(frozen=True, kw_only=True)
class StrobeRun:
    """What was played, how it ended, its log, and whole sentences on what to beware of."""

    program: Program
    outcome: Outcome
    log: RunLog
    warnings: tuple[str, ...]


def unseen(beat: RunProgress) -> None:
    """Show nothing of how a run goes."""


def run(
    plan: Path | str,
    *,
    port: str = AUTO,
    board: str | None = None,
    seconds: float | None = None,
    rounds: int | None = None,
    line: Mapping[str, int] | None = None,
    wiring: WiringName | None = None,
    log: Path | str | None = None,
    yes: bool = False,
    force: bool = False,
    confirm: Callable[[str], bool] | None = None,
    watch: Callable[[RunProgress], None] = unseen,
    caller: Caller = PYTHON,
) -> StrobeRun:
    """Play a plan until it is stopped (Ctrl-C), or for a time; in every case the lights are dark afterwards.

    ``plan`` is a plan.toml. ``port`` is "auto" (by USB identity), a serial port, a pseudo-terminal,
    ``socket://host:port``, or "emulated", then of the kind ``board``. The run stops after this many ``seconds``, or
    ``rounds``, rounded up to whole cycles. ``line`` wires lights to lines by name; lights that it leaves out take the
    free lines in the plan's order. ``wiring`` is "gated" or "direct", left out: the board's own. ``log`` is the
    strobe.json to write; ``force`` replaces one.

    Light that flashes slowly can cause seizures. Before the first flash of such a plan ``confirm`` is asked, with the
    warning, whether everybody in the room has been warned, once for each plan; ``yes`` says that they have.

    ``watch`` is called with how the run goes several times a second, ``caller`` gets the sentences on the way.

    Returns
    -------
    StrobeRun
        Where the run broke off after the first flash, ``outcome.message`` says why.

    Raises
    ------
    UsageError
        Where parameters do not fit together, ``log`` exists, or nobody confirmed and nobody can be asked.
    PsvideoError
        Where nothing flashed: the board cannot play the plan, or does not answer, or the answer was no.
    """
    path, log_path = Path(plan), None if log is None else Path(log)
    if log_path is not None:
        refuse_existing(log_path, force=force, mark=LOG_MARK)
    planned = read_plan(path)
    cycles, known = _length(planned, seconds, rounds), board_called(board)
    if port == EMULATED:
        caller.say("The board is emulated: nothing flashes.")
    else:
        warn_of_flashing(planned, path, warned=yes, confirm=confirm, caller=caller)
    with opened_port(port, board=known) as opened:
        link = Link(opened)
        ready = prepare(link, wiring=wiring)
        program = make_program(planned, ready.caps, lines=line, source=str(path))
        warnings = (*ready.notes, *program_cautions(planned, program, ready.caps))
        _say_of_program(opened.name, ready, program, warnings, caller)
        outcome = run_program(link, program, cycles=cycles, seconds=seconds, watch=watch)
    record = run_log(path, ready, program, outcome)
    if log_path is not None:
        write_text(log_path, format_log(record))
    return StrobeRun(program=program, outcome=outcome, log=record, warnings=warnings)


def _length(plan: Plan, seconds: float | None, rounds: int | None) -> int | None:
    if seconds is not None and rounds is not None:
        raise UsageError("`seconds` and `rounds` are both given; expected one of the two, or neither for Ctrl-C.")
    if seconds is not None and not 0 < seconds < 1e6:
        raise UsageError(f"`seconds` {seconds:g}: expected a time above 0.")
    if rounds is not None and not 0 < rounds < 1e9:
        raise UsageError(f"`rounds` {rounds}: expected at least 1.")
    return cycles_for(plan, seconds=seconds, rounds=rounds)


def warn_of_flashing(
    plan: Plan, path: Path, *, warned: bool, confirm: Callable[[str], bool] | None, caller: Caller
) -> None:
    """Warn of the flashing before the first flash, and have it confirmed once for each plan.

    Raises UsageError where nobody confirmed and nobody can be asked, PsvideoError where the answer was no.
    """
    warning = seizure_warning(plan) if plan.mode != "synced" else None
    if warning is None:
        return
    sha256, folder = plan_sha256(path), confirmed.state_folder()
    if warned or confirmed.is_confirmed(sha256, folder=folder):
        caller.warn(warning)
        return
    if confirm is None:
        raise UsageError(
            f"{path}: {warning} Nobody has confirmed that: give `yes` when everybody has been warned. Nothing flashed."
        )
    if not confirm(warning):
        raise PsvideoError("Not confirmed, so nothing flashed.")
    if not confirmed.remember(sha256, folder=folder):
        caller.warn(f"{folder} cannot be written, so this will be asked again")


def _say_of_program(port: str, ready: Ready, program: Program, warnings: tuple[str, ...], caller: Caller) -> None:
    for text in warnings:
        caller.warn(text)
    for text in describe_program(program, ready.caps):
        caller.detail(text)
    wired = ", ".join(f"{name} on line {line}" for name, line in program.lines.items())
    caller.say(f"{port}: {ready.identity.board}, firmware {ready.identity.firmware}, {wired}.")
