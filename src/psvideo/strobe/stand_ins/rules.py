"""What a controller answers: from its memory and a request to its memory afterwards and the reply. Pure functions.

Time, edges and bytes are ``python_board``'s; what is right stands in lights/protocol.md.
"""

from dataclasses import dataclass, replace

from psvideo.strobe.limits import cycle_check, cycle_refusal, cycle_ticks, slot_refusal, trim_refusal
from psvideo.strobe.link import replies, requests, words
from psvideo.strobe.link.boards import KEEP_AFTER_RESET_MS, KEEP_MS, MAX_TRIM_PPM, Board, capabilities
from psvideo.strobe.link.lines import Error

FIRMWARE = "python-1"


@dataclass(frozen=True, kw_only=True)
class ControllerMemory:
    """What a controller knows. A reset clears all but the board, its unit and the interlock's wire."""

    board: Board
    unit: str
    wiring: words.WiringName
    interlock: words.Interlock = "closed"
    keep_ms: int = KEEP_AFTER_RESET_MS
    state: words.State = "idle"
    fault: words.Fault = "none"
    reset: words.Reset = "power"
    slots: tuple[requests.Slot | None, ...] = ()
    steps: tuple[int, ...] = ()
    cycle: int = 0
    step: int = 0
    cycles: int = 0

    @property
    def caps(self) -> replies.Capabilities:
        """What the board can play with the wiring that is set."""
        return capabilities(self.board, self.wiring, keep_ms=self.keep_ms)

    @property
    def sequence(self) -> tuple[requests.Slot, ...] | None:
        """The flashes of the cycle in order; None where the upload is incomplete."""
        slots = [self.slots[step] for step in self.steps]
        known = tuple(slot for slot in slots if slot is not None)
        return known if known and len(known) == len(slots) else None


def after_reset(
    board: Board, unit: str, *, cause: words.Reset, interlock: words.Interlock = "closed"
) -> ControllerMemory:
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


Answer = tuple[ControllerMemory, replies.Reply | replies.Refusal]


def answer(memory: ControllerMemory, request: requests.Request, *, ticks: int, start: int) -> Answer:
    """Return what a request does and what is answered to it, in a state that allows it.

    ``ticks`` is the controller's clock; a run that begins now has its first flash at ``start``.
    """
    match request:
        case requests.Wiring() | requests.Keep() | requests.New():
            return _settings(memory, request)
        case requests.Slot() | requests.Steps() | requests.Arm():
            return _upload(memory, request)
        case requests.Run():
            return replace(memory, state="running", cycle=0, step=0, cycles=0), replies.Started(start=start)
        case requests.Trim():
            return memory, _trim(memory, request)
        case requests.Stop():
            state: words.State = "fault" if memory.state == "fault" else "idle"
            return replace(memory, state=state), replies.Stopped(state=state, cycles=memory.cycles)
        case requests.Clear():
            if memory.interlock == "open":
                return memory, _refuse(Error.INTERLOCK, "interlock open")
            return replace(memory, state="idle", fault="none"), replies.Cleared(state="idle")
        case requests.Clk():
            return memory, replies.ClockReading(nonce=request.nonce, cycle=memory.cycle, ticks=ticks)
        case _:
            return memory, _about(memory, request)


def _about(memory: ControllerMemory, request: requests.Request) -> replies.Reply:
    if isinstance(request, requests.Id):
        return replies.Identity(proto=words.PROTOCOL, board=memory.board.name, firmware=FIRMWARE, unit=memory.unit)
    if isinstance(request, requests.Caps):
        return memory.caps
    return replies.Status(
        state=memory.state,
        fault=memory.fault,
        reset=memory.reset,
        interlock=memory.interlock,
        cycle=memory.cycle,
        step=memory.step,
        cycles=memory.cycles,
    )


def _settings(memory: ControllerMemory, request: requests.Wiring | requests.Keep | requests.New) -> Answer:
    empty = replace(memory, slots=(None,) * memory.board.slots, steps=())
    if isinstance(request, requests.New):
        return replace(empty, state="idle"), replies.Renewed()
    if isinstance(request, requests.Keep):
        if not KEEP_MS[0] <= request.ms <= KEEP_MS[1]:
            return memory, _refuse(Error.RANGE, f"ms {request.ms}, from {KEEP_MS[0]} to {KEEP_MS[1]}")
        return replace(memory, keep_ms=request.ms), replies.KeepSet(keep_ms=request.ms)
    if request.wiring not in memory.board.lines:
        known = " ".join(memory.board.lines)
        return memory, _refuse(Error.RANGE, f"wiring {request.wiring}, this board has {known}")
    return replace(empty, wiring=request.wiring), replies.WiringSet(wiring=request.wiring)


def _upload(memory: ControllerMemory, request: requests.Slot | requests.Steps | requests.Arm) -> Answer:
    if isinstance(request, requests.Slot):
        refusal = slot_refusal(request, memory.caps)
        if refusal is not None:
            return memory, refusal
        slots = (*memory.slots[: request.slot], request, *memory.slots[request.slot + 1 :])
        return replace(memory, slots=slots), replies.SlotSet(slot=request.slot)
    if isinstance(request, requests.Steps):
        return _write_steps(memory, request)
    return _arm(memory, request)


def _write_steps(memory: ControllerMemory, request: requests.Steps) -> Answer:
    board, held = memory.board, len(memory.steps)
    count, highest = request.first + len(request.slots), max(request.slots)
    if request.first > held:
        return memory, _refuse(Error.RANGE, f"first {request.first}, there are {held} steps")
    if count > board.steps:
        return memory, _refuse(Error.RANGE, f"steps {count}, this board has {board.steps}")
    if highest >= board.slots:
        return memory, _refuse(Error.RANGE, f"slot {highest}, this board has {board.slots}")
    return replace(memory, steps=memory.steps[: request.first] + request.slots), replies.StepsSet(steps=count)


def _arm(memory: ControllerMemory, request: requests.Arm) -> Answer:
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
    return replace(memory, state="armed"), replies.Armed(check=check, cycle=cycle_ticks(sequence))


def _trim(memory: ControllerMemory, request: requests.Trim) -> replies.Reply | replies.Refusal:
    if request.ppm > MAX_TRIM_PPM:
        return _refuse(Error.RANGE, f"ppm {request.ppm} > max_trim_ppm {MAX_TRIM_PPM}")
    refusal = trim_refusal(memory.sequence or (), memory.caps, signed_ppm(request))
    return refusal or replies.Trimmed(way=request.way, ppm=request.ppm)


def signed_ppm(trim: requests.Trim) -> int:
    """Return by how many ppm a trim makes steps longer, below 0 where shorter."""
    return trim.ppm if trim.way == "later" else -trim.ppm


def _refuse(code: Error, text: str) -> replies.Refusal:
    return replies.Refusal(code=code, text=text)
