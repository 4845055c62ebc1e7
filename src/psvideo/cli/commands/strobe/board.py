"""psvideo strobe: make lights flash as planned, on a board or on an emulated one."""

from __future__ import annotations

import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import typer

import psvideo.cli.options.strobe as option
from psvideo.cli.commands.strobe.emulate import emulate
from psvideo.cli.commands.strobe.progress import watching
from psvideo.cli.console import Voice
from psvideo.cli.options.common import Force, Json, Quiet, Verbose
from psvideo.errors import PsvideoError, UsageError
from psvideo.formats.whole_files import refuse_existing, write_text
from psvideo.strobe.link.boards import BOARDS, Board, capabilities
from psvideo.strobe.link.messages import Capabilities, Stat, Status, Stop, Stopped, WiringName
from psvideo.strobe.link.ports import AUTO

if TYPE_CHECKING:
    from psvideo.model.plan import Plan
    from psvideo.strobe.program import Program
    from psvideo.strobe.session import Outcome

WORTH_SAYING_PPM = 1000.0
"""A clock that was measured less exactly is not worth a line: the run was short."""

strobe = typer.Typer(no_args_is_help=True, help="Make lights flash as planned: on a board, or on an emulated one.")
strobe.command()(emulate)


@strobe.command("list")
def list_ports(json: Json = False, verbose: Verbose = False, quiet: Quiet = False) -> None:
    """Show the serial ports at which a controller may be, by their USB identity; nothing is opened."""
    from psvideo.strobe.link.controller import serial_ports

    voice = Voice(json=json, verbose=verbose, quiet=quiet)
    ports = serial_ports()
    voice.result({"ports": [{**asdict(port), "board": port.board, "likely": port.is_candidate} for port in ports]})
    likely = [port for port in ports if port.is_candidate]
    for port in ports if verbose else likely:
        voice.say(port.label)
    if not likely:
        others = len(ports) and not verbose
        voice.say(f"No board found{f' ({len(ports)} other ports; -v shows them)' if others else ''}.")
        voice.say("Without a board: --port emulated.")


