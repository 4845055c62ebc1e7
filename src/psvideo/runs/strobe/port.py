"""The port at which the commands of ``psvideo strobe`` find a board, and the whole of ``psvideo strobe stop``."""

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass

from psvideo.errors import UsageError
from psvideo.strobe.link.boards import BOARDS, Board
from psvideo.strobe.link.controller import OpenPort
from psvideo.strobe.link.exchange import Link, Port
from psvideo.strobe.link.greeting import greet
from psvideo.strobe.link.ports import AUTO, EMULATED
from psvideo.strobe.link.replies import Identity, Status, Stopped
from psvideo.strobe.link.requests import Stat, Stop
from psvideo.strobe.stand_ins.python_board_port import PythonBoardPort


@contextlib.contextmanager
def opened_port(name: str, *, board: Board | None = None) -> Iterator[Port]:
    """Open the port that is called ``name`` until the block ends; ``board`` is which one to emulate.

    Raises UsageError where a board is named for a port that has one already, and PsvideoError where nothing opens.
    """
    port = _open(name, board)
    try:
        yield port
    finally:
        port.close()


def _open(name: str, board: Board | None) -> Port:
    if name == EMULATED:
        return PythonBoardPort(board or next(iter(BOARDS.values())))
    if board is not None:
        raise UsageError(f"`board` {board.name}: the board at {name} says itself what it is; leave `board` out.")
    return OpenPort(name)


@dataclass(frozen=True, kw_only=True)
class DarkBoard:
    """A board that was made dark: its port, who it is, and how it is."""

    port: str
    identity: Identity
    status: Status


def stop(*, port: str = AUTO) -> DarkBoard:
    """Make the board at a port dark, and ask how it is.

    ``port`` is "auto" (by USB identity), a serial port, a pseudo-terminal, ``socket://host:port``, or "emulated".
    Raises PsvideoError where no controller answers there.
    """
    with opened_port(port) as opened:
        link = Link(opened)
        identity = greet(link)
        link.ask(Stop(), Stopped)
        return DarkBoard(port=opened.name, identity=identity, status=link.ask(Stat(), Status))
