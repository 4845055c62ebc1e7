"""The only part that touches hardware: pins, timer, watchdog, PIO and DMA of the RP2040, and the USB port.

Registers are written through machine.mem32, because the control blocks hold them as words anyway; rp2.DMA is there to
claim channels, so that nothing else on the board takes them.
"""

import select
import sys
import time
from array import array

import machine
import micropython
import rp2
import uctypes

from controller import Controller
from link import LINES, START_DELAY, TICKS_PER_US
from pace import RING
from table import GROUP_LINES, GROUPS, TABLE_WORDS, TURNS, control_word

FIRST_PIN, INTERLOCK_PIN, SERVICE_PIN = 2, 10, 11
WATCHDOG_MS = 500
TIMER_HIGH, TIMER_LOW = 0x40054024, 0x40054028
CHIP_RESET, WATCHDOG_REASON, WATCHDOG_SCRATCH = 0x40064008, 0x40058008, 0x4005801C
WATCHDOG_ENABLED = 0x6AB73121  # what the SDK leaves in the scratch register where the watchdog was switched on
PIO, PIO_FDEBUG, PIO_FIFO, PIO_INSTRUCTION = 0x50200000, 0x50200008, 0x50200010, 0x502000D8
PIO_NEXT_INSTRUCTION = 0x18
PINS_LOW = 0xA003  # mov pins, null
STALLED = 3 << 24
DMA, DMA_ABORT = 0x50000000, 0x50000444
UNPACED = 0x3F
CHANNELS = 4  # for each group


def reset_cause(chip, reason, scratch):
    """Why the chip started, of the table's names, from three registers."""
    if reason:
        return "watchdog" if reason & 1 and scratch == WATCHDOG_ENABLED else "other"
    return "external" if chip & 1 << 16 else "power" if chip & 1 << 8 else "other"


def play():
    """The PIO program of both state machines."""
    wrap_target()
    out(pins, 4)
    out(pins, 4)
    out(pins, 4)
    out(pins, 4)
    out(pins, 4)
    out(pins, 4)
    out(pins, 4)
    out(pins, 4)
    out(x, 32)
    label("longer")
    jmp(x_dec, "longer")
    wrap()


class Link:
    """What one group's table has to know of the hardware. Its channels: data, control, turn, pace."""

    def __init__(self, group, channels, memory, turns):
        self.fifo = PIO_FIFO + 4 * group
        self.treq = group
        self.data, self.control, self.turn, self.pace = channels[:CHANNELS]
        self.memory, self.turns = memory, turns
        self.ending = memory[2] + 4  # the wait of the table's first entry


