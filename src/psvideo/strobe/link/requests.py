"""Requests of the strobe link as records: what a host asks.

A request's fields are its words in order; the table that they are held to is lights/protocol.toml, and what they mean
stands in lights/protocol.md. ``protocol`` makes lines of them and reads them.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from psvideo.strobe.link.replies import (
    Armed,
    Capabilities,
    Cleared,
    ClockReading,
    Identity,
    KeepSet,
    Renewed,
    Reply,
    SlotSet,
    Started,
    Status,
    StepsSet,
    Stopped,
    Trimmed,
    WiringSet,
)
from psvideo.strobe.link.words import STATES, Nonce, State, Way, WiringName


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
