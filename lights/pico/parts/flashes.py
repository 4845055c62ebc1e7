"""What may be played. A slot is (duration, dark, period, [(line, on), ...]), as lights/protocol.md says."""

import struct

from lines import crc16
from link import (
    LINES,
    LONGEST_DARK,
    MAX_CYCLE,
    MAX_FLASH,
    MAX_LINE_PPM,
    MAX_TOTAL_PPM,
    MIN_DARK,
    MIN_OFF,
    MIN_ON,
    RefusedError,
)


def check_slot(duration, dark, period, lit):
    """Refuse what the board does not play, in the order of lights/protocol.md."""
    if duration > MAX_FLASH:
        raise RefusedError("limit", f"duration {duration} > max_flash {MAX_FLASH}")
    if duration == 0:
        raise RefusedError("range", "duration 0")
    if dark < MIN_DARK:
        raise RefusedError("limit", f"dark {dark} < min_dark {MIN_DARK}")
    if dark > LONGEST_DARK:
        raise RefusedError("range", f"dark {dark} > {LONGEST_DARK}")
    if not 0 < period <= duration:
        raise RefusedError("range", f"period {period}, duration {duration}")
    _check_lit(period, lit)
    rest = duration % period
    for _, on in lit:
        shortest = min(on, rest) if rest else on
        if shortest < MIN_ON:
            raise RefusedError("limit", f"on {shortest} < min_on {MIN_ON}")
        if 0 < period - on < MIN_OFF:
            raise RefusedError("limit", f"off {period - on} < min_off {MIN_OFF}")


def _check_lit(period, lit):
    seen = []
    for line, on in lit:
        if not 0 < on <= period:
            raise RefusedError("range", f"on {on}, period {period}")
        if line in seen or line >= LINES:
            raise RefusedError("range", f"line {line} twice, or this board has not")
        seen.append(line)


def lit_ticks(slot):
    """For how many ticks of one flash each line is on."""
    duration, _, period, lit = slot
    ticks = [0] * LINES
    for line, on in lit:
        ticks[line] = duration // period * on + min(on, duration % period)
    return ticks


def check_cycle(slots):
    """Refuse a cycle that is lit too much or lasts too long; returns its length, and for how long lines are on."""
    cycle = sum([slot[0] + slot[1] for slot in slots])
    each = [lit_ticks(slot) for slot in slots]
    lit = [sum([ticks[line] for ticks in each]) for line in range(LINES)]
    _check_shares(cycle, lit)
    return cycle, lit


def _check_shares(cycle, lit):
    for line, ticks in enumerate(lit):
        if ticks * 1000000 // cycle > MAX_LINE_PPM:
            raise RefusedError("limit", f"line {line} {ticks * 1000000 // cycle} ppm > max_line_ppm {MAX_LINE_PPM}")
    if sum(lit) * 1000000 // cycle > MAX_TOTAL_PPM:
        raise RefusedError("limit", f"total {sum(lit) * 1000000 // cycle} ppm > max_total_ppm {MAX_TOTAL_PPM}")
    if cycle > MAX_CYCLE:
        raise RefusedError("limit", f"cycle {cycle} > {MAX_CYCLE}")


def check_trim(ppm, cycle, lit, steps, shortest_dark):
    """Refuse to have a cycle's steps last longer by so many ppm, or shorter below 0; ``lit`` is check_cycle's."""
    if shortest_dark + cycle * ppm // (1000000 * steps) < 2 * MIN_DARK:
        raise RefusedError("limit", f"dark < 2 min_dark {2 * MIN_DARK}")
    ticks = cycle * abs(ppm) // 1000000 + 1
    _check_shares(cycle - ticks if ppm < 0 else cycle + ticks, lit)


def check_of(slots):
    """The checksum by which host and board know that they mean the same cycle."""
    crc = 0xFFFF
    for duration, dark, period, lit in slots:
        on = [0] * LINES
        for line, ticks in lit:
            on[line] = ticks
        crc = crc16(struct.pack("<11I", duration, dark, period, *on), crc)
    return crc
