"""psvideo strobe emulate: a strobe controller without a board."""

from __future__ import annotations

import contextlib
import signal
import sys
import threading
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

import psvideo.cli.options.strobe as option
from psvideo.cli.console import Voice
from psvideo.cli.options.clip_and_run import Force, Json, Quiet

if TYPE_CHECKING:
    from psvideo.runs.strobe.emulate import EmulatedPort


def emulate(
    board: option.StandInName = None,
    wiring: option.StandInWiring = "gated",
    trace: option.TraceOut = None,
    fast: option.Fast = False,
    force: Force = False,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Emulate a strobe controller: print its port, run until stopped (Ctrl-C). Other commands take it with --port."""
    from psvideo.runs.strobe.emulate import emulate as run_board

    voice = Voice(json=json, quiet=quiet)
    with _until_stopped() as stopped:
        run_board(
            board=board,
            wiring=wiring,
            trace=trace,
            fast=fast,
            force=force,
            started=partial(_introduce, voice, trace),
            stopped=stopped,
            caller=voice.caller(),
        )


def _introduce(voice: Voice, trace: Path | None, board: EmulatedPort) -> None:
    if not voice.json:
        print(board.port, flush=True)
    voice.result({"port": board.port, "what": board.what, "trace": None if trace is None else str(trace)})
    voice.say(f"{board.what}; psvideo strobe run plan.toml --port {board.port} plays a plan on it. Ctrl-C ends it.")
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