@strobe.command()
def check(
    plan: option.PlanFile,
    port: option.PortName = "",
    board: option.BoardName = None,
    line: option.LineWords = None,
    wiring: option.WiringWord = None,
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Say whether a plan can be played, and how: on the board at a port, on one of the table, or on any of them."""
    from psvideo.formats.plan_toml import read_plan
    from psvideo.strobe.program import make_program
    from psvideo.strobe.program_words import program_record

    voice = Voice(json=json, verbose=verbose, quiet=quiet)
    planned, wanted = read_plan(plan), option.parse_wiring(wiring)
    lines, known = option.parse_lines(line), option.parse_board(board)
    if not port and known is None:
        _check_table(voice, planned, plan, wanted, lines)
        return
    caps = _caps_at(port, known, wanted) if port else _caps_of(known or BOARDS["atmega328p"], wanted)
    program = make_program(planned, caps, lines=lines, source=str(plan))
    warnings = _print_program(voice, planned, program, caps)
    voice.result({**program_record(program, caps), "warnings": warnings})


def _caps_at(port: str, board: Board | None, wiring: WiringName | None) -> Capabilities:
    from psvideo.strobe.link.exchange import Link
    from psvideo.strobe.session import prepare

    opened = option.open_port(port, board=board)
    try:
        return prepare(Link(opened), wiring=wiring).caps
    finally:
        opened.close()


def _caps_of(board: Board, wiring: WiringName | None) -> Capabilities:
    if wiring is not None and wiring not in board.lines:
        raise UsageError(f"--wiring {wiring}: the {board.name} has {' and '.join(board.lines)} wiring only.")
    return capabilities(board, wiring or board.first_wiring)


def _check_table(voice: Voice, plan: Plan, path: Path, wanted: WiringName | None, lines: dict[str, int]) -> None:
    """Check a plan against every board of the table and each of its wirings."""
    from psvideo.strobe.program import make_program
    from psvideo.strobe.program_words import program_record

    found: list[dict[str, object]] = []
    for board in BOARDS.values():
        for wiring in board.lines:
            if wanted not in (None, wiring):
                continue
            caps = capabilities(board, wiring)
            try:
                program = make_program(plan, caps, lines=lines, source=str(path))
            except PsvideoError as fault:
                found.append({"board": board.name, "wiring": wiring, "plays": False, "why": str(fault)})
                voice.say(f"{board.name}, {wiring} wiring: no. {fault}")
            else:
                found.append({"board": board.name, "wiring": wiring, "plays": True, **program_record(program, caps)})
                voice.say(f"{board.name}, {wiring} wiring: yes.")
    voice.result({"boards": found})
    if not any(row["plays"] for row in found):
        raise PsvideoError(f"{path}: no board of the table can play it (--board NAME says more).")


def _print_program(voice: Voice, plan: Plan, program: Program, caps: Capabilities) -> list[str]:
    """Describe a program, and return what to beware of."""
    from psvideo.strobe.program_words import describe_program, program_cautions
    from psvideo.strobe.seizures import seizure_warning

    for line in describe_program(program, caps):
        voice.say(line)
    seizures = seizure_warning(program.played)
    warnings = [*program_cautions(plan, program, caps), *([seizures] if seizures else [])]
    for warning in warnings:
        voice.warn(warning)
    return warnings


@strobe.command()
def run(
    plan: option.PlanFile,
    port: option.PortName = AUTO,
    board: option.BoardName = None,
    seconds: option.Seconds = None,
    rounds: option.Rounds = None,
    line: option.LineWords = None,
    wiring: option.WiringWord = None,
    log: option.LogPath = None,
    yes: option.Yes = False,
    force: Force = False,
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Play a plan until Ctrl-C, or for a time; in every case the lights are dark afterwards."""
    from psvideo.formats.plan_toml import read_plan
    from psvideo.strobe.link.exchange import Link
    from psvideo.strobe.program import make_program
    from psvideo.strobe.program_words import describe_program, program_cautions
    from psvideo.strobe.runlog import format_log, log_record, run_log
    from psvideo.strobe.session import prepare, run_program

    voice = Voice(json=json, verbose=verbose, quiet=quiet)
    if log is not None:
        refuse_existing(log, force=force, mark="psvideo-strobe/")
    planned, lines, wanted = read_plan(plan), option.parse_lines(line), option.parse_wiring(wiring)
    length = _length(planned, seconds, rounds)
    known = option.parse_board(board)
    _confirm(voice, planned, plan, yes=yes, emulated=port == option.EMULATED)
    opened = option.open_port(port, board=known)
    try:
        link = Link(opened)
        ready = prepare(link, wiring=wanted)
        program = make_program(planned, ready.caps, lines=lines, source=str(plan))
        warnings = [*ready.notes, *program_cautions(planned, program, ready.caps)]
        for text in warnings:
            voice.warn(text)
        for text in describe_program(program, ready.caps):
            voice.detail(text)
        voice.say(f"{opened.name}: {ready.identity.board}, firmware {ready.identity.firmware}, {_lines(program)}.")
        lasts_s = seconds if length is None or seconds is not None else length * program.played.cycle_s
        with watching(voice, program, lasts_s=lasts_s) as watch:
            outcome = run_program(link, program, cycles=length, seconds=seconds, watch=watch)
    finally:
        opened.close()
    record = run_log(plan, ready, program, outcome)
    if log is not None:
        write_text(log, format_log(record))
    voice.result({**log_record(record), "warnings": warnings})
    _print_outcome(voice, planned, outcome, log)
    if outcome.message is not None:
        raise PsvideoError(outcome.message)


def _length(plan: Plan, seconds: float | None, rounds: int | None) -> int | None:
    from psvideo.strobe.session import cycles_for

    if seconds is not None and rounds is not None:
        raise UsageError("--seconds and --rounds are both given; expected one of the two, or neither for Ctrl-C.")
    if seconds is not None and not 0 < seconds < 1e6:
        raise UsageError(f"--seconds {seconds:g}: expected a time above 0.")
    if rounds is not None and not 0 < rounds < 1e9:
        raise UsageError(f"--rounds {rounds}: expected at least 1.")
    return cycles_for(plan, seconds=seconds, rounds=rounds)


def _confirm(voice: Voice, plan: Plan, path: Path, *, yes: bool, emulated: bool) -> None:
    """Warn of the flashing before the first flash, and have it confirmed once for each plan."""
    from psvideo.strobe.confirmed import is_confirmed, remember, state_folder
    from psvideo.strobe.runlog import plan_sha256
    from psvideo.strobe.seizures import seizure_warning

    warning = seizure_warning(plan) if plan.mode != "synced" else None
    if warning is None:
        return
    sha256, folder = plan_sha256(path), state_folder()
    if yes or emulated or is_confirmed(sha256, folder=folder):
        voice.warn(warning)
        return
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        raise UsageError(
            f"{path}: {warning} Nobody can confirm that here, for this is no terminal: run the command once in a "
            "terminal, or give --yes when everybody has been warned. Nothing flashed."
        )
    Voice().warn(warning)
    if not typer.confirm("Has everybody in the room been warned?", err=True):
        raise PsvideoError("Not confirmed, so nothing flashed.")
    if not remember(sha256, folder=folder):
        voice.warn(f"{folder} cannot be written, so this will be asked again")


def _lines(program: Program) -> str:
    return ", ".join(f"{name} on line {line}" for name, line in program.lines.items())


def _print_outcome(voice: Voice, plan: Plan, outcome: Outcome, log: Path | None) -> None:
    how = {"done": "Played", "stopped": "Stopped after"}.get(outcome.ended, "Broken off after")
    voice.say(f"{how} {outcome.cycles} whole cycles of {plan.dark_every} round(s) each.")
    if outcome.clock is not None and outcome.clock.gain_error_ppm <= WORTH_SAYING_PPM:
        clock = outcome.clock
        voice.say(
            f"The board's seconds are {clock.offset_ppm:+.0f} ppm long by this machine's clock, "
            f"known to {clock.gain_error_ppm:.0f} ppm."
        )
    if log is not None:
        voice.say(f"{log}: written. Put it beside plan.toml in the clip's folder.")


@strobe.command()
def stop(
    port: option.PortName = AUTO,
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Make a board dark, and say how it is."""
    from psvideo.strobe.link.exchange import Link
    from psvideo.strobe.link.greeting import greet

    voice = Voice(json=json, verbose=verbose, quiet=quiet)
    opened = option.open_port(port, board=None)
    try:
        link = Link(opened)
        identity = greet(link)
        link.ask(Stop(), Stopped)
        status = link.ask(Stat(), Status)
    finally:
        opened.close()
    voice.result({**asdict(identity), **asdict(status)})
    latched = "" if status.fault == "none" else f", fault {status.fault}"
    voice.say(f"{opened.name}: {identity.board}, dark, {status.state}{latched}, interlock {status.interlock}.")
