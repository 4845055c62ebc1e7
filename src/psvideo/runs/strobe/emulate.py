"""The whole of ``psvideo strobe emulate``: a strobe controller without a board, until it is stopped."""

import contextlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from threading import Event

from psvideo.errors import UsageError
from psvideo.formats.trace_csv import SCHEMA, TraceWriter
from psvideo.formats.whole_files import refuse_existing, whole_file
from psvideo.runs.steps.caller import PYTHON, Caller
from psvideo.strobe.link.boards import BOARDS
from psvideo.strobe.link.words import WiringName
from psvideo.strobe.stand_ins.emulated import Emulation, emulated_board
from psvideo.strobe.stand_ins.python_board import PythonBoard
from psvideo.strobe.stand_ins.python_board_server import TRACE_HZ, open_port, serve
from psvideo.strobe.stand_ins.toolchain import AvrBoard, StandIn, missing_tools

LOOK_EVERY_S = 0.2
PYTHON_LIMITS: AvrBoard = "atmega328p"
"""The board whose limits the Python board has."""


@dataclass(frozen=True, kw_only=True)
class EmulatedPort:
    """An emulated board that answers: at which port, and what it is in words."""

    port: str
    what: str


def emulate(
    *,
    board: StandIn | None = None,
    wiring: WiringName = "gated",
    trace: Path | str | None = None,
    fast: bool = False,
    force: bool = False,
    started: Callable[[EmulatedPort], None],
    stopped: Event,
    caller: Caller = PYTHON,
) -> None:
    """Emulate a strobe controller until ``stopped`` is set; ``started`` is called when it answers at its port.

    ``board`` is the chip that runs the real firmware, or "python", a board in plain Python; left out, an atmega328p
    where it can be built, else the Python board. ``wiring``: how the lights hang on it. ``trace`` is the file that
    every edge is written to, there when this ends; ``force`` replaces one. ``fast`` lets the real firmware run as fast
    as it goes, in virtual time.

    Raises UsageError where the trace exists or parameters do not fit together, and PsvideoError where the firmware
    cannot be built, or the chip stopped by itself.
    """
    path = None if trace is None else Path(trace)
    if path is not None:
        refuse_existing(path, force=force, mark=SCHEMA)
    reason = None if board is not None else missing_tools()
    if reason is not None:
        caller.warn(f"{reason}; the Python board answers instead.")
    chosen: StandIn = board or (PYTHON_LIMITS if reason is None else "python")
    if chosen != "python":
        _run_firmware(Emulation(board=chosen, wiring=wiring, trace=path, fast=fast), started, stopped)
    elif fast:
        raise UsageError("`fast`: the Python board keeps the wall's time; `fast` is for the real firmware.")
    else:
        _run_python(wiring, path, started, stopped)


def _run_firmware(wish: Emulation, started: Callable[[EmulatedPort], None], stopped: Event) -> None:
    with emulated_board(wish) as board:
        started(EmulatedPort(port=board.port, what=f"the real firmware on an emulated {wish.board}"))
        while board.is_running and not stopped.wait(LOOK_EVERY_S):
            pass


def _run_python(
    wiring: WiringName, trace: Path | None, started: Callable[[EmulatedPort], None], stopped: Event
) -> None:
    with contextlib.ExitStack() as stack:
        writer = None
        if trace is not None:
            file = stack.enter_context(stack.enter_context(whole_file(trace)).open("w", encoding="ascii"))
            writer = TraceWriter(file, board=PYTHON_LIMITS, hz=TRACE_HZ, wiring=wiring)
        port = stack.enter_context(contextlib.closing(open_port()))
        started(EmulatedPort(port=port.name, what=f"a Python board with the limits of an {PYTHON_LIMITS}"))
        serve(PythonBoard(BOARDS[PYTHON_LIMITS]), port, stopped=stopped.is_set, trace=writer)
