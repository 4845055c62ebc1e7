"""Messages of the strobe link as records: what a host asks, and what a controller answers.

A request's fields are its words in order, a reply's fields its keys in order; the table that both are held to is
lights/protocol.toml, and what they mean stands in lights/protocol.md. ``protocol`` turns them into lines and back.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal, NewType, get_args

PROTOCOL = 1

State = Literal["idle", "armed", "running", "fault"]
Fault = Literal["none", "silent", "interlock", "late", "watchdog"]
Reset = Literal["power", "external", "brownout", "watchdog", "other"]
WiringName = Literal["gated", "direct"]
Interlock = Literal["closed", "open"]
Way = Literal["later", "sooner"]
Nonce = NewType("Nonce", str)
STATES: tuple[State, ...] = get_args(State)
WIRINGS: tuple[WiringName, ...] = get_args(WiringName)
WAYS: tuple[Way, ...] = get_args(Way)


@dataclass(frozen=True, kw_only=True)
class Reply:
    """What a controller answers where it does what was asked."""


@dataclass(frozen=True, kw_only=True)
class Refusal:
    """What a controller answers where it does not: the reason's number, and words for people."""

    code: int
    text: str


@dataclass(frozen=True, kw_only=True)
class Identity(Reply):
    """Who answers: ``board`` is a board of the table, ``unit`` distinguishes two boards of a kind."""

    proto: int
    board: str
    firmware: str
    unit: str


@dataclass(frozen=True, kw_only=True)
class Capabilities(Reply):
    """What a board can play with the wiring that is set: times in ticks, shares of a cycle in ppm."""

    tick_ps: int
    wiring: WiringName
    lines: int
    powers: int
    slots: int
    steps: int
    min_on: int
    min_off: int
    min_dark: int
    max_flash: int
    max_period: int
    max_line_ppm: int
    max_total_ppm: int
    tolerance_ppm: int
    keep_ms: int


@dataclass(frozen=True, kw_only=True)
class WiringSet(Reply):
    """The wiring is set; slots and steps are forgotten."""

    wiring: WiringName


@dataclass(frozen=True, kw_only=True)
class KeepSet(Reply):
    """The keep-alive time is set."""

    keep_ms: int


@dataclass(frozen=True, kw_only=True)
class Renewed(Reply):
    """Slots and steps are forgotten."""


@dataclass(frozen=True, kw_only=True)
class SlotSet(Reply):
    """A slot is stored."""

    slot: int


@dataclass(frozen=True, kw_only=True)
class StepsSet(Reply):
    """Steps are stored; ``steps`` is how many there are now."""

    steps: int


@dataclass(frozen=True, kw_only=True)
class Armed(Reply):
    """Ready to run; ``cycle`` is the cycle's length in ticks."""

    check: int
    cycle: int


@dataclass(frozen=True, kw_only=True)
class Started(Reply):
    """Running; ``start`` is the tick of the first flash."""

    start: int


@dataclass(frozen=True, kw_only=True)
class Trimmed(Reply):
    """The steps behind the one that is played are longer (flashes come later) or shorter by so many ppm."""

    way: Way
    ppm: int


@dataclass(frozen=True, kw_only=True)
class Stopped(Reply):
    """Dark; ``cycles`` is how many whole cycles were played."""

    state: State
    cycles: int


@dataclass(frozen=True, kw_only=True)
class Status(Reply):
    """How the controller is."""

    state: State
    fault: Fault
    reset: Reset
    interlock: Interlock
    cycle: int
    step: int
    cycles: int


@dataclass(frozen=True, kw_only=True)
class ClockReading(Reply):
    """The controller's clock when the request's line ended."""

    nonce: Nonce
    cycle: int
    ticks: int


@dataclass(frozen=True, kw_only=True)
class Cleared(Reply):
    """Faults are cleared."""

    state: State


@dataclass(frozen=True, kw_only=True)
class Lit:
    """A line that a slot lights: on for ``on`` ticks of every period."""

    line: int
    on: int


@dataclass(frozen=True, kw_only=True)
class Request:
    """What a host asks. ``name`` is its first word; it is allowed in ``states``; ``reply`` is what answers it."""

    name: ClassVar[str]
    reply: ClassVar[type[Reply]]
    states: ClassVar[tuple[State, ...]] = STATES


@dataclass(frozen=True, kw_only=True)
class Id(Request):
    """Who are you?"""

    name = "ID"
    reply = Identity


@dataclass(frozen=True, kw_only=True)
class Caps(Request):
    """What can you play?"""

    name = "CAPS"
    reply = Capabilities


@dataclass(frozen=True, kw_only=True)
class Wiring(Request):
    """Choose how lights are wired; forgets slots and steps."""

    name = "WIRING"
    reply = WiringSet
    states = ("idle",)
    wiring: WiringName


@dataclass(frozen=True, kw_only=True)
class Keep(Request):
    """Set how long the host may be silent while armed or running."""

    name = "KEEP"
    reply = KeepSet
    states = ("idle", "armed", "running")
    ms: int


@dataclass(frozen=True, kw_only=True)
class New(Request):
    """Forget slots and steps."""

    name = "NEW"
    reply = Renewed
    states = ("idle", "armed")


@dataclass(frozen=True, kw_only=True)
class Slot(Request):
    """A flash, in ticks: ``lit`` lines in bursts of ``period``, and ``dark`` behind it."""

    name = "SLOT"
    reply = SlotSet
    states = ("idle",)
    slot: int
    duration: int
    dark: int
    period: int
    lit: tuple[Lit, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Steps(Request):
    """Part of the cycle: ``slots`` from place ``first`` on."""

    name = "STEPS"
    reply = StepsSet
    states = ("idle",)
    first: int
    slots: tuple[int, ...]


@dataclass(frozen=True, kw_only=True)
class Arm(Request):
    """Make ready; ``check`` is the checksum over all steps."""

    name = "ARM"
    reply = Armed
    states = ("idle",)
    check: int


@dataclass(frozen=True, kw_only=True)
class Run(Request):
    """Play ``cycles`` cycles; 0 means until it is stopped."""

    name = "RUN"
    reply = Started
    states = ("armed",)
    cycles: int


@dataclass(frozen=True, kw_only=True)
class Trim(Request):
    """Make the steps that come longer than uploaded (``later``) or shorter (``sooner``), until the run ends."""

    name = "TRIM"
    reply = Trimmed
    states = ("running",)
    way: Way
    ppm: int


@dataclass(frozen=True, kw_only=True)
class Stop(Request):
    """Dark, at once."""

    name = "STOP"
    reply = Stopped


@dataclass(frozen=True, kw_only=True)
class Stat(Request):
    """How are you?"""

    name = "STAT"
    reply = Status


@dataclass(frozen=True, kw_only=True)
class Clk(Request):
    """What is the time?"""

    name = "CLK"
    reply = ClockReading
    nonce: Nonce


@dataclass(frozen=True, kw_only=True)
class Clear(Request):
    """Clear latched faults."""

    name = "CLEAR"
    reply = Cleared
    states = ("idle", "fault")


REQUESTS: Mapping[str, type[Request]] = {
    kind.name: kind for kind in (Id, Caps, Wiring, Keep, New, Slot, Steps, Arm, Run, Trim, Stop, Stat, Clk, Clear)
}
