"""Replies of the strobe link as records: what a controller answers.

A reply's fields are its keys in order; the table that they are held to is lights/protocol.toml, and what they mean
stands in lights/protocol.md. ``protocol`` makes lines of them and reads them.
"""

from dataclasses import dataclass

from psvideo.strobe.link.words import Fault, Interlock, Nonce, Reset, State, Way, WiringName


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
    """The steps behind the one that is played are longer (flashes come later) or shorter by this many ppm."""

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