class Pico:
    """The board: time, interlock, and a state machine with four DMA channels for each group of lines."""

    def __init__(self):
        machine.freq(1000000 * TICKS_PER_US)
        for pin in range(FIRST_PIN, FIRST_PIN + LINES):
            machine.Pin(pin, machine.Pin.OUT, value=0)
        self.interlock = machine.Pin(INTERLOCK_PIN, machine.Pin.IN, machine.Pin.PULL_UP)
        self.program = rp2.asm_pio(
            out_init=(rp2.PIO.OUT_LOW,) * GROUP_LINES,
            out_shiftdir=rp2.PIO.SHIFT_RIGHT,
            autopull=True,
            pull_thresh=32,
            fifo_join=rp2.PIO.JOIN_TX,
        )(play)
        self.machines = [rp2.StateMachine(group) for group in range(GROUPS)]
        self.claimed = [rp2.DMA() for _ in range(CHANNELS * GROUPS)]
        numbers = [claim.channel for claim in self.claimed]
        words, first, address = self._memory((GROUPS + 1) * TURNS, 4 * TURNS)  # rings that the DMA reads
        rings = [(words, first + TURNS * place, address + 4 * TURNS * place) for place in range(GROUPS + 1)]
        self.pace = rings[GROUPS]
        self.links = [
            Link(group, numbers[CHANNELS * group :], self._memory(TABLE_WORDS, 64), rings[group])
            for group in range(GROUPS)
        ]
        self._load()
        self.darken()

    def _memory(self, words, align):
        buffer = array("I", bytes(4 * words + align))
        address = uctypes.addressof(buffer)
        skipped = -address % align
        return buffer, skipped // 4, address + skipped

    def _load(self):
        for group, state_machine in enumerate(self.machines):
            pin = machine.Pin(FIRST_PIN + GROUP_LINES * group)
            state_machine.init(self.program, freq=1000000 * TICKS_PER_US, out_base=pin)

    def _now_us(self):
        while True:
            high = machine.mem32[TIMER_HIGH]
            low = machine.mem32[TIMER_LOW]
            if high == machine.mem32[TIMER_HIGH]:
                return (high << 32) + low

    def ticks(self):
        return self._now_us() * TICKS_PER_US

    def interlock_open(self):
        return bool(self.interlock.value())

    def starved(self):
        """Has a state machine run out of words since the start?"""
        return bool(machine.mem32[PIO_FDEBUG] & STALLED)

    def read_places(self):
        """Which place of the pace's ring each group reads next."""
        return [(machine.mem32[DMA + 64 * link.pace] >> 2) % RING for link in self.links]

    def _set_channel(self, channel, read, write, count, control):
        for place, word in ((0, read), (4, write), (8, count), (16, control)):  # 16: CTRL without a trigger
            machine.mem32[DMA + 64 * channel + place] = word

    def start(self, lead_addresses):
        """Begin with the lead and return the tick in which the first flash starts behind it."""
        self._load()
        for group, link in enumerate(self.links):
            lead = lead_addresses[group]
            ring = control_word(UNPACED, link.turn, 0, 12)
            self._set_channel(link.turn, link.turns[2], DMA + 64 * link.control + 0x3C, 1, ring)
            ring = control_word(UNPACED, link.control, 0, 12)
            self._set_channel(link.pace, self.pace[2], link.ending, 1, ring)
            ring = control_word(UNPACED, link.control, 1, 4, 1)
            self._set_channel(link.control, lead, DMA + 64 * link.data, 4, ring)
            machine.mem32[DMA + 64 * link.control + 0x3C] = lead  # and go
        time.sleep_us(100)
        memory = machine.mem32
        interrupts = machine.disable_irq()
        before = memory[TIMER_LOW]
        memory[PIO] = 0x303  # both in the same cycle
        after = memory[TIMER_LOW]
        machine.enable_irq(interrupts)
        memory[PIO_FDEBUG] = STALLED
        now_us = self._now_us()
        since_us = (now_us - before - ((after - before & 0xFFFFFFFF) >> 1)) & 0xFFFFFFFF
        return (now_us - since_us) * TICKS_PER_US + START_DELAY

    def darken(self):
        machine.mem32[PIO] = 0
        for group in range(GROUPS):
            machine.mem32[PIO_INSTRUCTION + PIO_NEXT_INSTRUCTION * group] = PINS_LOW
        channels = [number for link in self.links for number in (link.pace, link.turn, link.control, link.data)]
        for channel in channels:  # a channel that is enabled may be triggered again by one that is aborted
            machine.mem32[DMA + 64 * channel + 16] = 0
        machine.mem32[DMA_ABORT] = sum([1 << channel for channel in channels])
        for _ in range(100):  # a word on its way takes some cycles; the pins are low already
            if not machine.mem32[DMA_ABORT]:
                break


def main():
    """Serve for ever. An error ends in the dark, and in a reset by the watchdog."""
    pico = Pico()
    cause = reset_cause(*[machine.mem32[register] for register in (CHIP_RESET, WATCHDOG_REASON, WATCHDOG_SCRATCH)])
    watchdog = machine.WDT(timeout=WATCHDOG_MS)
    micropython.kbd_intr(-1)  # a byte 3 is garbage like any other
    unit = "".join([f"{byte:02x}" for byte in machine.unique_id()])[-8:]
    controller = Controller(pico, unit, cause)
    ready = select.poll()
    ready.register(sys.stdin, select.POLLIN)
    try:
        while True:
            watchdog.feed()
            controller.poll()
            if ready.poll(0):
                answer = controller.feed(sys.stdin.buffer.read(1))
                if answer:
                    sys.stdout.buffer.write(answer)
    finally:
        pico.darken()


def run():
    """Begin, unless this is another chip, or the service jumper is set."""
    if "RP2040" not in sys.implementation._machine:
        raise RuntimeError("this program is for the RP2040: its registers are elsewhere on other chips")
    if machine.Pin(SERVICE_PIN, machine.Pin.IN, machine.Pin.PULL_UP).value():
        main()
