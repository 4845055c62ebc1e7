"""psvideo strobe emulate: a strobe controller without a board."""

from __future__ import annotations

import contextlib
import signal
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from psvideo.cli.console import Voice
from psvideo.cli.options.common import Force, Json, Quiet
from psvideo.errors import UsageError
from psvideo.formats.whole_files import refuse_existing, whole_file
from psvideo.strobe.link.boards import BOARDS
from psvideo.strobe.link.messages import WiringName
from psvideo.strobe.stand_ins.toolchain import AvrBoard

if TYPE_CHECKING:
    from psvideo.strobe.stand_ins.emulated import Emulation

LOOK_EVERY_S = 0.2
PYTHON_LIMITS: AvrBoard = "atmega328p"
"""The board whose limits the Python board has."""

BoardChoice = Literal["atmega328p", "atmega2560", "python"]


def emulate(
    board: Annotated[
        BoardChoice | None,
        typer.Option(
            help="The chip that runs the real firmware, or python, a board in plain Python. Left out: atmega328p where "
            "it can be built, else python."
        ),
    ] = None,
    wiring: Annotated[
        WiringName, typer.Option(help="How the lights hang on the board (lights/protocol.md).")
    ] = "gated",
    trace: Annotated[
        Path | None, typer.Option("--trace", help="Write every edge to this file, for psvideo synth --trace.")
    ] = None,
    fast: Annotated[
        bool, typer.Option("--fast", help="As fast as it goes; then only virtual time counts, keep-alive included.")
    ] = False,
    force: Force = False,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Emulate a strobe controller: print its port, run until stopped (Ctrl-C). Other commands take it with --port."""
    from psvideo.formats.trace_csv import SCHEMA
    from psvideo.strobe.stand_ins.emulated import Emulation
    from psvideo.strobe.stand_ins.toolchain import why_not

    voice = Voice(json=json, quiet=quiet)
    if trace is not None:
        refuse_existing(trace, force=force, mark=SCHEMA)
    reason = None if board is not None else why_not()
    if reason is not None:
        voice.warn(f"{reason}; the Python board answers instead.")
    chosen: BoardChoice = board or (PYTHON_LIMITS if reason is None else "python")
    if chosen == "python":
        if fast:
            raise UsageError("--fast: the Python board keeps the wall's time; --fast is for the real firmware.")
        _run_python(voice, wiring, trace)
    else:
        _run_firmware(voice, Emulation(board=chosen, wiring=wiring, trace=trace, fast=fast))


def _run_firmware(voice: Voice, wish: Emulation) -> None:
    from psvideo.strobe.stand_ins.emulated import emulated_board

    with _until_stopped() as stopped, emulated_board(wish) as board:
        _introduce(voice, board.port, f"the real firmware on an emulated {wish.board}", wish.trace)
        while board.is_running and not stopped.wait(LOOK_EVERY_S):
            pass


def _run_python(voice: Voice, wiring: WiringName, trace: Path | None) -> None:
    from psvideo.formats.trace_csv import TraceWriter
    from psvideo.strobe.stand_ins.python_board import PythonBoard
    from psvideo.strobe.stand_ins.python_board_server import TRACE_HZ, open_port, serve

    with _until_stopped() as stopped, contextlib.ExitStack() as stack:
        writer = None
        if trace is not None:
            file = stack.enter_context(stack.enter_context(whole_file(trace)).open("w", encoding="ascii"))
            writer = TraceWriter(file, board=PYTHON_LIMITS, hz=TRACE_HZ, wiring=wiring)
        port = stack.enter_context(contextlib.closing(open_port()))
        _introduce(voice, port.name, f"a Python board with the limits of an {PYTHON_LIMITS}", trace)
        serve(PythonBoard(BOARDS[PYTHON_LIMITS]), port, stopped=stopped.is_set, trace=writer)


def _introduce(voice: Voice, port: str, what: str, trace: Path | None) -> None:
    if not voice.json:
        print(port, flush=True)
    voice.result({"port": port, "what": what, "trace": None if trace is None else str(trace)})
    voice.say(f"{what}; psvideo strobe run plan.toml --port {port} plays a plan on it. Ctrl-C ends it.")
    if trace is not None:
        voice.say(f"Every edge goes to {trace}, which is there when this ends.")
    sys.stdout.flush()


@contextlib.contextmanager
def _until_stopped() -> Iterator[threading.Event]:
    """Give an event that Ctrl-C and SIGTERM set, so that everything is closed in order."""
    stopped = threading.Event()

    def stop(number: int, frame: FrameType | None) -> None:
        stopped.set()

    before = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield stopped
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
