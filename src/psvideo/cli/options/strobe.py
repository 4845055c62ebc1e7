"""The options of psvideo strobe, each written once, and what becomes of their words."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from psvideo.cli.options.completing import offer_boards, offer_lines, offer_ports
from psvideo.errors import UsageError, nearest
from psvideo.strobe.link.boards import BOARDS, Board
from psvideo.strobe.link.messages import WIRINGS, WiringName

if TYPE_CHECKING:
    from psvideo.strobe.link.exchange import Port

EMULATED = "emulated"

PlanFile = Annotated[Path, typer.Argument(help="The plan to play: plan.toml.")]
PortName = Annotated[
    str,
    typer.Option(
        "--port",
        help="auto (by USB identity), a serial port, a pseudo-terminal, socket://host:port, or emulated.",
        autocompletion=offer_ports,
    ),
]
BoardName = Annotated[
    str | None,
    typer.Option(
        "--board",
        help=f"Which board to emulate, or to check against: {', '.join(BOARDS)}.",
        autocompletion=offer_boards,
    ),
]
LineWords = Annotated[
    list[str] | None,
    typer.Option(
        "--line",
        help="Which line a light is wired to, such as key=0; may be repeated.",
        autocompletion=offer_lines,
    ),
]
WiringWord = Annotated[
    str | None,
    typer.Option("--wiring", help="gated (one exact output, eight selected lines) or direct (each line exact)."),
]
Seconds = Annotated[float | None, typer.Option("--seconds", help="Stop after so many seconds.")]
Rounds = Annotated[int | None, typer.Option("--rounds", help="Stop after so many rounds, rounded up to whole cycles.")]
LogPath = Annotated[
    Path | None, typer.Option("--log", help="Where to write what was played: strobe.json, for the clip's folder.")
]
Yes = Annotated[bool, typer.Option("--yes", help="Everybody has been warned of the flashing; do not ask.")]


def parse_lines(words: Sequence[str] | None) -> dict[str, int]:
    """Return light names and lines out of ``key=0``.

    >>> parse_lines(["key=0", "left=3"])
    {'key': 0, 'left': 3}
    """
    lines: dict[str, int] = {}
    for word in words or ():
        name, _, line = word.rpartition("=")
        if not name or not line.isdecimal():
            raise UsageError(f"--line {word}: expected a light's name and a line's number, such as key=0.")
        if name in lines:
            raise UsageError(f"--line {word}: {name} is wired to line {lines[name]} already.")
        lines[name] = int(line)
    return lines


def parse_wiring(word: str | None) -> WiringName | None:
    """Return the wiring that was asked for."""
    for wiring in WIRINGS:
        if word == wiring:
            return wiring
    if word is None:
        return None
    raise UsageError(f"--wiring {word}: {nearest(word, WIRINGS)}")


def parse_board(word: str | None) -> Board | None:
    """Return the board of the table that was asked for."""
    if word is None or word in BOARDS:
        return None if word is None else BOARDS[word]
    usual = "An Uno or Nano has an atmega328p, a Mega an atmega2560, a Pico an rp2040."
    raise UsageError(f"--board {word}: {nearest(word, BOARDS)} {usual}")


def open_port(name: str, *, board: Board | None) -> Port:
    """Open a port by what --port says."""
    from psvideo.strobe.link.controller import OpenPort
    from psvideo.strobe.stand_ins.python_board_port import PythonBoardPort

    if name == EMULATED:
        return PythonBoardPort(board or next(iter(BOARDS.values())))
    if board is not None:
        raise UsageError(f"--board {board.name}: the board at {name} says itself what it is; leave --board out.")
    return OpenPort(name)
