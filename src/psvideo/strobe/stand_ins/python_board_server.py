"""The Python board behind a port: a pseudo-terminal, or a loopback socket where the system has none.

It keeps the wall's time: a tick has passed when the wall's clock says so.
"""

import contextlib
import os
import select
import socket
import time
from collections.abc import Callable
from typing import Protocol

from psvideo.formats.trace_csv import TraceWriter
from psvideo.strobe.stand_ins.playing import Edge
from psvideo.strobe.stand_ins.python_board import PythonBoard

LOOK_EVERY_S = 0.002
AT_ONCE = 4096
PS_PER_NS = 1000
TRACE_HZ = 16_000_000
"""The traces of the Python board and of the emulated one count the same cycles."""


class StandInPort(Protocol):
    """The controller's end of a serial line. ``name`` is what a host opens, as pyserial understands it."""

    name: str

    def exchange(self, answer: bytes, wait_s: float) -> bytes:
        """Send, then wait up to ``wait_s`` for bytes; b"" where none came."""

    def close(self) -> None:
        """Close it."""


class PtyPort:
    """A pseudo-terminal; our copy of the host's end stays open, so that hosts may come and go."""

    def __init__(self) -> None:
        import tty

        self._ours, self._theirs = os.openpty()
        tty.setraw(self._theirs)
        os.set_blocking(self._ours, False)
        self.name = os.ttyname(self._theirs)

    def exchange(self, answer: bytes, wait_s: float) -> bytes:
        """Send, then wait for bytes; what nobody reads is lost, as on a wire."""
        if answer:
            with contextlib.suppress(BlockingIOError):
                os.write(self._ours, answer)
        ready, _, _ = select.select([self._ours], [], [], wait_s)
        return os.read(self._ours, AT_ONCE) if ready else b""

    def close(self) -> None:
        """Close both ends."""
        os.close(self._ours)
        os.close(self._theirs)


class SocketPort:
    """A loopback socket for one host at a time."""

    def __init__(self) -> None:
        self._door = socket.create_server(("127.0.0.1", 0))
        self._host: socket.socket | None = None
        self.name = f"socket://127.0.0.1:{self._door.getsockname()[1]}"

    def exchange(self, answer: bytes, wait_s: float) -> bytes:
        """Send, then wait for bytes or for a host to come; a host that went is forgotten."""
        try:
            if answer and self._host is not None:
                self._host.sendall(answer)
            ready, _, _ = select.select([self._host or self._door], [], [], wait_s)
            if not ready:
                return b""
            if self._host is None:
                self._host = self._door.accept()[0]
                return b""
            got = self._host.recv(AT_ONCE)
        except OSError:
            got = b""
        if not got and self._host is not None:
            self._host.close()
            self._host = None
        return got

    def close(self) -> None:
        """Close what is open."""
        self._door.close()
        if self._host is not None:
            self._host.close()


def open_port() -> StandInPort:
    """Return a pseudo-terminal, or a loopback socket on systems that have none (Windows)."""
    return PtyPort() if hasattr(os, "openpty") else SocketPort()


def serve(
    controller: PythonBoard, port: StandInPort, *, stopped: Callable[[], bool], trace: TraceWriter | None = None
) -> None:
    """Let a controller live behind a port, in the wall's time, until ``stopped`` says so; then it goes dark."""
    began_ns, answer, now = time.monotonic_ns(), b"", 0
    while not stopped():
        data = port.exchange(answer, LOOK_EVERY_S)
        now = (time.monotonic_ns() - began_ns) * PS_PER_NS // controller.board.tick_ps
        answer = controller.feed(data, now)
        _write(controller, trace, controller.take_edges())
    controller.restart("power", now)
    _write(controller, trace, controller.take_edges())


def _write(controller: PythonBoard, trace: TraceWriter | None, edges: list[Edge]) -> None:
    if trace is not None:
        per_tick = controller.board.tick_ps * TRACE_HZ // 10**12
        trace.write((edge.tick * per_tick, edge.line, edge.level) for edge in edges)
