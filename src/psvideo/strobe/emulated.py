"""A strobe controller in plain Python: bytes in, bytes out, edges as a list. Keeps no time of its own.

Whoever owns it says what tick it is: ``feed`` bytes when they arrive, ``advance`` in between. It has the limits,
errors, states and faults of lights/protocol.md, for any board of the table, and serves where there is no board.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

from psvideo.strobe.boards import KEEP_AFTER_RESET_MS, KEEP_MS, Board, capabilities
from psvideo.strobe.limits import cycle_check, cycle_refusal, cycle_ticks, slot_refusal
from psvideo.strobe.lines import LONGEST_REQUEST, Error, Line, LineError, LineReader, unseal
from psvideo.strobe.messages import (
    PROTOCOL,
    Arm,
    Armed,
    Capabilities,
    Caps,
    Clear,
    Cleared,
    Clk,
    ClockReading,
    Fault,
    Id,
    Identity,
    Interlock,
    Keep,
    KeepSet,
    New,
    Refusal,
    Renewed,
    Reply,
    Request,
    Reset,
    Run,
    Slot,
    SlotSet,
    Started,
    Stat,
    State,
    Status,
    Steps,
    StepsSet,
    Stop,
    Stopped,
    Wiring,
    WiringName,
    WiringSet,
)
from psvideo.strobe.playing import Edge, Moment, moments
from psvideo.strobe.protocol import find_command, format_reply, parse_words

FIRMWARE = "emulated-1"
START_DELAY_MS = 10
PS_PER_MS = 10**9


@dataclass(frozen=True, kw_only=True)
class _Memory:
    """What a reset clears."""

    wiring: WiringName
    keep_ms: int = KEEP_AFTER_RESET_MS
    state: State = "idle"
    fault: Fault = "none"
    reset: Reset = "power"
    slots: tuple[Slot | None, ...] = ()
    steps: tuple[int, ...] = ()
    cycle: int = 0
    step: int = 0
    cycles: int = 0


class EmulatedController:
    """One controller. ``edges`` are all edges so far; take them away in long runs with ``take_edges``."""

    def __init__(self, board: Board, *, unit: str = "emulated") -> None:
        self.board = board
        self.unit = unit
        self.edges: list[Edge] = []
        self._interlock: Interlock = "closed"
        self._now = 0
        self._born = 0
        self._heard = 0
        self._lit: set[int] = set()
        self._moments: Iterator[Moment] = iter(())
        self._next: Moment | None = None
        self._reader = LineReader(LONGEST_REQUEST)
        self._memory = self._fresh("power")

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
        self._interlock = interlock
        if interlock == "open" and self.state in ("armed", "running"):
            self._fail("interlock")

    def miss_an_edge(self, now: int) -> None:
        """Fail as a controller does that could not arm an edge in time."""
        self.advance(now)
        if self.state == "running":
            self._fail("late")

    def restart(self, cause: Reset, now: int) -> None:
        """Reset: dark, idle, nothing uploaded; after a watchdog reset in fault. Its ticks begin again at 0."""
        self.advance(now)
        self._darken()
        self._born = self._heard = now
        self._reader = LineReader(LONGEST_REQUEST)
        self._memory = self._fresh(cause)

    def _fresh(self, cause: Reset) -> _Memory:
        memory = _Memory(wiring=self.board.first_wiring, reset=cause, slots=(None,) * self.board.slots)
        return replace(memory, state="fault", fault="watchdog") if cause == "watchdog" else memory

    def _happens(self, until: int) -> bool:
        """Let the next thing happen that is due; False where nothing is left to do until then."""
        if self.state not in ("armed", "running"):
            return False
        silent = self._heard + self._memory.keep_ms * PS_PER_MS // self.board.tick_ps
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

    def _answer(self, line: Line) -> bytes:
        sealed = False
        try:
            if line.fault is not None:
                raise LineError(line.fault, {Error.BYTES: "bytes", Error.LONG: "line too long"}[line.fault])
            sealed = "*" in line.text
            body, sealed = unseal(line.text)
            reply = self._act(body)
        except LineError as fault:
            return format_reply(Refusal(code=fault.code, text=str(fault)), sealed=sealed)
        return format_reply(reply, sealed=sealed)

    def _act(self, body: str) -> Reply | Refusal:
        kind, words = find_command(body)
        if self.state not in kind.states:
            stuck = self.state == "fault"
            return _refuse(Error.FAULT if stuck else Error.STATE, self.fault if stuck else self.state)
        request = parse_words(kind, words)
        reply = _ACTIONS[kind](self, request)
        if isinstance(reply, Reply):
            self._heard = self._now
        return reply

    @property
    def _caps(self) -> Capabilities:
        return capabilities(self.board, self._memory.wiring, keep_ms=self._memory.keep_ms)

    def _id(self, request: Id) -> Reply:
        return Identity(proto=PROTOCOL, board=self.board.name, firmware=FIRMWARE, unit=self.unit)

    def _tell_caps(self, request: Caps) -> Reply:
        return self._caps

    def _wire(self, request: Wiring) -> Reply | Refusal:
        if request.wiring not in self.board.lines:
            return _refuse(Error.RANGE, f"wiring {request.wiring}, this board has {' '.join(self.board.lines)}")
        self._forget()
        self._memory = replace(self._memory, wiring=request.wiring)
        return WiringSet(wiring=request.wiring)

    def _keep(self, request: Keep) -> Reply | Refusal:
        if not KEEP_MS[0] <= request.ms <= KEEP_MS[1]:
            return _refuse(Error.RANGE, f"ms {request.ms}, from {KEEP_MS[0]} to {KEEP_MS[1]}")
        self._memory = replace(self._memory, keep_ms=request.ms)
        return KeepSet(keep_ms=request.ms)

    def _new(self, request: New) -> Reply:
        self._forget()
        self._memory = replace(self._memory, state="idle")
        return Renewed()

    def _forget(self) -> None:
        self._memory = replace(self._memory, slots=(None,) * self.board.slots, steps=())

    def _slot(self, request: Slot) -> Reply | Refusal:
        refusal = slot_refusal(request, self._caps)
        if refusal is not None:
            return refusal
        slots = self._memory.slots
        self._memory = replace(self._memory, slots=(*slots[: request.slot], request, *slots[request.slot + 1 :]))
        return SlotSet(slot=request.slot)

    def _steps(self, request: Steps) -> Reply | Refusal:
        steps = self._memory.steps
        if request.first > len(steps):
            return _refuse(Error.RANGE, f"first {request.first}, there are {len(steps)} steps")
        if request.first + len(request.slots) > self.board.steps:
            return _refuse(
                Error.RANGE, f"steps {request.first + len(request.slots)}, this board has {self.board.steps}"
            )
        if max(request.slots) >= self.board.slots:
            return _refuse(Error.RANGE, f"slot {max(request.slots)}, this board has {self.board.slots}")
        self._memory = replace(self._memory, steps=steps[: request.first] + request.slots)
        return StepsSet(steps=len(self._memory.steps))

    def _cycle(self) -> list[Slot] | None:
        """Return the slots in order, None where the upload is incomplete."""
        slots = [self._memory.slots[step] for step in self._memory.steps]
        known = [slot for slot in slots if slot is not None]
        return known if known and len(known) == len(slots) else None

    def _arm(self, request: Arm) -> Reply | Refusal:
        steps = self._cycle()
        if steps is None:
            return _refuse(Error.INCOMPLETE, f"{len(self._memory.steps)} steps, or one names an empty slot")
        check = cycle_check(steps)
        if check != request.check:
            return _refuse(Error.CHECK, f"check {request.check}, expected {check}")
        refusal = cycle_refusal(steps, self._caps)
        if refusal is not None:
            return refusal
        if self._interlock == "open":
            return _refuse(Error.INTERLOCK, "interlock open")
        self._memory = replace(self._memory, state="armed")
        return Armed(check=check, cycle=cycle_ticks(steps))

    def _run(self, request: Run) -> Reply:
        start = self._now + START_DELAY_MS * PS_PER_MS // self.board.tick_ps
        self._moments = moments(self._cycle() or [], start=start, cycles=request.cycles)
        self._next = next(self._moments)
        self._memory = replace(self._memory, state="running", cycle=0, step=0, cycles=0)
        return Started(start=start - self._born)

    def _stop(self, request: Stop) -> Reply:
        self._darken()
        if self.state in ("armed", "running"):
            self._memory = replace(self._memory, state="idle")
        return Stopped(state=self.state, cycles=self._memory.cycles)

    def _stat(self, request: Stat) -> Reply:
        memory = self._memory
        return Status(
            state=memory.state,
            fault=memory.fault,
            reset=memory.reset,
            interlock=self._interlock,
            cycle=memory.cycle,
            step=memory.step,
            cycles=memory.cycles,
        )

    def _clk(self, request: Clk) -> Reply:
        return ClockReading(nonce=request.nonce, cycle=self._memory.cycle, ticks=self._now - self._born)

    def _clear(self, request: Clear) -> Reply | Refusal:
        if self._interlock == "open":
            return _refuse(Error.INTERLOCK, "interlock open")
        self._memory = replace(self._memory, state="idle", fault="none")
        return Cleared(state="idle")


def _refuse(code: Error, text: str) -> Refusal:
    return Refusal(code=code, text=text)


_ACTIONS: dict[type[Request], Callable[..., Reply | Refusal]] = {
    Id: EmulatedController._id,
    Caps: EmulatedController._tell_caps,
    Wiring: EmulatedController._wire,
    Keep: EmulatedController._keep,
    New: EmulatedController._new,
    Slot: EmulatedController._slot,
    Steps: EmulatedController._steps,
    Arm: EmulatedController._arm,
    Run: EmulatedController._run,
    Stop: EmulatedController._stop,
    Stat: EmulatedController._stat,
    Clk: EmulatedController._clk,
    Clear: EmulatedController._clear,
}
