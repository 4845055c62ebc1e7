"""The real firmware in emulation, step by step in virtual time: asked and looked at as the board in plain Python is."""

import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

from psvideo.formats.trace_csv import COLUMNS
from psvideo.strobe.link.boards import BOARDS
from psvideo.strobe.stand_ins.playing import Edge
from psvideo.strobe.stand_ins.toolchain import AvrBoard, build

TICK_CYCLES = 8
BOOTED_CYCLES = 320_000
"""20 ms after power-on the firmware listens."""


class FirmwareBoard:
    """A chip that runs only while it is told to; ``cycle`` is where it is. Its serial line takes its time."""

    def __init__(self, process: subprocess.Popen[str], trace: TextIO, board: AvrBoard) -> None:
        self.board = BOARDS[board]
        self.cycle = 0
        self._process, self._trace = process, trace
        while self._trace.readline().strip() != COLUMNS:
            self._say(f"until {BOOTED_CYCLES}")

    def feed(self, data: bytes, now: int) -> bytes:
        """Send one line at tick ``now``, or as soon as the chip is free, and return what is answered."""
        self.advance(now)
        said = self._say(f"send {data.decode().strip()}")
        assert said.startswith("< "), said
        return said.removeprefix("< ").encode() + b"\n"

    def advance(self, now: int) -> None:
        """Let time pass until tick ``now``."""
        if now * TICK_CYCLES > self.cycle:
            self._say(f"until {now * TICK_CYCLES}")

    def take_edges(self) -> list[Edge]:
        """Return the lights' edges since this was last called."""
        rows = (line.strip().split(",") for line in self._trace)
        return [
            Edge(tick=int(cycle) // TICK_CYCLES, line=int(line), level=int(level))
            for cycle, line, level in rows
            if line.isdigit()
        ]

    def _say(self, line: str) -> str:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(line + "\n")
        self._process.stdin.flush()
        cycle, _, said = self._process.stdout.readline().strip().partition(" ")
        self.cycle = int(cycle)
        return said


@contextmanager
def firmware_board(folder: Path, board: AvrBoard = "atmega328p") -> Iterator[FirmwareBoard]:
    """Run a chip fresh from power-on until the block ends; its trace lies in the folder."""
    built, path = build(board), folder / "trace.csv"
    words = [str(built.emulator), "--board", board, "--script", "-", "--trace", str(path), str(built.firmware)]
    path.touch()
    with (
        path.open(encoding="ascii") as trace,
        subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process,
    ):
        yield FirmwareBoard(process, trace, board)
        assert process.stdin is not None
        process.stdin.close()
