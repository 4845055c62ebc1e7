"""A board in plain Python: bytes in, bytes out, edges as a list. Keeps no time of its own.

Whoever owns it says what tick it is: ``feed`` bytes when they arrive, ``advance`` in between. It has the limits,
errors, states and faults of lights/protocol.md (``rules``), for any board of the table, and serves where there is no
board.
"""

from collections.abc import Iterator
from dataclasses import replace

from psvideo.strobe.link.boards import Board
from psvideo.strobe.link.lines import LONGEST_REQUEST, Error, LineError, LineReader, TextLine, unseal
from psvideo.strobe.link.protocol import find_command, format_reply, parse_words
from psvideo.strobe.link.replies import Refusal, Reply
from psvideo.strobe.link.requests import Run, Stop, Trim
from psvideo.strobe.link.words import Fault, Interlock, Reset, State
from psvideo.strobe.stand_ins.playing import Edge, Moment, Trimming, moments
from psvideo.strobe.stand_ins.rules import after_reset, answer, signed_ppm

START_DELAY_MS = 10
PS_PER_MS = 10**9
SPOILED = {Error.BYTES: "bytes that are not printable", Error.LONG: f"line of more than {LONGEST_REQUEST} bytes"}


class PythonBoard:
    """One controller. ``edges`` are all edges so far; take them away in long runs with ``take_edges``."""

    def __init__(self, board: Board, *, unit: str = "emulated") -> None:
        self.board = board
        self.edges: list[Edge] = []
        self._now = 0
        self._born = 0
        self._heard = 0
        self._lit: set[int] = set()
        self._moments: Iterator[Moment] = iter(())
        self._next: Moment | None = None
        self._trimming = Trimming(steps=())
        self._reader = LineReader(LONGEST_REQUEST)
        self._memory = after_reset(board, unit, cause="power")

    @property
    def state(self) -> State:
        """The state it is in."""
        return self._memory.state

    @property
    def fault(self) -> Fault:
        """The fault that is latched."""
        return self._memory.fault

    @property
    def lit(self) -> frozenset[int]:
        """The lines that are on now."""
        return frozenset(self._lit)

    def take_edges(self) -> list[Edge]:
        """Return the edges since this was last called, and forget them."""
        taken, self.edges = self.edges, []
        return taken

    def feed(self, data: bytes, now: int) -> bytes:
        """Let bytes arrive at tick ``now`` (counted by the owner, never falling) and return what is answered."""
        self.advance(now)
        return b"".join(map(self._answer, self._reader.feed(data)))

    def advance(self, now: int) -> None:
        """Let time pass until tick ``now``."""
        now = max(now, self._now)
        while self._happens(now):
            pass
        self._now = now

    def set_interlock(self, interlock: Interlock, now: int) -> None:
        """Open or close the interlock; opened while armed or running, it latches a fault."""
        self.advance(now)
        self._memory = replace(self._memory, interlock=interlock)
        if interlock == "open" and self.state in ("armed", "running"):
            self._fail("interlock")

    def miss_an_edge(self, now: int) -> None:
        """Fail as a controller does that could not arm an edge in time."""
        self.advance(now)
        if self.state == "running":
            self._fail("late")

    def restart(self, cause: Reset, now: int) -> None:
        """Reset: dark, nothing uploaded, idle, or in fault after a watchdog reset. Its ticks begin again at 0."""
        self.advance(now)
        self._darken()
        self._born = self._heard = self._now
        self._reader = LineReader(LONGEST_REQUEST)
        memory = self._memory
        self._memory = after_reset(self.board, memory.unit, cause=cause, interlock=memory.interlock)

    def _happens(self, until: int) -> bool:
        """Let the next thing happen that is due; False where nothing is left to do until then."""
        if self.state not in ("armed", "running"):
            return False
        silent = self._heard + self._ticks(self._memory.keep_ms)
        moment = self._next if self.state == "running" else None
        if moment is not None and moment.tick <= min(silent, until):
            self._now = moment.tick
            self._play(moment)
            return True
        if silent <= until:
            self._now = silent
            self._fail("silent")
            return True
        return False

    def _play(self, moment: Moment) -> None:
        self._next = next(self._moments, None)
        if moment.edge is not None:
            self._switch(moment.edge)
            return
        self._memory = replace(self._memory, cycle=moment.cycle, step=moment.step, cycles=moment.cycle)
        if self._next is None:
            self._memory = replace(self._memory, state="idle")

    def _switch(self, edge: Edge) -> None:
        self.edges.append(edge)
        if edge.level:
            self._lit.add(edge.line)
        else:
            self._lit.discard(edge.line)

    def _darken(self) -> None:
        for line in sorted(self._lit):
            self._switch(Edge(tick=self._now, line=line, level=0))
        self._moments, self._next = iter(()), None

    def _fail(self, fault: Fault) -> None:
        self._darken()
        self._memory = replace(self._memory, state="fault", fault=fault)

    def _answer(self, line: TextLine) -> bytes:
        if line.fault is not None:
            return format_reply(Refusal(code=line.fault, text=SPOILED[line.fault]), sealed=False)
        try:
            reply = self._act(unseal(line.text)[0])
        except LineError as fault:
            reply = Refusal(code=fault.code, text=str(fault))
        return format_reply(reply, sealed="*" in line.text)

    def _act(self, body: str) -> Reply | Refusal:
        kind, words = find_command(body)
        if self.state == "fault" and self.state not in kind.states:
            return Refusal(code=Error.FAULT, text=self.fault)
        if self.state not in kind.states:
            return Refusal(code=Error.STATE, text=self.state)
        start = self._now + self._ticks(START_DELAY_MS)
        if kind is Trim and self._played < self._trimming.since:
            return Refusal(code=Error.STATE, text="the trim before does not count yet")
        request = parse_words(kind, words)
        self._memory, reply = answer(self._memory, request, ticks=self._now - self._born, start=start - self._born)
        if isinstance(request, Stop):
            self._darken()
        if isinstance(request, Run):
            steps = self._memory.sequence or ()
            self._trimming = Trimming(steps=steps, start=start)
            self._moments = moments(steps, start=start, cycles=request.cycles, extra=self._trimming.extra)
            self._next = next(self._moments)
        if isinstance(request, Trim) and isinstance(reply, Reply):
            not_before = self._now + self._ticks(self.board.trim_lead_ms)
            self._trimming.trim(signed_ppm(request), step=self._played, not_before=not_before)
        if isinstance(reply, Reply):
            self._heard = self._now
        return reply

    @property
    def _played(self) -> int:
        return self._memory.cycle * len(self._memory.steps) + self._memory.step

    def _ticks(self, time_ms: int) -> int:
        return time_ms * PS_PER_MS // self.board.tick_ps
