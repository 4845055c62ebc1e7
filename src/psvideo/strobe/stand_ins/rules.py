"""What a controller answers: from its memory and a request to its memory afterwards and the reply. Pure functions.

Time, edges and bytes are ``python_board``'s; what is right stands in lights/protocol.md.
"""

from dataclasses import dataclass, replace

from psvideo.strobe.limits import cycle_check, cycle_refusal, cycle_ticks, slot_refusal, trim_refusal
from psvideo.strobe.link import messages as m
from psvideo.strobe.link.boards import KEEP_AFTER_RESET_MS, KEEP_MS, MAX_TRIM_PPM, Board, capabilities
from psvideo.strobe.link.lines import Error

FIRMWARE = "python-1"


@dataclass(frozen=True, kw_only=True)
class ControllerMemory:
    """What a controller knows. A reset clears all but the board, its unit and the interlock's wire."""

    board: Board
    unit: str
    wiring: m.WiringName
    interlock: m.Interlock = "closed"
    keep_ms: int = KEEP_AFTER_RESET_MS
    state: m.State = "idle"
    fault: m.Fault = "none"
    reset: m.Reset = "power"
    slots: tuple[m.Slot | None, ...] = ()
    steps: tuple[int, ...] = ()
    cycle: int = 0
    step: int = 0
    cycles: int = 0

    @property
    def caps(self) -> m.Capabilities:
        """What the board can play with the wiring that is set."""
        return capabilities(self.board, self.wiring, keep_ms=self.keep_ms)

    @property
    def sequence(self) -> tuple[m.Slot, ...] | None:
        """The flashes of the cycle in order; None where the upload is incomplete."""
        slots = [self.slots[step] for step in self.steps]
        known = tuple(slot for slot in slots if slot is not None)
        return known if known and len(known) == len(slots) else None


def after_reset(board: Board, unit: str, *, cause: m.Reset, interlock: m.Interlock = "closed") -> ControllerMemory:
    """Return the memory of a controller that has just started: idle, or in fault after a watchdog reset."""
    memory = ControllerMemory(
        board=board,
        unit=unit,
        wiring=board.first_wiring,
        interlock=interlock,
        reset=cause,
        slots=(None,) * board.slots,
    )
    return replace(memory, state="fault", fault="watchdog") if cause == "watchdog" else memory


Answer = tuple[ControllerMemory, m.Reply | m.Refusal]


def answer(memory: ControllerMemory, request: m.Request, *, ticks: int, start: int) -> Answer:
    """Return what a request does and what is answered to it, in a state that allows it.

    ``ticks`` is the controller's clock; a run that begins now has its first flash at ``start``.
    """
    match request:
        case m.Wiring() | m.Keep() | m.New():
            return _settings(memory, request)
        case m.Slot() | m.Steps() | m.Arm():
            return _upload(memory, request)
        case m.Run():
            return replace(memory, state="running", cycle=0, step=0, cycles=0), m.Started(start=start)
        case m.Trim():
            return memory, _trim(memory, request)
        case m.Stop():
            state: m.State = "fault" if memory.state == "fault" else "idle"
            return replace(memory, state=state), m.Stopped(state=state, cycles=memory.cycles)
        case m.Clear():
            if memory.interlock == "open":
                return memory, _refuse(Error.INTERLOCK, "interlock open")
            return replace(memory, state="idle", fault="none"), m.Cleared(state="idle")
        case m.Clk():
            return memory, m.ClockReading(nonce=request.nonce, cycle=memory.cycle, ticks=ticks)
        case _:
            return memory, _about(memory, request)


def _about(memory: ControllerMemory, request: m.Request) -> m.Reply:
    if isinstance(request, m.Id):
        return m.Identity(proto=m.PROTOCOL, board=memory.board.name, firmware=FIRMWARE, unit=memory.unit)
    if isinstance(request, m.Caps):
        return memory.caps
    return m.Status(
        state=memory.state,
        fault=memory.fault,
        reset=memory.reset,
        interlock=memory.interlock,
        cycle=memory.cycle,
        step=memory.step,
        cycles=memory.cycles,
    )


def _settings(memory: ControllerMemory, request: m.Wiring | m.Keep | m.New) -> Answer:
    empty = replace(memory, slots=(None,) * memory.board.slots, steps=())
    if isinstance(request, m.New):
        return replace(empty, state="idle"), m.Renewed()
    if isinstance(request, m.Keep):
        if not KEEP_MS[0] <= request.ms <= KEEP_MS[1]:
            return memory, _refuse(Error.RANGE, f"ms {request.ms}, from {KEEP_MS[0]} to {KEEP_MS[1]}")
        return replace(memory, keep_ms=request.ms), m.KeepSet(keep_ms=request.ms)
    if request.wiring not in memory.board.lines:
        known = " ".join(memory.board.lines)
        return memory, _refuse(Error.RANGE, f"wiring {request.wiring}, this board has {known}")
    return replace(empty, wiring=request.wiring), m.WiringSet(wiring=request.wiring)


def _upload(memory: ControllerMemory, request: m.Slot | m.Steps | m.Arm) -> Answer:
    if isinstance(request, m.Slot):
        refusal = slot_refusal(request, memory.caps)
        if refusal is not None:
            return memory, refusal
        slots = (*memory.slots[: request.slot], request, *memory.slots[request.slot + 1 :])
        return replace(memory, slots=slots), m.SlotSet(slot=request.slot)
    if isinstance(request, m.Steps):
        return _write_steps(memory, request)
    return _arm(memory, request)


def _write_steps(memory: ControllerMemory, request: m.Steps) -> Answer:
    board, held = memory.board, len(memory.steps)
    count, highest = request.first + len(request.slots), max(request.slots)
    if request.first > held:
        return memory, _refuse(Error.RANGE, f"first {request.first}, there are {held} steps")
    if count > board.steps:
        return memory, _refuse(Error.RANGE, f"steps {count}, this board has {board.steps}")
    if highest >= board.slots:
        return memory, _refuse(Error.RANGE, f"slot {highest}, this board has {board.slots}")
    return replace(memory, steps=memory.steps[: request.first] + request.slots), m.StepsSet(steps=count)


def _arm(memory: ControllerMemory, request: m.Arm) -> Answer:
    sequence = memory.sequence
    if sequence is None:
        return memory, _refuse(Error.INCOMPLETE, f"{len(memory.steps)} steps, or one names an empty slot")
    check = cycle_check(sequence)
    if check != request.check:
        return memory, _refuse(Error.CHECK, f"check {request.check}, expected {check}")
    refusal = cycle_refusal(sequence, memory.caps)
    if refusal is not None:
        return memory, refusal
    if memory.interlock == "open":
        return memory, _refuse(Error.INTERLOCK, "interlock open")
    return replace(memory, state="armed"), m.Armed(check=check, cycle=cycle_ticks(sequence))


def _trim(memory: ControllerMemory, request: m.Trim) -> m.Reply | m.Refusal:
    if request.ppm > MAX_TRIM_PPM:
        return _refuse(Error.RANGE, f"ppm {request.ppm} > max_trim_ppm {MAX_TRIM_PPM}")
    refusal = trim_refusal(memory.sequence or (), memory.caps, signed_ppm(request))
    return refusal or m.Trimmed(way=request.way, ppm=request.ppm)


def signed_ppm(trim: m.Trim) -> int:
    """Return by how many ppm a trim makes steps longer, below 0 where shorter."""
    return trim.ppm if trim.way == "later" else -trim.ppm


def _refuse(code: Error, text: str) -> m.Refusal:
    return m.Refusal(code=code, text=text)
