"""What a controller refuses to play: the same rules for the host, before anything is sent, and for the Python board.

They are specified in lights/protocol.md; the firmware enforces them too.
"""

import struct
from collections.abc import Sequence

from psvideo.strobe.link.lines import Error, crc16
from psvideo.strobe.link.replies import Capabilities, Refusal
from psvideo.strobe.link.requests import Slot

LONGEST_DARK_TICKS = 2**31 - 1
LONGEST_CYCLE_S = 60
PPM = 1_000_000
CHECKED_LINES = 8


def lit_ticks(slot: Slot, line: int) -> int:
    """Return for how many ticks of one flash a line is on.

    >>> from psvideo.strobe.link.requests import Lit
    >>> lit_ticks(Slot(slot=0, duration=250, dark=200, period=100, lit=(Lit(line=1, on=40),)), 1)
    120
    """
    on = next((lit.on for lit in slot.lit if lit.line == line), 0)
    whole, rest = divmod(slot.duration, slot.period)
    return whole * on + min(on, rest)


def slot_refusal(slot: Slot, caps: Capabilities) -> Refusal | None:
    """Return why a controller does not take a slot, None where it does."""
    return _number_refusal(slot, caps) or _time_refusal(slot, caps) or _burst_refusal(slot, caps)


def _number_refusal(slot: Slot, caps: Capabilities) -> Refusal | None:
    if slot.slot >= caps.slots:
        return _refuse(Error.RANGE, f"slot {slot.slot}, this board has {caps.slots}")
    return None


def _time_refusal(slot: Slot, caps: Capabilities) -> Refusal | None:
    if slot.duration > caps.max_flash:
        return _refuse(Error.LIMIT, f"duration {slot.duration} > max_flash {caps.max_flash}")
    if slot.duration == 0:
        return _refuse(Error.RANGE, "duration 0")
    if slot.dark < caps.min_dark:
        return _refuse(Error.LIMIT, f"dark {slot.dark} < min_dark {caps.min_dark}")
    if slot.dark > LONGEST_DARK_TICKS:
        return _refuse(Error.RANGE, f"dark {slot.dark} > {LONGEST_DARK_TICKS}")
    if slot.period > slot.duration:
        return _refuse(Error.RANGE, f"period {slot.period} > duration {slot.duration}")
    if slot.period > caps.max_period:
        return _refuse(Error.LIMIT, f"period {slot.period} > max_period {caps.max_period}")
    if slot.period == 0:
        return _refuse(Error.RANGE, "period 0")
    return None


def _burst_refusal(slot: Slot, caps: Capabilities) -> Refusal | None:
    for lit in slot.lit:
        if not 0 < lit.on <= slot.period:
            return _refuse(Error.RANGE, f"on {lit.on}, period {slot.period}")
    lines = [lit.line for lit in slot.lit]
    for place, line in enumerate(lines):
        if line in lines[:place]:
            return _refuse(Error.RANGE, f"line {line} twice")
        if line >= caps.lines:
            return _refuse(Error.RANGE, f"line {line}, this wiring has {caps.lines}")
    rest = slot.duration % slot.period
    for lit in slot.lit:
        shortest = min(lit.on, rest) if rest else lit.on
        if shortest < caps.min_on:
            return _refuse(Error.LIMIT, f"on {shortest} < min_on {caps.min_on}")
        if 0 < slot.period - lit.on < caps.min_off:
            return _refuse(Error.LIMIT, f"off {slot.period - lit.on} < min_off {caps.min_off}")
    powers = len({lit.on for lit in slot.lit})
    if powers > caps.powers:
        return _refuse(Error.POWERS, f"powers {powers}, this wiring plays {caps.powers} in a flash")
    return None


def cycle_ticks(steps: Sequence[Slot]) -> int:
    """Return the length of a cycle."""
    return sum(slot.duration + slot.dark for slot in steps)


def share_ppm(steps: Sequence[Slot], line: int) -> int:
    """Return the share of a cycle that a line is on, rounded down."""
    return sum(lit_ticks(slot, line) for slot in steps) * PPM // cycle_ticks(steps)


def total_ppm(steps: Sequence[Slot]) -> int:
    """Return the shares of all lines, summed before they are rounded down."""
    lit = sum(lit_ticks(slot, lit.line) for slot in steps for lit in slot.lit)
    return lit * PPM // cycle_ticks(steps)


def cycle_refusal(steps: Sequence[Slot], caps: Capabilities, *, longer: int = 0) -> Refusal | None:
    """Return why a controller does not play a cycle that is ``longer`` by some ticks, None where it does."""
    ticks = cycle_ticks(steps) + longer
    for line in range(caps.lines):
        share = sum(lit_ticks(slot, line) for slot in steps) * PPM // ticks
        if share > caps.max_line_ppm:
            return _refuse(Error.LIMIT, f"line {line} on for {share} ppm > max_line_ppm {caps.max_line_ppm}")
    total = sum(lit_ticks(slot, lit.line) for slot in steps for lit in slot.lit) * PPM // ticks
    if total > caps.max_total_ppm:
        return _refuse(Error.LIMIT, f"total {total} ppm > max_total_ppm {caps.max_total_ppm}")
    longest = LONGEST_CYCLE_S * 10**12 // caps.tick_ps
    if ticks > longest:
        return _refuse(Error.LIMIT, f"cycle {ticks} > {longest}")
    return None


def least_longer(steps: Sequence[Slot], ppm: int) -> int:
    """Return by how many ticks a trim makes each step longer at least; some are by one more.

    >>> least_longer([Slot(slot=0, duration=1600, dark=15_080, period=1600)], -100)
    -2
    """
    return cycle_ticks(steps) * ppm // (PPM * len(steps))


def trim_refusal(steps: Sequence[Slot], caps: Capabilities, ppm: int) -> Refusal | None:
    """Return why a controller does not make a cycle's steps longer (or shorter, below 0) by this many ppm."""
    if min(slot.dark for slot in steps) + least_longer(steps, ppm) < 2 * caps.min_dark:
        return _refuse(Error.LIMIT, f"dark < 2 min_dark {2 * caps.min_dark}")
    ticks = cycle_ticks(steps) * abs(ppm) // PPM + 1
    return cycle_refusal(steps, caps, longer=-ticks if ppm < 0 else ticks)


def cycle_check(steps: Sequence[Slot]) -> int:
    """Return the checksum by which host and controller know that they mean the same cycle."""
    return crc16(b"".join(map(_step_bytes, steps)))


def _step_bytes(slot: Slot) -> bytes:
    on = [0] * CHECKED_LINES
    for lit in slot.lit:
        on[lit.line] = lit.on
    return struct.pack("<11I", slot.duration, slot.dark, slot.period, *on)


def _refuse(code: Error, text: str) -> Refusal:
    return Refusal(code=code, text=text)
