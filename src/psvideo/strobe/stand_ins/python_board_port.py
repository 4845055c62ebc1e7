"""The controller in plain Python as a port, in this program and in real time: works without any board."""

import time

from psvideo.strobe.link.boards import Board
from psvideo.strobe.stand_ins.python_board import PythonBoard

WAIT_S = 0.02


class PythonBoardPort:
    """Carries bytes to and from a Python board whose clock is this machine's.

    Edges are forgotten as they come, so that a run may last for ever.
    """

    def __init__(self, board: Board) -> None:
        self._controller = PythonBoard(board)
        self._began_ns = time.monotonic_ns()
        self._waiting = b""

    @property
    def name(self) -> str:
        """What people call it."""
        return f"emulated {self._controller.board.name}"

    def write(self, data: bytes) -> None:
        """Send bytes."""
        self._waiting += self._controller.feed(data, self._now())

    def read(self) -> bytes:
        """Return what has come, after a short wait where nothing has."""
        if not self._waiting:
            time.sleep(WAIT_S)
        self._controller.advance(self._now())
        self._controller.take_edges()
        taken, self._waiting = self._waiting, b""
        return taken

    def close(self) -> None:
        """Let go of it."""

    def _now(self) -> int:
        return (time.monotonic_ns() - self._began_ns) * 1000 // self._controller.board.tick_ps
