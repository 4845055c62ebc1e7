"""The options of psvideo strobe, each written once, and what becomes of their words."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from psvideo.cli.options.completing import offer_boards, offer_lines, offer_ports
from psvideo.errors import UsageError, nearest
from psvideo.strobe.link.boards import BOARDS
from psvideo.strobe.link.words import WIRINGS, WiringName
from psvideo.strobe.stand_ins.toolchain import StandIn

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
        help="Which line a light is wired to, such as key=0 (key,rim=0: both on one line); may be repeated.",
        autocompletion=offer_lines,
    ),
]
WiringWord = Annotated[
    str | None,
    typer.Option("--wiring", help="gated (one exact output, eight selected lines) or direct (each line exact)."),
]
Seconds = Annotated[float | None, typer.Option("--seconds", help="Stop after this many seconds.")]
Rounds = Annotated[
    int | None, typer.Option("--rounds", help="Stop after this many rounds (rounded up to whole cycles).")
]
LogPath = Annotated[
    Path | None, typer.Option("--log", help="Log of what was played, to put beside the clip: strobe.json.")
]
StandInName = Annotated[
    StandIn | None,
    typer.Option(
        "--board",
        help="The chip that runs the real firmware, or python, a board in plain Python. Left out: atmega328p where "
        "it can be built, else python.",
    ),
]
StandInWiring = Annotated[
    WiringName, typer.Option("--wiring", help="How the lights are wired to the board (lights/protocol.md).")
]
TraceOut = Annotated[
    Path | None, typer.Option("--trace", help="Write every edge to this file, for psvideo synth --trace.")
]
Fast = Annotated[
    bool, typer.Option("--fast", help="Run as fast as possible, in virtual time (which the keep-alive follows too).")
]
Yes = Annotated[bool, typer.Option("--yes", help="Everybody has been warned of the flashing; do not ask.")]


def parse_wiring(word: str | None) -> WiringName | None:
    """Return the wiring that was asked for."""
    for wiring in WIRINGS:
        if word == wiring:
            return wiring
    if word is None:
        return None
    raise UsageError(f"--wiring {word}: {nearest(word, WIRINGS)}")
