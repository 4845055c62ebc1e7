"""One request, one reply, over anything that carries bytes: timeouts, checksums, retries where they are safe.

Requests carry a checksum and so do their replies, so a damaged line is never taken for a whole one. After a line that
was damaged or did not come, a clock query with a fresh nonce restores the order: everything before its answer is
old. Nothing is asked twice that must not be done twice.
"""

import time
from typing import Protocol, TypeVar

from psvideo.errors import PsvideoError
from psvideo.strobe.link.lines import LONGEST_REPLY, Error, LineError, LineReader, TextLine
from psvideo.strobe.link.protocol import format_request, parse_reply
from psvideo.strobe.link.replies import ClockReading, Refusal, Reply
from psvideo.strobe.link.requests import Arm, Clk, Request, Run, Stop, Trim
from psvideo.strobe.link.words import Nonce

REPLY_WITHIN_S = 0.5
TRIES = 4
NEVER_TWICE = (Arm, Run)
"""What the controller may have done although its answer was lost, and would refuse or do again the second time."""
NOT_DONE = (Error.BYTES, Error.LONG, Error.CRC)
"""Refusals after which nothing was done, because the request came damaged."""
HEARD = 200


class Port(Protocol):
    """What carries the bytes. Raises PsvideoError where it is gone."""

    @property
    def name(self) -> str:
        """What people call it."""

    def write(self, data: bytes) -> None:
        """Send bytes."""

    def read(self) -> bytes:
        """Return what has come, after a short wait where nothing has."""

    def close(self) -> None:
        """Let go of it."""


class RefusedError(PsvideoError):
    """The controller refused a request; ``code`` says why."""

    def __init__(self, text: str, *, code: int) -> None:
        super().__init__(text)
        self.code = code


class NoReplyError(PsvideoError):
    """The controller did not answer, or not so that it could be understood."""


Answer = TypeVar("Answer", bound=Reply)


class Link:
    """A controller at a port.

    ``heard`` is the beginning of what came, for messages; ``repaired`` counts the times that the way back was sought.
    """

    def __init__(self, port: Port) -> None:
        self.port = port
        self.heard = b""
        self.repaired = 0
        self._reader = LineReader(LONGEST_REPLY)
        self._waiting: list[TextLine] = []
        self._astray = False
        self._nonce = int(time.time() * 1000) & 0xFFFFFF

    def ask(self, request: Request, kind: type[Answer], *, within_s: float = REPLY_WITHIN_S) -> Answer:
        """Return the controller's reply. Raises RefusedError, NoReplyError, or what the port raises."""
        for _ in range(TRIES):
            if self._astray:
                self._repair(request)
            self.port.write(format_request(request))
            reply = self._reply(kind, within_s)
            self._astray = reply is None or (isinstance(reply, Refusal) and reply.code in NOT_DONE)
            if isinstance(reply, Refusal) and not self._astray:
                raise RefusedError(self._refused(request, reply), code=reply.code)
            if reply is not None and not isinstance(reply, Refusal):
                return reply
            if reply is None and isinstance(request, NEVER_TWICE):
                break
        raise NoReplyError(
            f"{self.port.name}: the controller gave no whole answer to {request.name}. Check cable and plug, keep the "
            "cable away from the lights' supply, and run the command again."
        )

    def _repair(self, request: Request) -> None:
        """Find the way back before a request; darkness does not wait for that."""
        self.repaired += 1
        if isinstance(request, Stop):
            self.port.write(b"\n" + format_request(request))
        self.resynchronise()

    def read_clock(self) -> tuple[ClockReading, float, float]:
        """Return the controller's clock, and the host's (time.monotonic) before asking and after the answer."""
        for _ in range(TRIES):
            nonce = self._next_nonce()
            asked_s = time.monotonic()
            reading = self.ask(Clk(nonce=nonce), ClockReading)
            answered_s = time.monotonic()
            if reading.nonce == nonce and answered_s - asked_s <= REPLY_WITHIN_S:
                return reading, asked_s, answered_s
        raise NoReplyError(
            f"{self.port.name}: the controller's answers to clock queries came late, or were to another program. Close "
            "other programs that use this port, then run the command again."
        )

    def resynchronise(self, *, within_s: float = 2.0) -> bool:
        """Throw away what is under way, until a clock query is answered with its own nonce; False where none is."""
        until_s = time.monotonic() + within_s
        while time.monotonic() < until_s:
            nonce = self._next_nonce()
            self.port.write(b"\n" + format_request(Clk(nonce=nonce)))
            if self.listen(ClockReading, within_s=REPLY_WITHIN_S, nonce=nonce):
                return True
        return False

    def listen(self, kind: type[Answer], *, within_s: float, nonce: Nonce | None = None) -> Answer | None:
        """Return the first whole reply of a kind (and with a nonce), past what comes before; None where none comes."""
        until_s = time.monotonic() + within_s
        while time.monotonic() < until_s:
            reply = self._reply(kind, until_s - time.monotonic())
            if isinstance(reply, kind) and (nonce is None or getattr(reply, "nonce", None) == nonce):
                return reply
        return None

    def _next_nonce(self) -> Nonce:
        self._nonce = (self._nonce + 1) & 0xFFFFFFFF
        return Nonce(f"{self._nonce:x}")

    def _reply(self, kind: type[Answer], within_s: float) -> Answer | Refusal | None:
        """Return the next reply; None where it did not come in time, or damaged."""
        line = self._line(within_s)
        if line is None or line.fault is not None:
            return None
        try:
            reply, sealed = parse_reply(line.text, kind)
        except LineError:
            return None
        damaged = isinstance(reply, Refusal) and reply.code in NOT_DONE
        return reply if sealed or damaged else None

    def _line(self, within_s: float) -> TextLine | None:
        until_s = time.monotonic() + within_s
        while not self._waiting:
            data = self.port.read()
            self.heard = (self.heard + data)[:HEARD]
            self._waiting += self._reader.feed(data)
            if not self._waiting and time.monotonic() >= until_s:
                return None
        return self._waiting.pop(0)

    def _refused(self, request: Request, refusal: Refusal) -> str:
        left = "The trim before it counts on" if isinstance(request, Trim) else "The lights are dark"
        return (
            f"{self.port.name}: the controller refused {request.name}: {refusal.text or 'no reason given'} "
            f"(E {refusal.code}). {left}; lights/protocol.md says what the number means."
        )
