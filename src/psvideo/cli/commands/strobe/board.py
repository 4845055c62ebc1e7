"""psvideo strobe: make lights flash as planned, on a board or on an emulated one."""

from __future__ import annotations

import sys
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import typer

import psvideo.cli.options.strobe as option
from psvideo.cli.commands.strobe.emulate import emulate
from psvideo.cli.commands.strobe.progress import watching
from psvideo.cli.console import Voice
from psvideo.cli.options.clip_and_run import Force
from psvideo.cli.options.per_light import parse_lines
from psvideo.cli.options.records import spread
from psvideo.errors import PsvideoError, UsageError
from psvideo.model.units import counted
from psvideo.strobe.link.ports import AUTO

if TYPE_CHECKING:
    from psvideo.runs.strobe.check import BoardCheck
    from psvideo.runs.strobe.run import StrobeRun

WORTH_SAYING_PPM = 1000.0
"""A clock that was measured less exactly is not worth a line: the run was short."""

strobe = typer.Typer(no_args_is_help=True, help="Make lights flash as planned: on a board, or on an emulated one.")
strobe.command()(emulate)


@strobe.command("list")
@spread
def list_ports(voice: Voice) -> None:
    """Show the serial ports at which a controller may be, by their USB identity; nothing is opened."""
    from psvideo.strobe.link.controller import serial_ports

    ports = serial_ports()
    voice.result({"ports": [{**asdict(port), "board": port.board, "likely": port.is_candidate} for port in ports]})
    likely = [port for port in ports if port.is_candidate]
    for port in ports if voice.verbose else likely:
        voice.say(port.label)
    if not likely:
        others = len(ports) and not voice.verbose
        voice.say(f"No board found{f' ({len(ports)} other ports; -v shows them)' if others else ''}.")
        voice.say("Without a board: --port emulated.")


@strobe.command()
@spread
def check(
    plan: option.PlanFile,
    *,
    port: option.PortName = "",
    board: option.BoardName = None,
    line: option.LineWords = None,
    wiring: option.WiringWord = None,
    voice: Voice,
) -> None:
    """Say whether and how a plan can be played: by the board at a port, by one kind of board, or by any kind."""
    from psvideo.runs.strobe.check import check as check_plan
    from psvideo.runs.strobe.check import check_boards
    from psvideo.strobe.program_words import describe_program, program_record

    lines, wanted = parse_lines(line), option.parse_wiring(wiring)
    if not port and board is None:
        _print_boards(voice, plan, check_boards(plan, line=lines, wiring=wanted))
        return
    found = check_plan(plan, port=port, board=board, line=lines, wiring=wanted)
    for text in describe_program(found.program, found.caps):
        voice.say(text)
    for warning in found.warnings:
        voice.warn(warning)
    voice.result({**program_record(found.program, found.caps), "warnings": found.warnings})


def _print_boards(voice: Voice, plan: Path, found: tuple[BoardCheck, ...]) -> None:
    from psvideo.strobe.program_words import program_record

    for one in found:
        plays = "yes." if one.program is not None else f"no. {one.why}"
        voice.say(f"{one.board}, {one.caps.wiring} wiring: {plays}")
    rows: list[dict[str, object]] = [
        {
            "board": one.board,
            "wiring": one.caps.wiring,
            "plays": one.program is not None,
            **({"why": one.why} if one.program is None else program_record(one.program, one.caps)),
        }
        for one in found
    ]
    voice.result({"boards": rows})
    if all(one.program is None for one in found):
        raise PsvideoError(f"{plan}: no board of the table can play it (--board NAME says more).")


@strobe.command()
@spread
def run(
    plan: option.PlanFile,
    *,
    port: option.PortName = AUTO,
    board: option.BoardName = None,
    seconds: option.Seconds = None,
    rounds: option.Rounds = None,
    line: option.LineWords = None,
    wiring: option.WiringWord = None,
    log: option.LogPath = None,
    yes: option.Yes = False,
    force: Force = False,
    voice: Voice,
) -> None:
    """Play a plan until Ctrl-C, or for a time; however it ends, the lights are off afterwards."""
    from psvideo.runs.strobe.run import run as play
    from psvideo.strobe.runlog import log_record

    with watching(voice) as watch:
        played = play(
            plan,
            port=port,
            board=board,
            seconds=seconds,
            rounds=rounds,
            line=parse_lines(line),
            wiring=option.parse_wiring(wiring),
            log=log,
            yes=yes,
            force=force,
            confirm=partial(_is_everybody_warned, plan),
            watch=watch,
            caller=voice.caller(),
        )
    voice.result({**log_record(played.log), "warnings": played.warnings})
    _print_run(voice, played, log)
    if played.outcome.message is not None:
        raise PsvideoError(played.outcome.message)


def _is_everybody_warned(plan: Path, warning: str) -> bool:
    """Warn of the flashing, however quiet the command is, and ask."""
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        raise UsageError(
            f"{plan}: {warning} Nobody can confirm that here, as this is not a terminal: run the command once in a "
            "terminal, or give --yes when everybody has been warned. Nothing flashed."
        )
    Voice().warn(warning)
    return typer.confirm("Has everybody in the room been warned?", err=True)


def _print_run(voice: Voice, played: StrobeRun, log: Path | None) -> None:
    outcome = played.outcome
    how = {"done": "Played", "stopped": "Stopped after"}.get(outcome.ended, "Broken off after")
    voice.say(
        f"{how} {counted(outcome.cycles, 'whole cycle')} of {counted(len(played.program.played.dark_rounds), 'round')}."
    )
    if outcome.clock is not None and outcome.clock.gain_error_ppm <= WORTH_SAYING_PPM:
        clock = outcome.clock
        voice.say(
            f"The board's seconds are {clock.offset_ppm:+.0f} ppm long by this machine's clock, "
            f"known to {clock.gain_error_ppm:.0f} ppm."
        )
    if log is not None:
        voice.say(f"{log}: written. Put it beside plan.toml in the clip's folder.")


@strobe.command()
@spread
def stop(
    *,
    port: option.PortName = AUTO,
    voice: Voice,
) -> None:
    """Switch off all lights of a board, and print its state."""
    from psvideo.runs.strobe.port import stop as darken

    found = darken(port=port)
    identity, status = found.identity, found.status
    voice.result({**asdict(identity), **asdict(status)})
    latched = "" if status.fault == "none" else f", fault {status.fault}"
    voice.say(f"{found.port}: {identity.board}, dark, {status.state}{latched}, interlock {status.interlock}.")
