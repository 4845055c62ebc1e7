"""Words of the strobe link: what states, faults and wirings are called in it."""

from typing import Literal, NewType, get_args

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
